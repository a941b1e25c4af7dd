"""Areas and parallel curves in closed form against plain counting and walking."""

from __future__ import annotations

import math

import cases
import numpy as np
import pytest

from hdopt.errors import HdoptError
from hdopt.geometry.areas import obround, segment_of_disc, slot_outside_disc, strip_of_disc
from hdopt.geometry.check import PROFILE_TOLERANCE
from hdopt.geometry.contour import Circle, ParallelCurve
from hdopt.geometry.din6885 import KEYS, key_for_bore
from hdopt.geometry.features import DBore, KeywayBore, PlainBore

CELL = 0.01
X, Y = np.meshgrid(*2 * [np.arange(-12, 12, CELL) + CELL / 2])
"""A fine raster: areas counted on it are right to about the outline's length times a fraction of a cell."""
RASTER_ERROR = 0.05


def counted(inside) -> float:
    return np.count_nonzero(inside) * CELL**2


def test_areas_agree_with_counted_cells():
    disc = np.hypot(X, Y) < 7
    assert strip_of_disc(5, 7) == pytest.approx(counted(disc & (abs(X) < 2.5)), abs=RASTER_ERROR)
    assert segment_of_disc(7, 4) == pytest.approx(counted(disc & (Y > 4)), abs=RASTER_ERROR)
    slot = (abs(X) < 2.5) & (Y > 0) & (Y < 9.3)
    assert slot_outside_disc(5, 9.3, 7) == pytest.approx(counted(slot & ~disc), abs=RASTER_ERROR)
    ends = np.hypot(X, abs(Y) - 5) < 3
    assert obround(10, 6) == pytest.approx(counted(ends | ((abs(X) < 3) & (abs(Y) < 5))), abs=RASTER_ERROR)


@pytest.mark.parametrize("strip", [4.0, 9.0, 12.5, 16.0])
@pytest.mark.parametrize("bore", [PlainBore(7), KeywayBore(7, key_for_bore(14)), DBore(7, 5.6)])
def test_bore_areas_agree_with_counted_cells(bore, strip):
    inside = np.hypot(X, Y) < 7
    if isinstance(bore, KeywayBore):
        # Its two corners are rounded; 0.205 mm is the middle of what DIN 6885-1 allows a key of 5 mm.
        beside, beyond = abs(X) - (2.5 - 0.205), Y - (9.3 - 0.205)
        sharp = (beside > 0) & (beyond > 0) & (np.hypot(beside, beyond) > 0.205)
        inside |= (abs(X) < 2.5) & (Y > 0) & (Y < 9.3) & ~sharp
    if isinstance(bore, DBore):
        inside &= Y < 5.6
    assert bore.area_in_strip(strip) == pytest.approx(counted(inside & (abs(Y) < strip / 2)), abs=RASTER_ERROR)
    for radius in (6.2, 7.4):
        united = counted(inside | (np.hypot(X, Y) < radius))
        assert bore.area_with_disc(radius) == pytest.approx(united, abs=RASTER_ERROR)


@pytest.mark.parametrize("profile", cases.PROFILES.values(), ids=cases.PROFILES.keys())
@pytest.mark.parametrize("distance", [3.0, -0.74])
def test_parallel_curve_keeps_its_distance_area_and_length(profile, distance):
    curve = ParallelCurve(profile, distance)
    phi = np.linspace(0, 2 * math.pi, 40001)
    points = curve.points(phi)
    base = profile.radius(phi)[:, None] * np.stack([np.sin(phi), np.cos(phi)], 1)
    assert np.hypot(*(points - base).T) == pytest.approx(abs(distance), abs=1e-12)
    assert curve.deviation(points) == pytest.approx(0, abs=1e-11)
    assert curve.deviation(base) == pytest.approx(distance, abs=1e-11)
    x, y = points.T
    # A polygon of n chords misses a curve's area and length by about 2 pi^2/(3 n^2) and pi^2/(6 n^2): 4e-9, 1e-9.
    assert curve.area == pytest.approx(abs(np.sum(x[1:] * y[:-1] - x[:-1] * y[1:])) / 2, rel=6e-9)
    assert curve.perimeter == pytest.approx(np.hypot(np.diff(x), np.diff(y)).sum(), rel=2e-9)
    assert curve.box == pytest.approx((x.min(), y.min(), x.max(), y.max()), abs=1e-6)
    slopes = np.gradient(points, phi, axis=0)[1:-1]
    assert curve.tangents(phi[1:-1]) == pytest.approx(slopes, abs=1e-4)


def test_parallel_of_an_ellipse_is_not_an_ellipse():
    """A scaled ellipse with the parallel curve's semi-axes is 0.23 um off: the check must tell the two apart."""
    curve = ParallelCurve(cases.TABLE_1_ELLIPSE, 3.0)
    u = np.linspace(0, 2 * math.pi, 721)
    scaled = np.stack([27.318 * np.sin(u), 28.046 * np.cos(u)], 1)
    assert np.abs(curve.deviation(scaled)).max() > 4 * PROFILE_TOLERANCE


@pytest.mark.parametrize("profile", cases.PROFILES.values(), ids=cases.PROFILES.keys())
def test_refuses_the_distance_at_which_the_curve_folds(profile):
    from hdopt.drive.profiles import curvature

    least = 1 / curvature(profile, np.linspace(0, 2 * math.pi, 7201)).max()
    ParallelCurve(profile, 0.999 * least)
    with pytest.raises(
        HdoptError, match=r"crosses itself: the profile's least radius of curvature is .* thinner bearing"
    ):
        ParallelCurve(profile, 1.001 * least)
    with pytest.raises(HdoptError, match="thinner bearing"):
        Circle(5.0).inward(5.0)


def test_keys_follow_the_bore():
    sizes = [
        (6, 2, 1.0),
        (8, 2, 1.0),
        (8.5, 3, 1.4),
        (14, 5, 2.3),
        (22, 6, 2.8),
        (25, 8, 3.3),
        (38, 10, 3.3),
        (130, 32, 7.4),
    ]
    for bore, width, depth in sizes:
        assert (key_for_bore(bore).width, key_for_bore(bore).hub_depth) == (width, depth)
    # In every row shaft and hub depth together leave a small gap above the key.
    assert all(0 <= key.shaft_depth + key.hub_depth - key.height <= 0.4 + 1e-9 for _, key in KEYS)
    for bore in (5.9, 131):
        with pytest.raises(HdoptError, match=r"no keyway in DIN 6885-1 \(here 6 to 130 mm\)"):
            key_for_bore(bore)
