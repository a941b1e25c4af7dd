"""The extended model: the kinematic error of a drive with the physics that the base model leaves out, as numbers.

`hdopt.diagnosis` finds effects in recordings; here they predict. The physics of an effect stands once, in its module of
`hdopt.diagnosis.effects`; this package evaluates it at a stated operating condition.
"""

from hdopt.extended.effects import AddedEffect
from hdopt.extended.model import ExtendedModel
from hdopt.extended.operation import Operation

__all__ = ["AddedEffect", "ExtendedModel", "Operation"]
