"""Measured teeth: known answers of the mean over the teeth in contact, and what a study says of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cases import BASE_ERRORS, drive

from hdopt.drive.errors import DriveErrors
from hdopt.drive.teeth import MeasuredTeeth, read_teeth
from hdopt.drive.values import DriveError
from hdopt.errors import HdoptError
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin, extremes_arcmin
from hdopt.kinematics.load_sharing import LoadSharing, mesh_range, mesh_tables
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.mechanics.contact import contact_angle, meshing_teeth
from hdopt.study import load_study
from hdopt.workflow.kinematic_error import kinematic_error
from hdopt.workflow.stack import study_problem

Z_CS, Z_FS = 162, 160


def sine(teeth: int, amplitude: float, phase: float, waves: int = 1) -> MeasuredTeeth:
    angles = 2 * np.pi * np.arange(teeth) / teeth
    return MeasuredTeeth.of(amplitude * np.sin(waves * angles + phase), recentre=False)


def shared(waves: int = 1, teeth: int = Z_CS) -> float:
    return LoadSharing.of(drive()).response(waves, teeth)


@pytest.mark.parametrize("waves", [1, 2, 3, 5])
def test_even_weights_give_the_dirichlet_factor(waves):
    """sin(k c/2)/(k c/2) for many teeth; 40,000 of them leave its sum within 1e-3 of the integral."""
    c = contact_angle(drive().geometry, drive().wave_generator.profile)
    found = LoadSharing.of(drive(), taper=0.0).response(waves, 40_000)
    assert found == pytest.approx(math.sin(waves * c / 2) / (waves * c / 2), abs=1e-3)


def test_independent_teeth_give_one_over_the_root_of_those_in_mesh():
    rng, design = np.random.default_rng(0), drive()
    z_mp = meshing_teeth(design.geometry, contact_angle(design.geometry, design.wave_generator.profile))
    sharing = LoadSharing.of(design)
    tables = [sharing.table(MeasuredTeeth(tuple(rng.normal(0, 0.005, Z_CS)))) for _ in range(400)]
    # 400 drives with some six independent windows each: the standard deviation is known to 1.5 %.
    assert np.std(tables) == pytest.approx(0.005 / math.sqrt(z_mp), rel=0.05)


def test_a_sine_as_a_table_is_a_sine_of_shared_amplitude():
    amplitude = 0.002
    measured = replace(drive(), cs_teeth=sine(Z_CS, amplitude, 0.3), fs_teeth=sine(Z_FS, amplitude, 1.1))
    without = BASE_ERRORS.with_(cs_tooth_amplitude=0.0, fs_tooth_amplitude=0.0)
    as_sines = BASE_ERRORS.with_(
        cs_tooth_amplitude=amplitude * shared(1, Z_CS),
        cs_tooth_phase=0.3,
        fs_tooth_amplitude=amplitude * shared(1, Z_FS),
        fs_tooth_phase=1.1,
    )
    theta = np.linspace(0, 500, 999)
    found, expected = (
        kinematic_error_arcmin(d, e, theta, "closed form") for d, e in ((measured, without), (drive(), as_sines))
    )
    # Whole teeth enter and leave a tapered window: what is left of that is far below 1e-3 of the amplitude, 0.2 arcmin.
    assert found == pytest.approx(expected, abs=2e-4)
    for method in ("exact", "closed form"):
        pair = extremes_arcmin(measured, without, method), extremes_arcmin(drive(), as_sines, method)
        assert pair[0] == pytest.approx(pair[1], abs=2e-4)


def test_an_eccentricity_is_a_pitch_sine_of_amplitude_e_tan_alpha():
    """To first order: the quadratic part of an eccentricity of 1 um is 1e-3 of it."""
    e, alpha = 0.001, drive().geometry.pressure_angle
    table = sine(Z_CS, e * math.tan(alpha) / shared(), math.pi / 2)  # sin(theta + 90 deg): along +y
    found = converged_peak_to_peak_arcmin(replace(drive(), cs_teeth=table), DriveErrors())
    assert found == pytest.approx(converged_peak_to_peak_arcmin(drive(), DriveErrors(axis_eccentricity=e)), rel=2e-3)


@pytest.mark.parametrize("first", [0.0, 0.7])
def test_a_single_tooths_step_shows_where_that_tooth_meshes(first):
    """Tooth 41 of 162 lies 88.9 deg behind the first; zone 1 passes it there, zone 2 half a turn later, in every turn.

    Would catch a table that forgets where its first tooth stands.
    """
    values = np.zeros(Z_CS)
    values[40] = 0.01
    design = replace(drive(), cs_teeth=MeasuredTeeth(tuple(values), first))
    weights = LoadSharing.of(design).weights(2 * np.pi * (np.arange(Z_CS) - 40) / Z_CS)
    theta = np.arange(0, 2 * np.pi, 1e-3)
    error = kinematic_error_arcmin(design, DriveErrors(), theta, "closed form")
    at = first + 2 * np.pi * 40 / Z_CS
    expected = 0.01 / weights.sum() * design.geometry.arcmin_per_mm
    for place in (at, at + np.pi):
        # Even in the middle of the window; far from it nothing.
        assert np.interp(np.mod(place, 2 * np.pi), theta, error) == pytest.approx(expected, rel=1e-2)
        assert np.interp(np.mod(place + np.pi / 2, 2 * np.pi), theta, error) == pytest.approx(0, abs=1e-9)


def test_search_over_all_phases_finds_what_a_walk_of_the_beat_finds():
    rng = np.random.default_rng(3)
    design = replace(
        drive(),
        cs_teeth=MeasuredTeeth.of(rng.normal(0, 0.004, Z_CS), "single"),
        fs_teeth=MeasuredTeeth.of(rng.normal(0, 0.004, Z_FS), "single"),
    )
    errors = BASE_ERRORS.with_(cs_tooth_amplitude=0.0, fs_tooth_amplitude=0.0)
    theta = np.arange(80 * 1440) * 2 * np.pi / 1440
    walked = np.ptp(kinematic_error_arcmin(design, errors, theta, "closed form"))
    found = converged_peak_to_peak_arcmin(design, errors, "closed form")
    assert walked - 1e-6 <= found < walked + 5e-3


def test_recentring_takes_out_what_a_part_measured_off_centre_shows():
    true = np.random.default_rng(1).normal(0, 0.002, Z_CS)
    angles = 2 * np.pi * np.arange(Z_CS) / Z_CS
    off_centre, centred = MeasuredTeeth.of(true + 0.01 * np.sin(angles + 0.4)), MeasuredTeeth.of(true)
    assert off_centre.deviations == pytest.approx(centred.deviations, abs=1e-12)
    assert off_centre.eccentricity == pytest.approx(0.01, rel=0.05)
    assert MeasuredTeeth.of(true, recentre=False).deviations == pytest.approx(true - true.mean(), abs=1e-15)


def test_single_and_cumulative_deviations_are_the_same_teeth():
    cumulative = np.random.default_rng(2).normal(0, 0.002, Z_FS)
    single = cumulative - np.roll(cumulative, 1)
    one, other = (
        MeasuredTeeth.of(v, kind, recentre=False) for v, kind in ((cumulative, "cumulative"), (single, "single"))
    )
    assert one.deviations == pytest.approx(other.deviations, abs=1e-12)
    assert one.largest_single == pytest.approx(np.abs(single).max())
    off = MeasuredTeeth.of(single + 0.0005, "single", recentre=False)  # a gauge's own zero: a circle closes
    assert off.deviations == pytest.approx(one.deviations, abs=1e-12)


def test_the_last_tooth_is_the_firsts_neighbour():
    """A ramp of 0.001 mm a tooth falls back where it closes."""
    assert MeasuredTeeth.of(0.001 * np.arange(20.0), recentre=False).largest_single == pytest.approx(0.019)


@pytest.fixture
def study_with_teeth(tmp_path):
    rng = np.random.default_rng(5)
    rows = "\n".join(f"{i + 1},left,{value:.3f}" for i, value in enumerate(rng.normal(0, 3, Z_CS)))
    (tmp_path / "cs.csv").write_text(f"tooth,flank,fp_um\n{rows}\n")
    (tmp_path / "mine.toml").write_text('drive = "csf-25-80"\n[cs_teeth]\nfile = "cs.csv"\ndeviation = "single"\n')
    return tmp_path / "mine.toml"


def test_a_file_that_set_names_lies_beside_the_study_or_here(study_with_teeth, monkeypatch):
    """A shell completes paths from where it is; what lies beside the study goes before. `csf-25-80` lies where hdopt is
    installed: a table found there alone would never be the user's."""
    monkeypatch.chdir(study_with_teeth.parent)
    given = ["cs_teeth.file=cs.csv", "cs_teeth.deviation=single"]
    here = load_study("csf-25-80", given)
    assert here.drive.cs_teeth.deviations == load_study(study_with_teeth).drive.cs_teeth.deviations
    monkeypatch.chdir("/")
    assert load_study("csf-25-80", here.recipe["overrides"]).drive == here.drive
    assert load_study(study_with_teeth, given).drive == load_study(study_with_teeth).drive
    with pytest.raises(HdoptError, match="cannot be read"):
        load_study("csf-25-80", given).drive  # noqa: B018


def test_deviations_beyond_the_pitch_are_no_micrometres(study_with_teeth):
    """The same table in nanometres: 1,635 arcmin were answered without a word."""
    table = study_with_teeth.parent / "cs.csv"
    head, *rows = table.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    table.write_text("\n".join([head, *(f"{tooth},{side},{1000 * float(value)}" for tooth, side, value in cells)]))
    with pytest.raises(HdoptError, match="cs_teeth.*off its neighbour's pitch of .* um; deviations must be in um"):
        load_study(study_with_teeth).drive  # noqa: B018


@pytest.mark.parametrize("seed", range(20))
def test_a_table_told_wrongly_is_doubted_and_one_told_rightly_is_not(seed):
    """Independent single deviations and their sums, from tooth 1 on or about their mean, as machines write them."""
    rng = np.random.default_rng(seed)
    single = rng.normal(0.0, 0.001, Z_CS)
    single = single - single.mean()
    sums = np.cumsum(single)
    from_tooth_1, about_mean = sums - sums[0], sums - sums.mean()
    for values, kind in ((single, "single"), (from_tooth_1, "cumulative"), (about_mean, "cumulative")):
        assert MeasuredTeeth.of(values.round(4), kind).doubts == ()
        assert ["less than machines" in one for one in MeasuredTeeth.of(values / 1000, kind).doubts] == [True]
    (doubt,) = MeasuredTeeth.of(single, "cumulative").doubts
    assert 'If they are single, say so: deviation = "single"' in doubt
    (doubt,) = MeasuredTeeth.of(from_tooth_1, "single").doubts
    assert 'If they are cumulative, say so: deviation = "cumulative"' in doubt
    (doubt,) = MeasuredTeeth.of(about_mean, "single").doubts
    assert doubt.startswith("neighbouring single deviations are alike")
    assert f"add up to as much as {1000 * np.ptp(np.cumsum(about_mean)):.3g} um" in doubt
    assert MeasuredTeeth.of(np.zeros(Z_CS)).doubts == ()


def test_a_doubt_is_said_with_the_result(study_with_teeth):
    """The same sums told as what they are, and as single deviations."""
    sums = np.cumsum(np.random.default_rng(2).normal(0.0, 1.0, Z_CS))
    rows = (f"{tooth},left,{value:.2f}\n" for tooth, value in enumerate(sums - sums[0], 1))
    (study_with_teeth.parent / "cs.csv").write_text("".join(rows))
    for kind, doubted in (("cumulative", False), ("single", True)):
        notes = kinematic_error(load_study(study_with_teeth, [f"cs_teeth.deviation={kind}"])).notes
        assert any("cs_teeth: the single deviations add up to" in note for note in notes) is doubted


def test_a_study_takes_measured_teeth(study_with_teeth):
    study = load_study(study_with_teeth)
    assert study.errors.cs_tooth_amplitude == 0  # the table stands instead of the sine
    found = kinematic_error(study).to_dict()
    assert found["measured_teeth"]["cs_teeth"]["teeth"] == Z_CS
    assert any("cs_teeth: a first harmonic of" in note for note in found["notes"])
    table = mesh_tables(study.drive)[0]
    span = np.ptp(table) * study.drive.geometry.arcmin_per_mm
    assert found["peak_to_peak_arcmin"] != pytest.approx(1.3694, abs=1e-4)
    assert found["peak_to_peak_arcmin"] < 1.3694 + span
    # Misalignment by its own mean, not by k_e: much more is left than k_e times all.
    assert found["nonuniform_arcmin"] > 2 * found["homogenization_coefficient"] * found["peak_to_peak_arcmin"]
    problem = study_problem(study)
    assert "cs_tooth_amplitude_mm" not in problem.space.names
    inputs = problem.space.sample(np.full((1, problem.space.dimension), 0.5))
    one = DriveErrors.from_matrix(problem.response.matrix(inputs)[0])
    expected = converged_peak_to_peak_arcmin(study.drive, one, "closed form")
    # What the walk in lanes is held to against the search over all phases.
    assert problem.response(inputs) == pytest.approx([expected], abs=1e-5)


def test_what_is_proven_counts_the_tables_too(study_with_teeth):
    """Without them some of these drives lie above what no drive exceeds."""
    problem = study_problem(load_study(study_with_teeth))
    points = np.random.default_rng(4).random((64, problem.space.dimension))
    inputs = problem.space.sample(points)
    worst = problem.response(inputs)
    bound = problem.response.upper_bound(inputs.min(axis=0), inputs.max(axis=0))
    assert worst.max() <= bound
    assert worst.max() > bound - mesh_range(problem.response.drive) * problem.response.drive.geometry.arcmin_per_mm


def test_a_stack_evens_out_term_by_term_as_ke_does(study_with_teeth):
    """One drive in the middle of all tolerances: k_e on misalignment or on the table gives a third of this."""
    study = load_study(study_with_teeth, ["requirement.homogenization=contact", "fs_tooth_amplitude_mm=0.002"])
    problem = study_problem(study)
    inputs = problem.space.sample(np.full((1, problem.space.dimension), 0.5))
    one = DriveErrors.from_matrix(problem.response.matrix(inputs)[0])
    expected = kinematic_error(study.drive, one, method="closed form").nonuniform_arcmin
    assert problem.response(inputs) == pytest.approx([expected], abs=1e-5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,left,0\n2,left,0\n", r"6 of 8 teeth are missing \(3, 4, 5, 6, 7 \.\.\.\); give every tooth"),
        ("1,left,0\n1,left,1\n", "gives tooth 1 twice"),
        ("9,left,0\n", "tooth 9; this spline has teeth 1 to 8"),
        ("0,left,0\n", "tooth 0; this spline has teeth 1 to 8; number them from 1"),
        ("1,left,0\n2,left,nan\n", "tooth 2 has the deviation nan; give a number"),
        ("1,left,0\n1,right,0\n", "has the flanks left, right; say which one carries"),
        ("tooth,flank,fp_um\n1,left\n", "line 2: '1,left'; each line must hold tooth, flank, fp_um"),
        ("tooth,flank,fp_um\n1,left,0,5\n", "line 2: '1,left,0,5'; .*between decimal commas, semicolons must part"),
        ('<?xml version="1.0"?><gde/>', "holds no row of tooth, flank, fp_um; give a CSV text file"),
        ("angle_deg,radius_mm\n0,15\n", "line 2: '0,15'; each line must hold tooth, flank, fp_um"),
        ("Zahn;Flanke;fp [mm]\n1;links;0,004\n", "line 1: .*deviations must be in um, not mm: give them so"),
        ("tooth,flank,fp_mil\n1,left,4\n", "line 1: .*deviations must be in um, not mil: give them so"),
        ("tooth,flank,fp (nm)\n1,left,4\n", "line 1: .*deviations must be in um, not nm: give them so"),
        ("tooth,flank,fp in inch\n1,left,4\n", "line 1: .*deviations must be in um, not inch: give them so"),
    ],
)
def test_a_table_that_is_none_is_refused(tmp_path, text, message):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(DriveError, match=message):
        read_teeth(tmp_path / "t.csv", 8)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252", "utf-16"])
@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_table_of_a_german_spreadsheet(tmp_path, encoding, mark):
    """Semicolons or tabs, decimal commas, Windows' encodings, and a last line of empty cells."""
    rows = [f"{i}{mark}links{mark}{value}" for i, value in enumerate(["0", "1,5", "-0,25", *5 * ["3,0E-1"]], 1)]
    text = "\r\n".join([f"Zahn{mark}Flanke{mark}Teilungsabweichung fp in \u00b5m", *rows, 2 * mark, ""])
    (tmp_path / "t.csv").write_bytes(text.encode(encoding))
    assert read_teeth(tmp_path / "t.csv", 8).tolist() == pytest.approx(
        [0.0, 0.0015, -0.00025, *5 * [0.0003]], abs=1e-15
    )


@pytest.mark.parametrize(
    "header", ["tooth,flank,fp_um", "Zahn,Flanke,fp in um", "tooth,flank,fp (\u00b5m)", "tooth,flank,fp [\u03bcm]"]
)
def test_a_header_in_micrometres_is_read(tmp_path, header):
    """Fault caught: the m of a micrometre, or the word in before it, taken for a unit of its own."""
    (tmp_path / "t.csv").write_text(header + "\n" + "".join(f"{tooth},left,{tooth}\n" for tooth in range(1, 9)))
    assert read_teeth(tmp_path / "t.csv", 8) == pytest.approx(np.arange(1, 9) / 1000)


def test_a_first_harmonic_says_how_far_the_part_was_held_off_its_centre(study_with_teeth):
    """A probe at a constant radius, a flank at the pressure angle alpha: e sin(t) along the pitch, and e cos(t) across,
    which moves the point of the flank that is touched by e cos(t) tan(alpha). Fault caught: e read as what an axis off
    by it does in the drive, 5 times as much."""
    study = load_study(study_with_teeth)
    alpha, held = study.drive.geometry.pressure_angle, 10.0
    angle = 2 * np.pi * np.arange(Z_CS) / Z_CS
    seen = held * (np.sin(angle) + np.cos(angle) * np.tan(alpha))
    rows = (f"{tooth},left,{value:.6f}\n" for tooth, value in enumerate(seen, 1))
    (study_with_teeth.parent / "cs.csv").write_text("".join(rows))
    notes = kinematic_error(load_study(study_with_teeth, ["cs_teeth.deviation=cumulative"])).notes
    assert any("cs_teeth" in note and "held 10.00 um off-centre" in note for note in notes)
