"""Invariants over every registered wave-generator profile, and what impossible profiles are told."""

import numpy as np
import pytest
from cases import PROFILES
from hypothesis import given
from hypothesis import strategies as st

from hdopt.drive.profiles import (
    PROFILES as REGISTERED,
)
from hdopt.drive.profiles import (
    Ellipse,
    MeasuredProfile,
    Resal,
    TwoDisk,
    WaveGeneratorProfile,
    curvature,
    perimeter_error,
    tip_radius_of_curvature,
)
from hdopt.drive.values import DriveError

EVERY = pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
PHI = np.linspace(-1.0, 7.0, 2001)


def test_every_registered_profile_is_tested():
    assert PROFILES.keys() == REGISTERED.keys()


@EVERY
def test_it_meets_the_protocol(profile):
    assert isinstance(profile, WaveGeneratorProfile)


@EVERY
@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_are_those_of_the_radius(profile, order):
    h = 1e-5
    slope = (profile.radius(PHI + h, order - 1) - profile.radius(PHI - h, order - 1)) / (2 * h)
    # Central differences are right to h^2 and rounding/h; at the two-disk wrap angle r''' jumps, which costs order h.
    assert profile.radius(PHI, order) == pytest.approx(slope, abs=3e-5)


@EVERY
def test_it_repeats_every_turn_and_is_symmetric_about_both_axes(profile):
    radius = profile.radius(PHI)
    assert profile.radius(PHI + 2 * np.pi) == pytest.approx(radius, abs=1e-10)
    assert profile.radius(-PHI) == pytest.approx(radius, abs=1e-7)
    assert profile.radius(np.pi - PHI) == pytest.approx(radius, abs=1e-7)


@EVERY
def test_the_axes_are_where_the_radius_is_extreme(profile):
    assert profile.radius(0.0) == pytest.approx(profile.semi_major)
    assert profile.radius(np.pi / 2) == pytest.approx(profile.semi_minor)
    assert profile.semi_minor < profile.radius(PHI).max() <= profile.semi_major + 1e-9


@EVERY
def test_its_tangent_turns_once_round(profile):
    phi = np.linspace(0, 2 * np.pi, 20001)
    turning = curvature(profile, phi) * np.hypot(profile.radius(phi), profile.radius(phi, 1))
    assert np.trapezoid(turning, phi) == pytest.approx(2 * np.pi, rel=1e-7)


@EVERY
def test_perimeter_is_that_of_a_fine_polygon(profile):
    phi = np.linspace(0, 2 * np.pi, 200_001)
    r = profile.radius(phi)
    polygon = np.hypot(np.diff(r * np.cos(phi)), np.diff(r * np.sin(phi))).sum()
    assert profile.perimeter() == pytest.approx(polygon, rel=1e-9)


def test_tip_of_an_ellipse_has_the_textbook_radius_of_curvature():
    assert tip_radius_of_curvature(Ellipse(31.046, 30.318)) == pytest.approx(30.318**2 / 31.046, rel=1e-12)


@given(radius=st.floats(10, 100), part=st.floats(0.002, 0.05))
def test_ellipse_of_equal_perimeter_neither_stretches_nor_crushes_the_ring(radius, part):
    ellipse = Ellipse.of_equal_perimeter(radius, radius * (1 + part))
    assert perimeter_error(ellipse, radius) == pytest.approx(0, abs=1e-9 * radius)


def test_two_disks_without_wrap_are_resals_curve():
    assert TwoDisk(30.65, 0.396, 0.0).radius(PHI) == pytest.approx(Resal(30.65, 0.396).radius(PHI), abs=1e-12)


@given(wrap=st.floats(0, 1.5))
def test_two_disk_deflection_has_zero_mean_for_any_wrap_angle(wrap):
    # The inextensible ring of Jia 2021, Eq. (38): w has no mean. The integral is split at gamma, where w''' jumps.
    nodes, weights = np.polynomial.legendre.leggauss(24)
    profile = TwoDisk(30.0, 0.4, wrap)
    total = sum(
        (b - a) / 2 * weights @ (profile.radius((a + b) / 2 + (b - a) / 2 * nodes) - 30.0)
        for a, b in ((0.0, wrap), (wrap, np.pi / 2))
    )
    assert total == pytest.approx(0, abs=1e-10)


def test_two_disk_radius_slope_and_bend_are_continuous_at_the_wrap_angle():
    profile = TwoDisk(30.65, 0.396, 1.0)
    for order in (0, 1, 2):
        below, above = profile.radius([1.0 - 1e-9, 1.0 + 1e-9], order)
        # 2e-9 rad apart, each may change by the next derivative (at most some 10 mm) times that.
        assert below == pytest.approx(above, abs=2e-7)


def test_measured_profile_recovers_a_curve_through_noise():
    phi = np.arange(720) * np.pi / 360
    true, rng = Ellipse(31.046, 30.318), np.random.default_rng(0)
    noisy = true.radius(phi) + rng.normal(0, 1e-3, len(phi))
    rough, smooth = MeasuredProfile(phi, noisy), MeasuredProfile(phi, noisy, noise=1e-3)
    errors = [np.std(curve.radius(PHI) - true.radius(PHI)) for curve in (rough, smooth)]
    assert errors[1] < 0.3 * errors[0]  # a smooth curve has far fewer degrees of freedom than 720 points


def test_measured_profile_is_read_from_a_file(tmp_path):
    phi = np.arange(0, 360, 2.0)
    rows = "\n".join(f"{a},{r:.9f}" for a, r in zip(phi, Resal(30.65, 0.396).radius(np.radians(phi)), strict=True))
    (tmp_path / "points.csv").write_text(f"# made\nangle_deg,radius_mm\n{rows}\n")
    profile = MeasuredProfile.from_csv(tmp_path / "points.csv")
    # The quintic spline over 2 deg cells; Resal's third derivative jumps at its tip.
    assert profile.radius(PHI) == pytest.approx(Resal(30.65, 0.396).radius(PHI), abs=2e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Ellipse(30.0, 31.0), "minor axis must be the shorter"),
        (lambda: Ellipse(np.nan, 30.0), "semi_major is nan; it must be a finite number above 0"),
        (lambda: Ellipse(31.0, -1.0), "semi_minor is -1.0; it must be a finite number above 0"),
        (lambda: TwoDisk(30.65, 0.396, np.radians(90)), "wrap angle is 90 deg; it must lie between 0 and 90 deg"),
        (lambda: TwoDisk(30.65, 0.396, -0.1), "it must lie between 0 and 90 deg"),
        (lambda: Resal(30.65, 20.0), "below a fifth of the radius"),
        (lambda: MeasuredProfile(np.arange(5.0), np.full(5, 30.0)), "has 5 points; at least 16 are needed"),
        (
            lambda: MeasuredProfile(np.linspace(0, 3, 100), np.full(100, 30.0)),
            "has no point for 188 deg after 171.9 deg",
        ),
        (
            lambda: MeasuredProfile(np.arange(0, 6.28, 0.1), np.full(63, np.inf)),
            "holds an angle or a radius that is not finite",
        ),
        (
            lambda: MeasuredProfile(PHI[:720], Ellipse(31.0, 30.0).radius(PHI[:720])),
            "has no point for",
        ),
        (
            lambda: MeasuredProfile((a := np.arange(360) * np.pi / 180), Ellipse(31.0, 30.0).radius(a - 0.5)),
            "major axis at 28.6 deg; measure angles from the major axis",
        ),
    ],
)
def test_impossible_profiles_are_refused(make, message):
    with pytest.raises(DriveError, match=message):
        make()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("angle,radius\n1,2\nx,3\n", "line 3: 'x,3'; each line must hold two numbers"),
        ("", "holds no points"),
        ("1,2,3\n4,5,6\n", "line 1: '1,2,3'; each line must hold two numbers"),
    ],
)
def test_broken_profile_files_are_refused_with_the_line(text, message, tmp_path):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(DriveError, match=message):
        MeasuredProfile.from_csv(tmp_path / "bad.csv")


def test_missing_profile_file_is_refused(tmp_path):
    with pytest.raises(DriveError, match="cannot be read"):
        MeasuredProfile.from_csv(tmp_path / "none.csv")


def test_parallel_of_a_circle_is_a_circle_and_of_an_ellipse_is_at_its_distance():
    from hdopt.drive.profiles import parallel_profile

    ellipse = Ellipse(31.046, 30.318)
    outside = parallel_profile(ellipse, 3.0)
    assert outside.radius([0.0, np.pi / 2]) == pytest.approx([34.046, 33.318], abs=1e-9)
    # Steiner: the parallel of a convex curve is longer by 2 pi times the distance.
    assert outside.perimeter() == pytest.approx(ellipse.perimeter() + 6 * np.pi, abs=1e-7)
