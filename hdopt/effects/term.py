"""An effect as a fit sees it: its columns at a given shape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any  # Any: each effect has shapes of its own

from hdopt.arrays import Array
from hdopt.effects.met import Met

Shape = Mapping[str, Any]
"""What of an effect is not linear: numbers, counts, categories and sets of waves, by the names that the effect gives
them. `Any`, since each effect has its own; those that a fit may move are floats."""


@dataclass(frozen=True)
class Term:
    """An effect written as columns of a linear fit at a given shape.

    `columns` (n, p) in arcmin per coefficient; or, inside the larger-zone rule of the base, `met`, a deviation that
    stands on a spline and is met where the zone's deepest point is, or `zones` (2, n, p) in mm, which the angles of the
    rows alone decide. `steps` names the shape parameters that may move in the fit, with a step for their derivative;
    `trials` is how many different shapes the search looked at, which the evidence pays for.
    """

    effect: str
    shape: Shape
    columns: Array | None = None
    zones: Array | None = None
    met: Met | None = None
    steps: Mapping[str, float] = field(default_factory=dict)
    trials: float = 1.0
    odds: float = 0.0
    """Log prior odds of this variant against the effect's plainest one."""
    doubtful: bool = False
    """Whether it must beat all others clearly: it has no physics, or stands at the orders of another effect."""
    doubtful_beside: tuple[str, ...] = ()
    """Effects, by their ids, beside which it is doubtful: it stands where they reach too."""
    kept: bool = False
    """Whether the rows remember this term, so that what is computed of it may be remembered too."""

    @property
    def width(self) -> int:
        """Number of coefficients."""
        if self.met is not None:
            return self.met.width
        source = self.columns if self.columns is not None else self.zones
        if source is None:
            raise ValueError(f"a term of {self.effect} has neither columns nor zones")
        return int(source.shape[-1])

    @property
    def in_zones(self) -> bool:
        """Whether it acts in the meshing zones."""
        return self.zones is not None or self.met is not None

    @property
    def freedom(self) -> int:
        """Number of coefficients and of shape parameters that move."""
        return self.width + len(self.steps)
