"""The extended model: the kinematic error of a drive with the physics that the base model leaves out, as numbers.

`hdopt.diagnosis` finds effects in recordings; here they predict. The physics of an effect stands once, in its module of
`hdopt.effects`; this package evaluates it at a stated operating condition.
"""

from hdopt.simulation.effect_values import EffectValues
from hdopt.simulation.model import ExtendedModel
from hdopt.simulation.operation import Operation

__all__ = ["EffectValues", "ExtendedModel", "Operation"]
