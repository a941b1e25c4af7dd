"""A measured circular spline: the filter's known answers, and what a radius does to the kinematic error."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cases import BASE_ERRORS, drive

from hdopt.drive.errors import DriveErrors
from hdopt.drive.roundness import MeasuredRoundness, transmission
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.drive.values import DriveError
from hdopt.errors import HdoptError
from hdopt.kinematics.closed_form import deepest_points
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.kinematics.load_sharing import LoadSharing, mesh_tables
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.simulation import ExtendedModel, Operation
from hdopt.study import load_study
from hdopt.workflow.kinematic_error import kinematic_error

TURN = np.arange(720) * np.pi / 360
RADIUS = 32.0


def ring(amplitude=0.005, waves=6, phase=0.3, angles=TURN, **how):
    how.setdefault("cutoff", 150)
    return MeasuredRoundness.of(angles, RADIUS + amplitude * np.cos(waves * angles + phase), **how)


@pytest.mark.parametrize(("waves", "kept"), [(15, 0.5), (5, 2 ** (-1 / 9)), (30, 1 / 16)])
def test_half_of_a_wave_at_the_cut_off_is_kept(waves, kept):
    """ISO 12181-2: exp(-pi (alpha k/k_c)^2), alpha^2 = ln 2/pi."""
    found = ring(0.004, waves, cutoff=15)
    # Cubics between points of half a degree leave 1e-4 of a wave of 30.
    assert found.peak_to_valley == pytest.approx(2 * 0.004 * kept, rel=3e-4)
    assert transmission(np.array([waves]), 15) == pytest.approx(math.exp(-math.log(2) * (waves / 15) ** 2))


def test_uneven_points_in_any_order_are_the_same_ring():
    rng = np.random.default_rng(2)
    angles = rng.permutation(np.sort((TURN + rng.uniform(-0.003, 0.003, 720)) % (2 * np.pi)))
    even, uneven = ring(), ring(angles=angles)
    assert uneven.radial(TURN) == pytest.approx(even.radial(TURN), abs=1e-8)
    assert even.radial(TURN) == pytest.approx(0.005 * np.cos(6 * TURN + 0.3) * transmission(6.0, 150), abs=1e-9)


def test_the_table_is_turned_to_where_its_angles_lie():
    clockwise = ring(zero=0.5)
    assert clockwise.radial(np.array([0.5])) == pytest.approx(ring().radial(np.array([0.0])))
    against = ring(zero=0.5, counterclockwise=True)
    assert against.radial(np.array([0.2])) == pytest.approx(ring().radial(np.array([0.3])))


@pytest.mark.parametrize("method", ["exact", "closed form"])
def test_a_ring_off_centre_acts_as_an_axis_off_to_the_other_side(method):
    """To first order: the exact geometry moves the axis, the table only its teeth. The teeth in contact share the
    table, not the axis, so that the amplitudes differ by that share."""
    e, direction = 0.002, 0.7
    share = LoadSharing.of(drive()).response(1, 162)
    off = MeasuredRoundness.of(TURN, RADIUS + e / share * np.cos(TURN - direction), 150, recentre=False)
    assert off.eccentricity == pytest.approx(e / share)
    other_side = DriveErrors(axis_eccentricity=e, axis_eccentricity_direction=direction + math.pi)
    theta = np.linspace(0, 2 * np.pi, 97)
    found = kinematic_error_arcmin(replace(drive(), cs_roundness=off), DriveErrors(), theta, method)
    expected = kinematic_error_arcmin(drive(), other_side, theta, method)
    # The quadratic part of 2 um is 2e-3 of it; an outward radius taken as driving on would double the difference.
    assert found == pytest.approx(expected, abs=3e-3 * np.abs(expected).max())


def test_lobes_act_as_the_effect_of_a_clamped_ring_less_what_the_teeth_share():
    """`circular_spline_lobing` is sin(n theta + phase) of the radius at a single pair of teeth; radial there is the
    depth, so that the ring that it means is the negative one."""
    n, amplitude = 4, 0.004
    share = LoadSharing.of(drive()).response(n, 162) * transmission(n, 150)
    keys = f"{{lobes={n}, radial_amplitude_um={1000 * amplitude * share}, phase_deg=180}}"
    study = load_study("csf-25-80", [f"effects.circular_spline_lobing={keys}"])
    theta = np.linspace(0, 2 * np.pi, 181)
    model = ExtendedModel(drive(), DriveErrors(), study.effects, Operation())
    zones = model.in_zones(theta, deepest_points(drive(), DriveErrors(), theta), study.operation.directions[0])
    lobed = replace(drive(), cs_roundness=MeasuredRoundness.of(TURN, RADIUS + amplitude * np.sin(n * TURN), 150))
    found = kinematic_error_arcmin(lobed, DriveErrors(), theta, "closed form")
    expected = zones.max(axis=0) * drive().geometry.arcmin_per_mm
    assert found == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


def test_roundness_stands_beside_measured_teeth_and_in_the_compiled_beat():
    teeth = MeasuredTeeth.of(np.random.default_rng(5).normal(0, 0.003, 162))
    both = replace(drive(), cs_teeth=teeth, cs_roundness=ring())
    parts = [mesh_tables(replace(both, **left_out))[0] for left_out in ({"cs_teeth": None}, {"cs_roundness": None})]
    assert mesh_tables(both)[0] == pytest.approx(sum(parts))
    fast = matrix_peak_to_peak_arcmin(both, BASE_ERRORS.to_matrix())
    assert fast[0] == pytest.approx(converged_peak_to_peak_arcmin(both, BASE_ERRORS, "closed form"), abs=1e-5)


def test_another_pressure_angle_makes_another_arc_of_the_same_ring():
    design = replace(drive(), cs_roundness=ring())
    steeper = replace(design, geometry=replace(design.geometry, pressure_angle=math.radians(20)))
    ratio = math.tan(math.radians(20)) / math.tan(math.radians(12))
    assert mesh_tables(steeper)[0] == pytest.approx(ratio * mesh_tables(design)[0])


@pytest.mark.parametrize(
    ("angles", "cutoff", "message"),
    [
        (TURN[::10], 150, "no point for 5 deg; a cut-off of 150 UPR needs one every 1.2 deg"),
        (np.append(TURN, TURN[3]), 50, "gives an angle twice"),
        (np.append(TURN[:-1], np.nan), 50, "not finite"),
    ],
)
def test_points_that_make_no_ring_are_refused(angles, cutoff, message):
    with pytest.raises(DriveError, match=message):
        ring(angles=angles, cutoff=cutoff)


@pytest.fixture
def folder(tmp_path):
    angles = np.append(TURN, 2 * np.pi)
    rows = [f"{math.degrees(a):.4f},{RADIUS + 0.003 * math.cos(3 * a) + 0.02 * math.cos(a):.7f}" for a in angles]
    (tmp_path / "ring.csv").write_text("angle_deg,radius_mm\n" + "\n".join(rows), encoding="utf-8")
    (tmp_path / "own.toml").write_text('drive = "csf-25-80"\n[cs_roundness]\nfile = "ring.csv"\n', encoding="utf-8")
    return tmp_path


def test_a_study_takes_a_measured_ring_and_says_what_it_did(folder):
    result = kinematic_error(load_study(folder / "own.toml"))
    kept = 0.006 * 1000 * 2 ** -((3 / 50) ** 2)
    assert result.measured_roundness["roundness_um"] == pytest.approx(kept, rel=1e-3)
    assert result.measured_roundness["eccentricity_um"] == pytest.approx(20, rel=1e-3)
    assert any("eccentricity of 20.00 um was taken out" in note for note in result.notes)
    assert abs(result.peak_to_peak_arcmin - 1.3693) > 0.005  # the base case without it, converged
    kept_off = load_study(folder / "own.toml", ["cs_roundness.recentre=false"]).drive.cs_roundness
    assert abs(kept_off.waves[0]) == pytest.approx(0.02, rel=1e-3)


def test_a_bad_row_is_named_with_its_line(folder):
    (folder / "ring.csv").write_text("angle_deg,radius_mm\n0,32\n1,thirty-two\n", encoding="utf-8")
    with pytest.raises(HdoptError, match="measured roundness .*ring.csv, line 3: .*thirty-two"):
        kinematic_error(load_study(folder / "own.toml"))


@pytest.mark.parametrize(
    ("head", "factor", "said"),
    [
        ("angle_deg,radius_um", 1000, "line 1: .* names um; give angles in deg and radii in mm"),
        ("angle_rad,radius_mm", 1, "line 1: .* names rad; give angles in deg"),
        ("Winkel in Grad;Radius", 1000, "ring.csv: the ring is .* mm out of round, more than the module of 0.396 mm"),
    ],
)
def test_a_ring_in_other_units_is_refused(folder, head, factor, said):
    """Radii in um were 158 arcmin, without a word."""
    rows = [f"{math.degrees(a):.4f};{factor * (RADIUS + 0.003 * math.cos(3 * a)):.7f}" for a in TURN]
    (folder / "ring.csv").write_text("\n".join([head.replace(",", ";"), *rows]), encoding="utf-8")
    with pytest.raises(HdoptError, match=said):
        load_study(folder / "own.toml").drive  # noqa: B018


def test_how_far_a_measured_cam_lies_off_its_centre_is_said(tmp_path):
    """An ellipse shifted by 12 and 16 um, in polar coordinates about the old centre: 20 um."""
    t = np.arange(1440) * np.pi / 720
    points = 31.046 * np.cos(t) + 0.012 + 1j * (30.318 * np.sin(t) + 0.016)
    rows = [f"{np.degrees(np.angle(z)):.6f},{abs(z):.7f}" for z in points]
    (tmp_path / "cam.csv").write_text("angle_deg,radius_mm\n" + "\n".join(rows), encoding="utf-8")
    keys = "[wave_generator]\nprofile = 'measured'\nsurface = 'bearing'\nfile = 'cam.csv'\n"
    (tmp_path / "own.toml").write_text(f'drive = "csf-25-80"\n{keys}', encoding="utf-8")
    study = load_study(tmp_path / "own.toml")
    assert study.drive.wave_generator.profile.off_centre == pytest.approx(0.02, abs=1e-6)
    assert any("lies 20.00 um off its table's centre, which is kept" in note for note in kinematic_error(study).notes)
