"""Properties of the kinematic error over every profile and structure: zero, period, linearity, frames, geometries."""

import numpy as np
import pytest
from cases import BASE_ERRORS, PROFILES, drive, random_errors
from hypothesis import given, settings
from hypothesis import strategies as st

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Structure
from hdopt.kinematics import closed_form, exact, kinematic_error_arcmin
from hdopt.kinematics.waveform import full_turn, relative_turn

SMOOTH = {name: profile for name, profile in PROFILES.items() if profile.tip_is_smooth}
EVERY_PROFILE = pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
EVERY_STRUCTURE = pytest.mark.parametrize("structure", Structure, ids=lambda structure: structure.value)
THETA = np.radians(np.arange(0, 360, 3.0))


def one(errors: DriveErrors, i: int) -> DriveErrors:
    return DriveErrors.from_matrix(errors.to_matrix()[i])


@EVERY_PROFILE
@EVERY_STRUCTURE
def test_a_perfect_drive_has_no_kinematic_error(profile, structure):
    # The measured ellipse is a spline, whose two tips may differ by its rounding.
    assert np.abs(kinematic_error_arcmin(drive(profile, structure), DriveErrors(), THETA)).max() < 1e-8


@EVERY_PROFILE
@EVERY_STRUCTURE
def test_it_repeats_after_a_full_relative_turn(profile, structure):
    design = drive(profile, structure)
    turn = 2 * np.pi * design.geometry.beat_phases
    now, later = (kinematic_error_arcmin(design, BASE_ERRORS, THETA + shift) for shift in (0.0, turn))
    assert later == pytest.approx(now, abs=1e-9)
    part = kinematic_error_arcmin(design, BASE_ERRORS, THETA + turn / 2)
    assert np.abs(part - now).max() > 0.01


@EVERY_STRUCTURE
def test_one_turns_deepest_points_serve_all_turns(structure):
    design = drive(structure=structure)
    theta, waveform = relative_turn(design, BASE_ERRORS, 90)
    assert theta == pytest.approx(full_turn(design, 90))
    assert waveform == pytest.approx(kinematic_error_arcmin(design, BASE_ERRORS, theta), abs=1e-9)


@EVERY_STRUCTURE
def test_small_errors_act_in_proportion(structure):
    design, errors = drive(structure=structure), BASE_ERRORS.to_matrix()[0]
    sizes = np.array([name not in (1, 5, 9, 11) for name in range(12)])
    small = [DriveErrors.from_matrix(np.where(sizes, errors * scale, errors)) for scale in (1e-4, 2e-4)]
    first, second = (kinematic_error_arcmin(design, e, THETA, "exact") for e in small)
    assert second == pytest.approx(2 * first, abs=1e-3 * np.abs(second).max())


@pytest.mark.parametrize("profile", SMOOTH.values(), ids=SMOOTH.keys())
@EVERY_STRUCTURE
def test_turning_the_ground_frame_only_shifts_the_waveform(profile, structure):
    design, delta, e = drive(profile, structure), 0.7, BASE_ERRORS
    tilt_x, tilt_y = np.tan(e.axis_tilt_x), np.tan(e.axis_tilt_y)
    advance = design.geometry.circular_spline_teeth / design.geometry.flexspline_teeth
    turned = e.with_(
        axis_eccentricity_direction=e.axis_eccentricity_direction + delta,
        axis_tilt_x=np.arctan(tilt_x * np.cos(delta) + tilt_y * np.sin(delta)),
        axis_tilt_y=np.arctan(tilt_y * np.cos(delta) - tilt_x * np.sin(delta)),
        cs_tooth_phase=e.cs_tooth_phase - delta,
        fs_tooth_phase=e.fs_tooth_phase - advance * delta,
    )
    before = kinematic_error_arcmin(design, e, THETA)
    after = kinematic_error_arcmin(design, turned, THETA + delta)
    # A tilt about two axes in turn twists the frame by half their product, 1e-5 rad here, which a turned one does not:
    # it shifts the tooth phases by as much, and the angles where rims change.
    assert np.median(np.abs(after - before)) < 1e-5
    assert np.quantile(np.abs(after - before), 0.95) < 1e-4


def test_structures_take_away_what_they_align():
    only_offsets = DriveErrors(axis_eccentricity=0.01, wg_eccentricity=0.005, wg_eccentricity_direction=0.4)
    spans = {s: np.ptp(kinematic_error_arcmin(drive(structure=s), only_offsets, THETA)) for s in Structure}
    assert spans[Structure.AUTOMATIC] < 1e-10  # rounding of radii
    # Without eccentricity along the major axis only its second-order part across it is left.
    assert spans[Structure.ONE_WAY_MAJOR] < 0.01 * spans[Structure.INTEGRAL]
    assert spans[Structure.ONE_WAY_MINOR] == pytest.approx(spans[Structure.INTEGRAL], rel=0.02)


@settings(max_examples=60, deadline=None)
@given(
    index=st.integers(0, 9999),
    profile=st.sampled_from(sorted(SMOOTH)),
    structure=st.sampled_from(list(Structure)),
    scale=st.sampled_from([1.0, 3.0]),
)
def test_closed_form_agrees_with_the_exact_geometry(index, profile, structure, scale):
    design, errors = drive(SMOOTH[profile], structure), one(random_errors(1, index, scale), 0)
    found, reference = (module.deepest_points(design, errors, THETA) for module in (closed_form, exact))
    as_error = np.tan(design.geometry.pressure_angle) * design.geometry.arcmin_per_mm
    # The neglected terms are of third order in the errors: 27 times larger at three times the size.
    assert np.abs(found.depth - reference.depth).max() * as_error < 2e-4 * scale**3
    same_rim = (found.rim == reference.rim).all(axis=0)
    assert same_rim.mean() > 0.95
    assert found.offset_cs[:, same_rim] == pytest.approx(reference.offset_cs[:, same_rim], abs=1.5e-3 * scale**2)
    assert found.offset_fs[:, same_rim] == pytest.approx(reference.offset_fs[:, same_rim], abs=1.5e-3 * scale**2)


def of_parity(values, zone, rim):
    """The part of `values` (zone, rim, ...) that keeps its sign over zones and rims, or changes it where -1."""
    over_rims = values[:, 0] + rim * values[:, 1]
    return (over_rims[0] + zone * over_rims[1]) / 4


@pytest.mark.parametrize(
    ("profile", "only_tilts", "what", "parity", "close"),
    [
        # E_l, alone in what all four points share; left out are terms of third order: 4e-5 of it (ellipse).
        ("ellipse", False, "offset_cs", (1, 1), 2e-4),
        ("two_disk", False, "offset_cs", (1, 1), 4e-4),
        # T_l, with the other sign on the other rim and in the other zone.
        ("ellipse", False, "offset_cs", (-1, -1), 1e-3),
        # What the wave generator itself sees differs by the shift over L_W.
        ("ellipse", False, "difference", (1, 1), 1e-2),
        ("ellipse", False, "difference", (-1, -1), 1e-2),
        # Tilt about both axes: of second order, where the closed form has two thirds of the offset.
        ("ellipse", True, "offset_cs", (-1, 1), 0.5),
        ("two_disk", True, "offset_cs", (-1, 1), 0.5),
    ],
)
def test_every_part_of_an_offset_is_that_of_the_exact_geometry(profile, only_tilts, what, parity, close):
    """Would catch a part lost or turned that is small beside the others: the tip's own offset, a tilt's sign."""
    errors = one(random_errors(1, 5), 0)
    if only_tilts:
        errors = errors.with_(axis_eccentricity=0.0, wg_eccentricity=0.0)
    found, exactly = (
        of_parity(b.offset_cs - b.offset_fs if what == "difference" else b.offset_cs, *parity)
        for b in (module.branches(drive(PROFILES[profile]), errors, THETA) for module in (closed_form, exact))
    )
    assert np.abs(found - exactly).max() < close * np.abs(exactly).max()


def test_a_measured_ellipse_gives_the_ellipses_waveform():
    measured, analytic = (
        kinematic_error_arcmin(drive(profile), BASE_ERRORS, THETA, "exact")
        for profile in (PROFILES["measured"], drive().wave_generator.profile)
    )
    assert measured == pytest.approx(analytic, abs=1e-5)


def test_unknown_geometry_is_refused():
    with pytest.raises(ValueError, match="geometry is 'approximate'; it must be one of closed form, exact"):
        kinematic_error_arcmin(drive(), DriveErrors(), THETA, "approximate")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: DriveErrors(axis_eccentricity=-0.01), "axis_eccentricity holds a negative value"),
        (lambda: DriveErrors(axis_tilt_x=np.nan), "axis_tilt_x holds a value that is not finite"),
        (lambda: DriveErrors.from_matrix(np.zeros((3, 11))), r"shape \(3, 11\); its last axis must hold 12 errors"),
    ],
)
def test_impossible_errors_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
