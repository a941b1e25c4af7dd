"""Limits of the slides of a wave generator: a block in a slot, their widths, depth and height, and how square they are.

The clearance that the study gives is the least one. Slot and block may each be wider apart by a quarter of it, and each
may lean by another quarter, so that half of it is left to slide in.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from hdopt.geometry.part import Part
from hdopt.geometry.slide_features import Slot, Tongue

STEP = 1e-4
"""Zones are rounded down to this, mm."""

DEEPER = 0.1
"""Largest tolerance of a slot's depth and a block's height, mm, and the share of the depth that it is in small ones."""


@dataclass(frozen=True)
class Slide:
    """A `block` on the part `below` that runs in the `slot` of the part `above`."""

    below: Part
    above: Part
    block: Tongue
    slot: Slot

    @property
    def clearance(self) -> float:
        """Between nominal slot and block, mm."""
        return self.slot.width - self.block.width

    @property
    def zone(self) -> float:
        """Tolerance of either width, and zone in which either stands upright, mm."""
        return round(math.floor(self.clearance / 4 / STEP + 1e-9) * STEP, 6)

    @property
    def squareness(self) -> float:
        """Zone of a block square to another slot, mm: the turn that the play allows in any case, for it takes the
        place of the profile but turns no tooth against another."""
        return self.clearance

    @property
    def play(self) -> float:
        """Axial play between the faces that lie on each other, mm."""
        return self.above.bottom - self.block.bottom

    @property
    def depth_limits(self) -> tuple[float, float]:
        """Deviations of the slot's depth, mm: never shallower, so that no block stands on the bottom of its slot."""
        return 0.0, self._deeper

    @property
    def height_limits(self) -> tuple[float, float]:
        """Deviations of the block's height, mm: never higher."""
        return -self._deeper, 0.0

    @property
    def _deeper(self) -> float:
        return round(DEEPER * min(1.0, self.slot.depth), 2)


def slides_of(parts: Sequence[Part]) -> list[Slide]:
    """The slides between `parts`, which are given from the lowest up."""
    return [
        Slide(below, above, below.body[-1], above.slot)
        for below, above in itertools.pairwise(parts)
        if isinstance(below.body[-1], Tongue) and above.slot is not None
    ]
