"""Teeth drawn from tolerances of pitch: the class's numbers, the field's known answers, and what a study says of it."""

import cmath
import math
import struct
from dataclasses import replace

import numpy as np
import pytest
from cases import drive, random_errors
from scipy import stats

from hdopt.drive.pitch_tolerances import PitchTolerances, iso_1328_tolerances
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.drive.values import DriveError
from hdopt.errors import HdoptError
from hdopt.kinematics.load_sharing import LoadSharing
from hdopt.kinematics.peak_to_peak import beat_extremes_arcmin, matrix_peak_to_peak_arcmin
from hdopt.mechanics.contact import contact_angle, meshing_teeth
from hdopt.study import load_study
from hdopt.tolerance.distributions import Uniform
from hdopt.tolerance.drawn_teeth import DrawnTeeth, GradedTeeth, drawn_peak_to_peak_arcmin, tables_of_teeth
from hdopt.tolerance.drive_inputs import drive_problem
from hdopt.tolerance.linearise import linearise
from hdopt.tolerance.screening import run_screening
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.tooth_field import (
    CALIBRATION_SEED,
    FAMILIES,
    ToothField,
    _normal_pairs,
    largest_single,
    tooth_field,
)
from hdopt.tolerance.worst_case import Unbounded, check_bounded
from hdopt.workflow.explore import _notes
from hdopt.workflow.stack import study_problem

Z = 162
TOLERANCES = PitchTolerances(0.005, 0.017)


def numbers(n, seed=0):
    return np.random.default_rng(seed).random(n)


@pytest.mark.parametrize(
    ("tolerance_class", "module", "teeth", "single", "cumulative"),
    [
        (6, 3.0, 40, 9.0, 29.0),  # d = 120: 8.938 and 28.80 um, by hand from formulae (5) and (6)
        (5, 1.0, 100, 5.5, 18.0),  # 5.5 and 18.40
        (3, 0.5, 100, 2.6, 8.0),  # 2.625 and 8.17: below 5 um to tenths, below 10 to halves
    ],
)
def test_iso_class_gives_the_formulas_values_rounded(tolerance_class, module, teeth, single, cumulative):
    found = iso_1328_tolerances(tolerance_class, module, teeth)
    assert (1000 * found.single, 1000 * found.cumulative) == pytest.approx((single, cumulative))


def test_a_class_outside_its_scope_says_so():
    assert iso_1328_tolerances(5, 0.396, Z).beyond == (
        "involute flanks (these are of a strain wave gear)",
        "module 0.5 to 70 (here 0.396)",
    )
    assert len(iso_1328_tolerances(5, 0.5, Z).beyond) == 1
    # The upper ends: 71 mm of module, a diameter of 25560 mm and, of another gear, 1001 teeth.
    assert iso_1328_tolerances(5, 71.0, 360).beyond[1:] == (
        "module 0.5 to 70 (here 71)",
        "diameter 5 to 15000 (here 2.556e+04)",
    )
    assert iso_1328_tolerances(5, 1.0, 1001).beyond[1:] == ("teeth 5 to 1000 (here 1001)",)
    assert len(iso_1328_tolerances(5, 1.0, 1000).beyond) == 1
    with pytest.raises(DriveError, match="the classes 1 to 11, not 12"):
        iso_1328_tolerances(12, 1.0, Z)


@pytest.mark.parametrize("family", ["power_law", "one_wave"])
@pytest.mark.parametrize("share", [0.9, 0.9973])
def test_both_tolerances_are_kept_by_the_share_asked_for(family, share):
    """Splines that the calibration never saw. A field fitted to one tolerance alone misses the other by far."""
    deviations = tooth_field(Z, TOLERANCES, share, family).drawn(numbers(20_000))
    kept = [
        (largest_single(deviations) <= TOLERANCES.single).mean(),
        (np.ptp(deviations, 1) <= TOLERANCES.cumulative).mean(),
    ]
    # Sampling error of 8,192 and of 20,000 splines together, three times.
    assert kept == pytest.approx([share, share], abs=3 * math.sqrt(share * (1 - share) * (1 / 8192 + 1 / 20_000)))


def test_independent_teeth_give_one_over_the_root_of_those_in_mesh():
    """The same standard deviation for every wave makes teeth independent, but for the mean that none has."""
    design, sigma = drive(), 0.001
    deviations = ToothField(Z, (sigma,) * (Z // 2), 0.0).drawn(numbers(2000))
    assert deviations.mean(axis=1) == pytest.approx(np.zeros(2000), abs=1e-15)
    each = sigma * math.sqrt((Z - 1) / 2)
    assert deviations.std() == pytest.approx(each, rel=0.01)
    neighbours = np.mean(deviations * np.roll(deviations, 1, axis=1)) / each**2
    assert neighbours == pytest.approx(-1 / (Z - 1), abs=0.005)
    z_mp = meshing_teeth(design.geometry, contact_angle(design.geometry, design.wave_generator.profile))
    shared = LoadSharing.of(design).tables(deviations)
    # Without the common mean of Z teeth, Z_mp of them keep 1 - Z_mp/Z of their variance.
    expected = each / math.sqrt(z_mp) * math.sqrt((1 - z_mp / Z) * Z / (Z - 1))
    assert shared.std() == pytest.approx(expected, rel=0.02)


def test_a_wave_of_its_own_adds_to_that_of_independent_teeth_as_a_square():
    """Three times as large as any other beside it: the root of 1 + 9."""
    assert FAMILIES["one_wave"].spread(np.array([1.0, 2.0, 9.0]), 3.0).tolist() == pytest.approx([10**0.5, 1.0, 1.0])


def test_one_wave_is_a_sine_of_free_phase():
    field = ToothField(Z, (0.002, *[0.0] * (Z // 2 - 1)), 0.0)
    waves = np.fft.rfft(field.drawn(numbers(5000)))[:, 1] * 2 / Z
    assert stats.kstest(np.angle(waves) / (2 * math.pi) + 0.5, "uniform").pvalue > 0.01
    assert stats.kstest(np.abs(waves) / 0.002, "rayleigh").pvalue > 0.01


def test_drives_of_one_wave_are_drives_of_sines():
    """Each drive with a sine of the amplitude that the teeth in contact leave of its own wave."""
    design, n = drive(), 40
    u = numbers(n)
    fields = {
        spline: ToothField(z, (0.002, *[0.0] * (z // 2 - 1)), 0.0) for spline, z in (("cs_teeth", Z), ("fs_teeth", 160))
    }
    matrix = random_errors(n, 4).to_matrix()
    matrix[:, [8, 10]] = 0.0
    teeth = [DrawnTeeth(0, spline, field) for spline, field in fields.items()]
    found = drawn_peak_to_peak_arcmin(design, matrix, u[:, None], teeth, 1.0, 1.0)
    for column, (spline, z) in zip((8, 10), (("cs_teeth", Z), ("fs_teeth", 160)), strict=True):
        wave = np.fft.rfft(fields[spline].drawn(u))[:, 1] * 2 / z * LoadSharing.of(design).response(1, z)
        matrix[:, column], matrix[:, column + 1] = np.abs(wave), np.angle(wave) + math.pi / 2
    # What is left of whole teeth that enter and leave the window: below 1e-3 of the amplitudes.
    assert found == pytest.approx(np.ptp(beat_extremes_arcmin(design, matrix), axis=1), abs=4e-4)


def test_each_drive_has_the_teeth_that_its_number_picks():
    design, n = drive(), 600
    problem = drive_problem(
        design, {"axis_eccentricity_mm": Uniform(lower=0.0, upper=0.01)}, graded={"fs_teeth": GradedTeeth(TOLERANCES)}
    )
    inputs = problem.space.sample(np.random.default_rng(1).random((n, problem.space.dimension)))
    found = problem.response(inputs)
    (teeth,) = problem.response.teeth
    for row in (0, 255, 256, 599):  # in the first, at the end of it, and in later blocks
        own = MeasuredTeeth(tuple(teeth.field.drawn(inputs[[row], teeth.column])[0]))
        alone = matrix_peak_to_peak_arcmin(replace(design, fs_teeth=own), problem.response.matrix(inputs[[row]]))
        assert found[row] == pytest.approx(alone[0], abs=1e-9)


def test_neighbouring_numbers_pick_unrelated_splines():
    field = tooth_field(Z, TOLERANCES, 0.9973)
    near = field.drawn(0.3 + np.arange(4000) * 2.0**-30)
    related = np.corrcoef(near[:-1, 0], near[1:, 0])[0, 1]
    assert abs(related) < 4 / math.sqrt(4000)
    assert near[7] == pytest.approx(field.drawn(np.array([0.3 + 7 * 2.0**-30]))[0])


def test_tolerances_that_no_spectrum_has_are_refused():
    with pytest.raises(HdoptError, match="162 teeth have between .*independent deviations"):
        tooth_field(Z, PitchTolerances(0.005, 0.004), 0.9973)
    with pytest.raises(HdoptError, match="one wave a turn"):
        tooth_field(Z, PitchTolerances(0.001, 0.08), 0.9973)


def test_a_field_alone_has_the_share_that_it_has():
    """y = first tooth of a field + x: variances s^2 and 1/12, nothing jointly."""
    field = ToothField(Z, (0.3, *[0.0] * (Z // 2 - 1)), 0.0)
    space = InputSpace(
        {
            "cs_teeth": Tolerance(Uniform(lower=0.0, upper=1.0), None),
            "x": Tolerance(Uniform(lower=0.0, upper=1.0), 1.0),
        },
        turning=frozenset({"cs_teeth"}),
        fields=frozenset({"cs_teeth"}),
    )
    found = linearise(lambda inputs: field.drawn(inputs[:, 0])[:, 0] + inputs[:, 1], space, 1)
    # The first tooth is normal with spread 0.3; 4,096 points know its variance to 2.2 %.
    assert found.shares["cs_teeth"] == pytest.approx(0.09 / (0.09 + 1 / 12), abs=0.03)
    assert abs(found.shares["directions_jointly"]) < 0.03


def study(*changes):
    return load_study("csf-25-80", ["tolerances.cs_teeth={iso_1328_class=5}", *changes])


def test_a_study_draws_teeth_instead_of_the_sine_and_says_what_it_rests_on():
    problem = study_problem(study())
    names = problem.space.names
    assert "cs_teeth" in names
    assert not {"cs_tooth_amplitude_mm", "cs_tooth_phase_deg"} & set(names)
    assert "fs_tooth_amplitude_mm" in names
    assert problem.response.held.cs_tooth_amplitude == 0
    assert problem.space.groups["CS teeth"] == ("cs_teeth",)
    said = " ".join(problem.notes)
    assert "single pitch 5 um and cumulative pitch 17 um (class 5, ISO 1328-1:2013" in said
    assert "extrapolated, the source serves only involute flanks" in said
    assert problem.pitch["cs_teeth"]["extrapolated"][1] == "module 0.5 to 70 (here 0.396)"
    beside = study_problem(study("tolerances.cs_teeth.sine=beside"))
    assert {"cs_teeth", "cs_tooth_amplitude_mm"} <= set(beside.space.names)


def test_what_needs_bounds_or_neighbours_says_that_drawn_teeth_have_none():
    problem = study_problem(study())
    with pytest.raises(Unbounded, match="cs_teeth are drawn at random"):
        check_bounded(problem.space)
    with pytest.raises(HdoptError, match="compares neighbouring values"):
        run_screening(problem.response, problem.space, "delta")
    lower, upper = problem.space.box
    assert problem.response.upper_bound(lower, upper) is None


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("{single_pitch_um=4}", "either iso_1328_class, or both"),
        ("{iso_1328_class=5, single_pitch_um=4, cumulative_pitch_um=12}", "either iso_1328_class, or both"),
        (
            "{single_pitch_um=4000, cumulative_pitch_um=12000}",
            "may be 4000 um off at a pitch of 1244 um; half the pitch",
        ),
        ("{iso_1328_class=0}", "greater than or equal to 1"),
    ],
)
def test_half_a_tolerance_is_refused(given, message):
    with pytest.raises(HdoptError, match=message):
        study_problem(load_study("csf-25-80", [f"tolerances.cs_teeth={given}"]))


def test_tolerances_that_no_teeth_meet_are_named():
    """The number of teeth in the message once led to drive.circular_spline_teeth."""
    changed = "tolerances.cs_teeth={single_pitch_um=6, cumulative_pitch_um=5}"
    with pytest.raises(HdoptError, match=r"--set tolerances.cs_teeth: \[tolerances\] cs_teeth: a cumulative pitch of"):
        study_problem(load_study("csf-25-80", [changed]))


def test_teeth_that_were_measured_are_not_drawn(tmp_path):
    rows = "\n".join(f"{tooth},left,0.0" for tooth in range(1, Z + 1))
    (tmp_path / "cs.csv").write_text(rows, encoding="utf-8")
    (tmp_path / "own.toml").write_text(
        'drive = "csf-25-80"\n[cs_teeth]\nfile = "cs.csv"\ndeviation = "cumulative"\n'
        "[tolerances]\ncs_teeth = { iso_1328_class = 5 }\n",
        encoding="utf-8",
    )
    with pytest.raises(HdoptError, match="measured one by one in .cs_teeth. and toleranced"):
        study_problem(load_study(tmp_path / "own.toml"))


def test_a_fall_between_teeth_is_a_single_pitch_as_a_rise_is():
    """Fault caught: the largest of rises alone, which a spline whose one step falls would pass with."""
    falls = np.array([[3.0, 0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.0, 0.0]])
    assert largest_single(falls).tolist() == [3.0, 3.0]
    assert largest_single(-falls).tolist() == [3.0, 3.0]


@pytest.mark.parametrize("teeth", [8, 9])
def test_equal_waves_are_independent_teeth(teeth):
    """What all waves of one size make of the teeth is, but for their mean, the same for each and in common with no
    other: the covariance of the linear map itself, not of a sample. Fault caught: the last wave of an even number of
    teeth, which has one part only, with the variance of half a wave.
    """
    waves = teeth // 2
    field = ToothField(teeth, (1.0,) * waves, 0.0)
    parts = np.concatenate([np.eye(waves, dtype=complex), 1j * np.eye(waves)])
    made = field._teeth(parts)
    covariance = made.T @ made
    alone = np.eye(teeth) - 1 / teeth
    assert covariance == pytest.approx(alone * covariance[0, 0] / alone[0, 0], abs=1e-12 * teeth)


def test_the_splines_of_the_calibration_are_not_those_that_are_judged():
    """A figure that was set on the very splines it is tested on comes out right by itself. Fault caught: one stream for
    both.
    """
    u = (np.arange(4000) + 0.5) / 4000
    judged, calibrated = _normal_pairs(u, 2), _normal_pairs(u, 2, CALIBRATION_SEED)
    together = np.corrcoef(judged.view(float).T, calibrated.view(float).T)[:4, 4:]
    assert np.abs(together).max() < 4.5 / np.sqrt(4000)  # 16 coefficients: 1e-4 of chance


def splitmix64(state: int) -> int:
    """The output of SplitMix64 at a `state` that was advanced already (Steele, Lea, Flood 2014, Figure 17)."""
    word = state % 2**64
    word = (word ^ (word >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
    word = (word ^ (word >> 27)) * 0x94D049BB133111EB % 2**64
    return word ^ (word >> 31)


def test_teeth_come_from_the_published_generator():
    """First against outputs of SplitMix64 that were published (seed 1234567, Rosetta Code), then the words that one
    number of a sample gives, and their pair by Box and Muller. Faults caught: a stream that begins at its second word,
    words or bits left out."""
    golden = 0x9E3779B97F4A7C15
    published = [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431]
    assert [splitmix64(1234567 + k * golden) for k in range(1, 5)] == published
    u, stream, pairs = 0.3, 4, 2
    (bits,) = struct.unpack("<Q", struct.pack("<d", u))
    seed = splitmix64(bits + (stream + 1) * golden)
    uniform = [((splitmix64(seed + k * golden) >> 11) + 0.5) / 2**53 for k in range(1, 2 * pairs + 1)]
    expected = [
        math.sqrt(-2 * math.log(one)) * cmath.exp(2j * math.pi * other)
        for one, other in zip(uniform[:pairs], uniform[pairs:], strict=True)
    ]
    np.testing.assert_allclose(_normal_pairs(np.array([u]), pairs, stream)[0], expected, rtol=1e-12)


def test_an_explorer_says_whose_teeth_are_drawn():
    """Its page shows one sine a spline, beside a cloud of drives with teeth of their own."""
    assert any(
        "cloud's drives have teeth drawn from tolerances of pitch (cs_teeth)" in note for note in _notes(study())
    )


def test_both_tolerances_are_told_in_micrometres():
    """Fault caught: the single pitch's tolerance in the place of the cumulative one's."""
    told = GradedTeeth(replace(TOLERANCES, single=0.004, cumulative=0.011)).to_dict(40)
    assert (told["single_pitch_um"], told["cumulative_pitch_um"]) == pytest.approx((4.0, 11.0))


def test_what_is_measured_of_a_spline_stays_beside_what_is_drawn():
    """Fault caught: drawn teeth in the place of the measured ones."""
    design, g = drive(), np.random.default_rng(5)
    own, drawn = g.normal(0, 0.002, Z), g.normal(0, 0.002, (2, Z))
    measured, rows = replace(design, cs_teeth=MeasuredTeeth(tuple(own))), slice(0, 2)
    alone, _ = tables_of_teeth(measured, lambda rows: {})(rows)
    beside, _ = tables_of_teeth(design, lambda rows: {"cs_teeth": drawn[rows]})(rows)
    both, _ = tables_of_teeth(measured, lambda rows: {"cs_teeth": drawn[rows]})(rows)
    assert np.ptp(alone) > 1e-4
    assert both == pytest.approx(alone + beside, abs=1e-12)
