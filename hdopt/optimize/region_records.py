"""Where a choice holds, in plain numbers: along each constant of the trade, and over two of them at once."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any  # Any: values of JSON

LEVELS = ("structure", "profile", "design")
"""What of a choice may change, from the coarsest to the finest: the design is its very numbers."""
NONE_LEFT = "no design keeps all limits"


@dataclass(frozen=True)
class Boundary:
    """Where one `level` of the choice (see `LEVELS`) ceases to hold: at `factor` times the constant's value, and what
    is chosen beyond."""

    level: str
    factor: float
    becomes: str

    @property
    def per_cent(self) -> float:
        """By how many per cent of its value the constant is away from the boundary, below 0 where it has to fall."""
        return 100 * (self.factor - 1)


@dataclass(frozen=True)
class ConstantRange:
    """One constant of the trade, followed from `lowest` to `highest` times its value, and the boundaries met: the
    nearest of each level on either side."""

    constant: str
    value: float
    unit: str
    source: str
    lowest: float
    highest: float
    boundaries: tuple[Boundary, ...]

    def at(self, level: str, upward: bool) -> Boundary | None:
        """The boundary of `level` on one side, None where there is none within reach."""
        found = [b for b in self.boundaries if b.level == level and (b.factor >= 1) == upward]
        return found[0] if found else None

    def nearest(self, *levels: str) -> Boundary | None:
        """The nearest boundary of `levels` (by the logarithm of its factor), None where none is within reach."""
        found = [b for b in self.boundaries if b.level in levels]
        return min(found, key=lambda b: abs(math.log(b.factor)), default=None)


@dataclass(frozen=True)
class RegionMap:
    """What is chosen over two constants: `chosen[i][j]` at `y_factors[i]` and `x_factors[j]` times their values is a
    place in `choices`, or -1 where no design keeps all limits; `excess` is the share by which today's numbers exceed
    the limit that they break most, below 0 where they keep all."""

    x: str
    y: str
    x_factors: tuple[float, ...]
    y_factors: tuple[float, ...]
    choices: tuple[str, ...]
    chosen: tuple[tuple[int, ...], ...]
    excess: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Regions:
    """Where the choice of a search holds: along each constant of its trade, and over the pairs that bound it most."""

    ranges: tuple[ConstantRange, ...]
    maps: tuple[RegionMap, ...]

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    @property
    def nearest(self) -> tuple[ConstantRange, Boundary] | None:
        """The constant whose change by the least share gives another structure or profile, and where; None where none
        does within reach."""
        found = [(r, b) for r in self.ranges if (b := r.nearest("structure", "profile")) is not None]
        return min(found, key=lambda pair: abs(math.log(pair[1].factor)), default=None)
