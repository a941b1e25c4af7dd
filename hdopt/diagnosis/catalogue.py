"""Everything that may enter a fit: the catalogue's effects and the descriptions that compete with them."""

from __future__ import annotations

from hdopt.diagnosis.effects import EFFECTS
from hdopt.diagnosis.outside import OUTSIDE

EXPLANATIONS = {**EFFECTS, **OUTSIDE}


def is_outside(name: str) -> bool:
    """Whether `name` is a description without physics."""
    return name in OUTSIDE
