"""The proven bound of the peak-to-peak, term by term, on boxes where one term stands alone; the shift of a deepest
point from the ellipse's own radius, solved here."""

from math import asin, cos, pi, radians, sin, sqrt, tan

import pytest
from cases import drive
from scipy.optimize import brentq

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Structure
from hdopt.tolerance.drive_bound import peak_to_peak_bound_arcmin

A, B, HALF_WIDTH = 31.046, 30.318, 4.5
ARCMIN_PER_MM = 2 * pi / (pi * 0.396 * 160) * 180 * 60 / pi
FLANK = tan(radians(12))


def bound(structure=Structure.INTEGRAL, **errors):
    return peak_to_peak_bound_arcmin(drive(structure=structure), DriveErrors(**errors)) / ARCMIN_PER_MM


def test_eccentricities_add():
    assert bound(axis_eccentricity=0.05, wg_eccentricity=0.03) == pytest.approx(FLANK * 0.08)
    assert bound(Structure.AUTOMATIC, axis_eccentricity=0.05, wg_eccentricity=0.03) == 0


@pytest.mark.parametrize("tilt", ["axis_tilt_y", "axis_tilt_x", "wg_tilt_major", "wg_tilt_minor"])
def test_every_tilt_lifts_a_rim(tilt):
    assert bound(**{tilt: 0.002}) == pytest.approx(FLANK * HALF_WIDTH * sin(0.002))


def test_tilts_of_axis_and_wave_generator_add():
    assert bound(axis_tilt_y=0.002, wg_tilt_minor=0.001) == pytest.approx(FLANK * HALF_WIDTH * sin(0.003))


def radius(phi):
    return A * B / sqrt((B * cos(phi)) ** 2 + (A * sin(phi)) ** 2)


def slope(phi):
    return radius(phi) ** 3 * (A * A - B * B) * sin(phi) * cos(phi) / (A * B) ** 2


def shift_of(e):
    """Where the radius falls as fast as the centre's offset e lets it: |r'| = e sqrt(1 + (r'/r)^2)."""
    return brentq(lambda phi: slope(phi) - e * sqrt(1 + (slope(phi) / radius(phi)) ** 2), 0.0, pi / 6)


def test_where_only_the_part_across_passes_it_counts_by_its_shift_and_its_square():
    """|A + c| <= |A| + c.A/|A| + |c|^2/(2 |A|): c lies across, but for the deepest point's shift; |A| is B at least."""
    e = 0.05
    found = bound(Structure.ONE_WAY_MAJOR, axis_eccentricity=e)
    # The program looks at the slope every 5e-5 rad.
    assert found == pytest.approx(FLANK * (e * sin(shift_of(e)) + e**2 / (2 * B)), abs=FLANK * e * 1e-4)


@pytest.mark.parametrize("spline", ["cs", "fs"])
def test_teeth_of_opposite_zones_cancel_but_for_their_shift(spline):
    """A deepest point is shifted as far as the centre's offset e lets it. The circular spline's teeth are met where the
    offset has turned it besides."""
    e, amplitude = 0.05, 0.004
    shift = shift_of(e)
    if spline == "cs":
        shift += asin(e / (B - e))
    found = bound(axis_eccentricity=e, **{f"{spline}_tooth_amplitude": amplitude})
    # The program looks at the slope every 5e-5 rad: a hundredth of a per cent of the amplitude.
    assert found == pytest.approx(FLANK * e + amplitude * (1 + sin(shift)), abs=1e-3 * amplitude)


def test_where_tilts_are_too_large_for_the_proof_there_is_no_bound():
    assert bound(axis_tilt_y=0.08) > 0
    assert peak_to_peak_bound_arcmin(drive(), DriveErrors(axis_tilt_y=0.3)) is None
