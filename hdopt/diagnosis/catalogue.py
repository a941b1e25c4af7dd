"""Everything that may enter a fit: the catalogue's effects and the descriptions that compete with them."""

from __future__ import annotations

from hdopt.diagnosis.effects import EFFECTS
from hdopt.diagnosis.outside import OUTSIDE

EXPLANATIONS = {**EFFECTS, **OUTSIDE}

STRAIN_WAVE_ONLY = ("tooth_mesh", "bearing_pass", "local_tooth_defect")
"""Effects at the orders of a strain wave gear's teeth and bearing: of another gear their numbers mean nothing."""


def is_outside(name: str) -> bool:
    """Whether `name` is a description without physics."""
    return name in OUTSIDE
