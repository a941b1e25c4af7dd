"""What every geometry of the wave generator gives: both rims' outermost points in both meshing zones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array

TIE_MM = 1e-12
"""Rims whose depths differ by less than this lie equally deep: a hundred roundings of a radius of 30 mm."""


@dataclass(frozen=True)
class DeepestPoints:
    """The deepest points of both meshing zones; the first axis of every array is the zone (0: near the + major end).

    `depth` delta = |H| - L_W, mm; `offset_cs` and `offset_fs` are the angles o, o' off the major axis, rad, positive
    toward +v in both zones, seen from the CS centre and in the wave generator's own frame; `rim` is the deepest rim,
    +1 or -1: where it changes, the offsets step.
    """

    depth: Array
    offset_cs: Array
    offset_fs: Array
    rim: Array

    @property
    def beyond(self) -> Array:
        """How far each zone's deepest point lies beyond its end of the major axis the way the wave generator turns,
        rad, (2, 2, ...): first the spline (o for the CS, o' for the FS), then the zone."""
        first, second = self.offset_cs, self.offset_fs
        return np.stack([np.stack([first[0], -first[1]]), np.stack([second[0], -second[1]])])


@dataclass(frozen=True)
class Branches:
    """The same for every rim: the first axis is the zone, the second the rim (0: +1, 1: -1, counted along the zone's
    own direction). Each branch is smooth over the input angle; only which one lies deepest changes."""

    depth: Array
    offset_cs: Array
    offset_fs: Array


def deepest(found: Branches) -> DeepestPoints:
    """The deeper rim of each zone of the branches `found`; equally deep ones count as the first."""
    upper = found.depth[:, 0] >= found.depth[:, 1] - TIE_MM

    def of_deeper(values: Array) -> Array:
        return np.where(upper, values[:, 0], values[:, 1])

    rim = np.where(upper, 1.0, -1.0)
    return DeepestPoints(of_deeper(found.depth), of_deeper(found.offset_cs), of_deeper(found.offset_fs), rim)
