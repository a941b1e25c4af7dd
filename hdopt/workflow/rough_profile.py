"""What is to be said of a measured profile whose points scatter more than its curvature bears."""

from __future__ import annotations

import math

import numpy as np

from hdopt.drive.geometry import Drive
from hdopt.drive.profiles import MeasuredProfile, WaveGeneratorProfile, curvature
from hdopt.drive.scatter import scatter_of_points
from hdopt.errors import HdoptError

WRONG = 1.1
"""The largest change of curvature over that of the smoothed curve: beyond it the first digit told is the scatter's."""

ANGLES = np.arange(14400) * (2 * math.pi / 14400)
"""Places of a turn where curvature is looked at: 0.025 deg, as for the largest change of curvature."""


def words_on_a_rough_profile(drive: Drive) -> list[str]:
    """That the points of the measured profile of `drive` scatter, by how much and where most, and what to do: one
    sentence where that makes the largest change of curvature, [] where it does not or nothing was measured."""
    profile = drive.wave_generator.profile
    if not isinstance(profile, MeasuredProfile):
        return []
    table = profile.table
    scatter, worst = scatter_of_points(table.angles, table.radii)
    try:
        smooth = profile.smoothed(scatter)
    except HdoptError:  # so rough that its smoothed curve is no cam: what was wrong with it is said elsewhere
        return []
    radius = drive.geometry.flexspline_inner_radius
    times = _largest_change(profile, radius) / _largest_change(smooth, radius)
    if times <= WRONG:
        return []
    size, place = f"{1000 * scatter:.3g}", f"{math.degrees(table.angles[worst]):.4g}"
    kept = f"noise_um = {1000 * table.noise:g} is less" if table.noise else "the curve goes through every one"
    return [
        f"wave_generator: the points of {table.source} scatter by {size} um, most at {place} deg, and {kept}: its "
        f"largest change of curvature is {times:.3g} times that of the curve smoothed within the scatter; give "
        f"wave_generator.noise_um = {size}, or leave out a point that is wrong"
    ]


def _largest_change(profile: WaveGeneratorProfile, radius: float) -> float:
    """Largest change of curvature of the inner wall of `radius`, mm, that takes the `profile`, 1/mm."""
    return float(np.abs(curvature(profile, ANGLES) - 1 / radius).max())
