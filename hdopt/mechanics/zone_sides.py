"""The four sides of the two zones of contact: before and behind each of the two tips of a wave generator."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.profiles import WaveGeneratorProfile


@dataclass(frozen=True)
class ZoneSide:
    """A profile as it is met from one of its tips in one direction: phi counts from the tip, towards the side.

    `profile` is the whole curve, `tip` the angle of the tip on it, rad, and `sense` 1.0 for the side that is clockwise
    of the tip, -1.0 for the other one.
    """

    profile: WaveGeneratorProfile
    tip: float
    sense: float
    tip_is_smooth = True

    @property
    def name(self) -> str:
        return self.profile.name

    @property
    def semi_major(self) -> float:
        return float(self.radius(0.0))

    @property
    def semi_minor(self) -> float:
        return float(self.radius(math.pi / 2))

    def radius(self, phi: ArrayLike, derivative: int = 0) -> Array:
        along = self.profile.radius(self.tip + self.sense * np.asarray(phi, float), derivative)
        return self.sense * along if derivative == 1 else along

    def perimeter(self) -> float:
        return self.profile.perimeter()


def zone_sides(profile: WaveGeneratorProfile) -> tuple[WaveGeneratorProfile, ...]:
    """The sides of both zones of a `profile`, each counted from its own tip over a quarter of a turn.

    One, the profile itself, where both tips are alike and the profile is symmetric about both axes; otherwise all four.
    """
    if profile.tip_is_smooth:
        return (profile,)
    return tuple(ZoneSide(profile, tip, sense) for tip in (0.0, math.pi) for sense in (1.0, -1.0))


def mean_of_sides(values: list[float]) -> float:
    """Mean of `values`, one for each side of the zones; does not depend on their order, and is a single one itself."""
    return math.fsum(values) / len(values)
