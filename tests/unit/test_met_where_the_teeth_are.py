"""What stands on a spline is met at the zone's deepest point, as the base's own teeth are: in model, fit, kernels."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from cases import random_errors
from effect_examples import EXAMPLES, NAMES
from scipy.special import erf

from hdopt.bench.gears import CSF
from hdopt.bench.geometry import ARCMIN, BaseErrors, at_angle, find_zones, zone_deviation_mm
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.drive.errors import DriveErrors
from hdopt.effects import EFFECTS
from hdopt.effects.local_tooth_defect import Seat
from hdopt.effects.met import Pulse, Spline, ToothForms, gaussian
from hdopt.effects.sines import sine_columns, sine_sum
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings.rows import Rows
from hdopt.simulation import EffectValues, ExtendedModel, Operation
from hdopt.simulation.batch import matrix_peak_to_peak_arcmin, tabulate
from hdopt.simulation.extremes import peak_to_peak_arcmin
from hdopt.study import load_study

STUDY = load_study("csf-25-80")
GEAR = STUDY.drive.geometry
ERRORS = DriveErrors(*random_errors(40, seed=11).to_matrix()[7])
THETA = np.linspace(0.0, 2 * np.pi * 80, 4001)[:-1]
DENSE = 81_000
"""Places of a spline on which the bench has the deviation as an array, joined by straight lines: of 162 waves a turn
they leave (162 2 pi/81000)^2/8 = 2e-5 of the amplitude."""


def in_zones(name, keys):
    """The effect with these keys, None where it acts beside the zones."""
    values = EffectValues(name, *EFFECTS[name].values(keys, GEAR))
    rows = Operation().conditions(GEAR.ratio, np.linspace(0.0, 9.0, 3), 1.0, 2 * np.pi * 80)
    return values if values.term(rows).in_zones else None


ZONED = [
    pytest.param(values, keys, id=label)
    for (name, keys), label in zip(EXAMPLES, NAMES, strict=True)
    if "zones" in EFFECTS[name].acts and (values := in_zones(name, keys)) is not None
]


def sines(keys, pattern):
    """Group of the key, amplitude (um) and phase (rad) of every sine among `keys` whose amplitude's key fits."""
    for key, amplitude in keys.items():
        if found := re.fullmatch(pattern, key):
            phase = key.replace("_um", "_deg").replace("amplitude", "phase")
            phase = phase if "phase" in phase else re.sub(r"_deg$", "_phase_deg", phase)
            yield found.groups(), amplitude, math.radians(keys[phase])


def by_hand(name, keys, x, zone):
    """The effect's deviation (um of arc) at the angle `x` (rad) of the spline, from its keys and definition alone."""
    if name == "circular_spline_lobing":
        radius = keys["radial_amplitude_um"] * np.sin(keys["lobes"] * x + math.radians(keys["phase_deg"]))
        if "phase_2_deg" in keys:
            overtone = np.sin(2 * keys["lobes"] * x + math.radians(keys["phase_2_deg"]))
            radius = radius + keys["radial_amplitude_2_um"] * overtone
        return math.tan(math.radians(12)) * radius
    if name == "local_tooth_defect":
        off = np.mod(x - math.radians(keys["angle_deg"]) + np.pi, 2 * np.pi) - np.pi
        return keys["height_um"] * np.exp(-0.5 * (off / math.radians(keys["width_deg"])) ** 2)
    if "form_heights_um" in keys:
        place = np.mod(x / (2 * np.pi) * 162 - keys["form_start"], 162)
        part = 2 * np.pi * np.mod(place, 1)
        form = (1 - np.cos(part)) / 2 + keys["form_skew"] * np.sin(part)
        return np.array(keys["form_heights_um"])[np.floor(place).astype(int)] * form
    if name == "tooth_mesh":
        total = 0.0 * x
        pattern = rf"zone_{zone + 1}_amplitude(?:_(plus|minus)_(\d))?_um"
        for (way, size), amplitude, phase in sines(keys, pattern):
            side = int(size or 0) * (-1 if way == "minus" else 1)
            total = total + amplitude * np.sin((162 + side) * (x - np.pi * zone) + phase)
        return total
    return sum(a * np.sin(int(h) * x + phase) for (h,), a, phase in sines(keys, r"amplitude_(\d+)_um"))


def on_the_bench(errors, name, keys):
    """The bench's kinematic error (arcmin): exact rotated contours, tooth deviations as arrays."""
    e = errors
    base = BaseErrors.from_polar(
        (e.axis_eccentricity, e.axis_eccentricity_direction),
        (e.axis_tilt_y, e.axis_tilt_x),
        (e.wg_eccentricity, e.wg_eccentricity_direction),
        (e.wg_tilt_major, e.wg_tilt_minor),
        (e.cs_tooth_amplitude, e.cs_tooth_phase),
        (e.fs_tooth_amplitude, e.fs_tooth_phase),
    )
    zones = find_zones(base, THETA, CSF)
    x = np.arange(DENSE) * 2 * np.pi / DENSE
    cs = e.cs_tooth_amplitude * np.sin(x + e.cs_tooth_phase)
    fs = e.fs_tooth_amplitude * np.sin(x + e.fs_tooth_phase)
    deviation = zone_deviation_mm(zones, cs, fs)
    if name == "bearing_pass":  # balls stand under the ends of the wave generator, on neither spline
        place = (1 + keys["ball_to_pitch_ratio"]) * (1 + 1 / 80) / 2 * THETA
        for zone in (0, 1):
            for (h,), a, phase in sines(keys, r"unequal_(\d+)_um"):
                deviation[zone] += 1e-3 * a * np.sin(int(h) * (place + np.pi * zone) + phase)
    else:
        flex = name.startswith("fs_") or keys.get("on") == "flexspline"
        for zone in (0, 1):
            angle = (zones.fs_angle if flex else zones.cs_angle)[zone]
            deviation[zone] += 1e-3 * at_angle(by_hand(name, keys, x, zone), angle)
    return CSF.rad_per_mm(THETA) * deviation.max(axis=0) / ARCMIN


def test_offsets_are_large_enough_to_tell():
    """A test of where a zone stands needs drives whose deepest points lie off the ends of the major axis: here by 0.01
    rad and more, which shifts a wave of 162 by 1.6 rad."""
    model = CartesianModel.of(STUDY.drive)
    beyond = model.beyond_at(model.rotation(THETA), to_cartesian(ERRORS, model.half_width))
    assert np.all(np.abs(beyond).max(axis=2) > 0.01)


@pytest.mark.parametrize(("values", "keys"), ZONED)
def test_the_bench_meets_an_effect_where_the_model_does(values, keys):
    """Two formulations without shared code, both of the exact geometry: equal but for the bench's array, 2e-5 of an
    amplitude of a few um (0.05 to 0.5 arcmin), and the angle of its flexspline, exact to rounding."""
    model = ExtendedModel(STUDY.drive, ERRORS, (values,), geometry="exact")
    assert model.waveform(THETA) == pytest.approx(on_the_bench(ERRORS, values.id, keys), abs=2e-5)


def test_every_effect_that_can_act_in_the_zones_is_among_them():
    assert {values.id for values, _ in (p.values for p in ZONED)} == {
        name for name, effect in EFFECTS.items() if "zones" in effect.acts
    }


@pytest.mark.parametrize(("spline", "part"), [("cs", "cs_tooth"), ("fs", "fs_tooth")])
@pytest.mark.parametrize("geometry", ["exact", "closed form"])
def test_one_wave_as_an_effect_is_the_base_s_own_tooth_error(spline, part, geometry):
    a, phi = 0.002, 0.7
    own = replace(ERRORS, **{f"{part}_amplitude": a, f"{part}_phase": phi})
    without = replace(ERRORS, **{f"{part}_amplitude": 0.0})
    wave = EffectValues(f"{spline}_tooth_harmonics", {"members": (1,)}, (a * np.cos(phi), a * np.sin(phi)))
    as_effect = ExtendedModel(STUDY.drive, without, (wave,), geometry=geometry).waveform(THETA)
    assert as_effect == pytest.approx(ExtendedModel(STUDY.drive, own, (), geometry=geometry).waveform(THETA), abs=1e-11)


def rows_of(theta):
    n = len(theta)
    steady, one, none = np.zeros(n), np.ones(n), np.zeros(n, np.int64)
    return Rows(
        ratio=80.0,
        theta=theta,
        output=theta / 80,
        direction=one,
        travel=theta,
        first=np.ones(n, bool),
        record=none,
        piece=none,
        time=None,
        speed=None,
        torque=None,
        temperature=None,
        error=steady,
        block=none,
        weight=one,
        quantum=0.0,
    )


FITTED = [p for p in ZONED if p.values[0].id != "bearing_pass"]


@pytest.mark.parametrize(("values", "keys"), FITTED)
def test_a_fit_meets_an_effect_where_the_model_does_and_knows_its_slopes(values, keys):
    """The fitted value is the closed form's; its slopes over base errors and coefficients are central differences, away
    from the rows where zone or rim changes within a step."""
    base = CartesianModel.of(STUDY.drive)
    rows = rows_of(THETA)
    problem = FitProblem(rows, base, np.ones((len(rows), 1)), Noise.white(rows, 1.0))
    errors, term, c = to_cartesian(ERRORS, base.half_width), values.term(rows), np.array(values.coefficients)

    def at(errors, c):
        return evaluate(problem, errors, np.zeros(1), (term,), (c,))

    fit = at(errors, c)
    model = ExtendedModel(STUDY.drive, ERRORS, (values,), geometry="closed form")
    assert fit.prediction == pytest.approx(model.waveform(THETA), abs=1e-10)
    design = fit.design(move_shapes=False)
    moved = [(1e-7 * (np.arange(12) == k), 0 * c) for k in range(12)]
    moved += [(np.zeros(12), 1e-7 * (np.arange(len(c)) == k)) for k in range(len(c))]
    columns = np.delete(design, 12, axis=1).T  # without the zero of the recording
    for (change, more), column in zip(moved, columns, strict=True):
        up, down = at(errors + change, c + more), at(errors - change, c - more)
        same = (up.zone == fit.zone) & (down.zone == fit.zone)
        off = np.abs((up.prediction - down.prediction) / 2e-7 - column)[same]
        # One row in a hundred may lie where a rim changes within the step.
        assert np.quantile(off, 0.99) < 1e-4 * max(np.abs(column).max(), 1.0)


SEARCHED = {
    "a wave on the CS": ("cs_tooth_harmonics", {"members": (2, 5)}, (0.001, 0.0005, 0.0, 0.001), 1e-5),
    "a wave on the FS": ("fs_tooth_harmonics", {"members": (2, 5)}, (0.001, 0.0005, 0.0, 0.001), 1e-5),
    "a tooth of the CS": (
        "local_tooth_defect",
        {"centre": 1.0, "width_deg": 2.0, "on": Seat.CIRCULAR_SPLINE},
        (0.004,),
        3e-4,
    ),
    "a tooth of the FS": (
        "local_tooth_defect",
        {"centre": 1.0, "width_deg": 2.0, "on": Seat.FLEXSPLINE},
        (0.004,),
        3e-4,
    ),
    "every tooth": ("tooth_mesh", {"sidebands": (0,), "zones": True}, (5e-4, 0.0, 0.0, 5e-4), 3e-4),
}
"""Effects on the splines, and how far (arcmin) the compiled extremes may be from the model's: tables have 64 places in
a period, which dims a peak by (2 pi/64)^2/8 = 1.2e-3, of 0.2 arcmin of a pulse or 0.06 of the teeth."""


@pytest.mark.parametrize("name", SEARCHED)
def test_extremes_of_many_drives_are_those_of_each(name):
    """Each drive meets the splines elsewhere; the table of the effects is one for all."""
    effect, shape, coefficients, within = SEARCHED[name]
    values = EffectValues(effect, shape, coefficients)
    rows = random_errors(40, seed=11).to_matrix()[:3]
    found = matrix_peak_to_peak_arcmin(STUDY.drive, rows, tabulate(STUDY.drive, [values], Operation()))
    for value, row in zip(found, rows, strict=True):
        model = ExtendedModel(STUDY.drive, DriveErrors(*row), (values,), geometry="closed form")
        assert value == pytest.approx(peak_to_peak_arcmin(model), abs=within)


def columns_by_sines(phase, harmonics):
    """Sine and cosine of each multiple, one by one."""
    return np.column_stack([wave(h * phase) for h in harmonics for wave in (np.sin, np.cos)])


def test_sums_of_sines_are_their_columns_and_slopes():
    phase, h = np.linspace(-20, 20, 300), 1e-6
    for harmonics in ((2, 3), (1, 2, 3, 4, 8), (0.5, 1.3), (162.0, 161.0), (162.0, 160.0, 164.0), (40,)):
        c = np.random.default_rng(1).normal(size=2 * len(harmonics))
        value, slope = sine_sum(phase, harmonics, c)
        assert value == pytest.approx(columns_by_sines(phase, harmonics) @ c, abs=1e-11)
        ahead = (sine_columns(phase + h, harmonics) - sine_columns(phase - h, harmonics)) @ c / (2 * h)
        assert slope == pytest.approx(ahead, abs=1e-3)


def test_a_form_of_single_teeth_is_by_hand_and_its_slope_is_the_difference():
    """Five teeth from 0.25 pitches on. Faults caught: a tooth counted from the wrong place, the pitch as the turn, a
    slope per part of a tooth, a skew in the height's place."""
    heights, skew, start = np.array([1.0, -2.0, 3.0, 0.5, 4.0]), 0.3, 0.25
    forms = ToothForms(Spline.CIRCULAR, heights[:, None], skew, start)
    angle = np.linspace(-9, 9, 700)
    value, slope = forms.added(angle, 1, np.array([2.0]))
    for at, found in zip(angle, value, strict=True):
        place = (math.degrees(at) / 72 - start) % 5
        part = 2 * math.pi * (place % 1)
        assert found == pytest.approx(2 * heights[int(place)] * ((1 - math.cos(part)) / 2 + skew * math.sin(part)))
    assert value == pytest.approx(forms.columns(angle, 0)[:, 0] * 2)
    h = 1e-6
    ahead = (forms.added(angle + h, 0, np.array([2.0]))[0] - forms.added(angle - h, 0, np.array([2.0]))[0]) / (2 * h)
    assert slope == pytest.approx(ahead, abs=1e-4)


TWINS = {
    "waves of the CS": ("cs_tooth_harmonics", {"members": (2, 3)}, (0.001, 0.0005, 0.001, 0.0), (1, 1, -1, -1)),
    "waves of the FS": ("fs_tooth_harmonics", {"members": (2, 5)}, (0.001, 0.0005, 0.001, 0.0), (1, 1, -1, -1)),
    "a tooth of the CS": (
        "local_tooth_defect",
        {"centre": 1.0, "width_deg": 2.0, "on": Seat.CIRCULAR_SPLINE},
        (0.004,),
        (1,),
    ),
    "a tooth of the FS": (
        "local_tooth_defect",
        {"centre": 1.0, "width_deg": 2.0, "on": Seat.FLEXSPLINE},
        (0.004,),
        (1,),
    ),
}
"""Effects, and the sign of each coefficient half a turn on."""


@pytest.mark.parametrize("name", TWINS)
def test_which_end_of_the_wave_generator_is_which_leaves_no_trace(name):
    """A drive turned by half a turn against its wave generator has the same error, whatever stands on its splines: no
    recording says whether a tooth is at an angle or half a turn on."""
    effect, shape, coefficients, signs = TWINS[name]
    half = {"axis_eccentricity_direction", "wg_eccentricity_direction", "cs_tooth_phase", "fs_tooth_phase"}
    turned = {n: v + np.pi if n in half else -v if "tilt" in n else v for n, v in ERRORS.by_name().items()}
    far = {**shape, "centre": shape["centre"] + np.pi} if "centre" in shape else shape
    here = EffectValues(effect, shape, coefficients)
    there = EffectValues(effect, far, tuple(s * c for s, c in zip(signs, coefficients, strict=True)))
    for geometry in ("exact", "closed form"):
        one = ExtendedModel(STUDY.drive, ERRORS, (here,), geometry=geometry)
        other = ExtendedModel(STUDY.drive, DriveErrors(**turned), (there,), geometry=geometry)
        assert other.waveform(THETA) == pytest.approx(one.waveform(THETA), abs=1e-9)


@pytest.mark.parametrize("row", [0.0, 0.02, 0.09])
def test_a_pulse_in_means_of_neighbours_is_its_mean(row):
    """Means over a row, against the mean of the Gaussian at 2,000 places in it, and their slope against differences.
    Fault caught: the pulse taken at the middle of a row that is wider than it.
    """
    sigma, centre = 0.03, 2.0
    angle = np.linspace(1.8, 2.2, 41) + 2 * np.pi * np.arange(41)
    places = row * (np.arange(2000) + 0.5) / 2000 - row / 2
    gaussian = np.exp(-0.5 * ((np.linspace(1.8, 2.2, 41)[:, None] + places - centre) / sigma) ** 2)
    pulse = Pulse(Spline.CIRCULAR, centre, sigma, row)
    # The midpoint rule is off by (row/2000)^2 f''/24 with f'' at most 1/sigma^2: 1e-7 at the widest.
    np.testing.assert_allclose(pulse.columns(angle, 0)[:, 0], gaussian.mean(1), atol=1e-7)
    value, slope = pulse.added(angle, 0, np.array([0.004]))
    np.testing.assert_allclose(value, 0.004 * gaussian.mean(1), atol=1e-9)
    step = 1e-5
    sides = [pulse.added(angle + side, 0, np.array([0.004]))[0] for side in (-step, step)]
    # Third derivative at most 3 * 0.004/sigma^3, by step^2/6.
    np.testing.assert_allclose(slope, (sides[1] - sides[0]) / (2 * step), atol=1e-8)


@pytest.mark.parametrize("row", [0.0, 0.1, 2.0])
def test_a_pulse_is_the_same_all_round(row):
    """Against SciPy's error function at every distance: where it ends, it is less than rounding of its height, or of
    the mean over a wide row. Fault caught: an end that shows."""
    sigma, off = 0.1, np.linspace(-3.0, 3.0, 6001)
    if row:
        scale = np.sqrt(2) * sigma
        area = erf((off + row / 2) / scale) - erf((off - row / 2) / scale)
        expected = np.sqrt(np.pi) / 2 * scale / row * area
    else:
        expected = np.exp(-0.5 * (off / sigma) ** 2)
    np.testing.assert_allclose(gaussian(off, sigma, row), expected, atol=1e-15)


def test_rows_that_are_means_are_wide_for_a_pulse():
    """Fault caught: terms of averaged rows made as if each were a sample."""
    rows = Operation().conditions(GEAR.ratio, np.linspace(0.0, 40.0, 401), 1.0, 2 * np.pi * 80)
    shape = {"centre": 1.0, "width_deg": 2.0, "on": Seat.CIRCULAR_SPLINE}
    effect = EFFECTS["local_tooth_defect"]
    assert effect.term(rows, shape).met.row == 0.0
    assert effect.term(replace(rows, averaged=4.0), shape).met.row == pytest.approx(0.1)
    once = {**shape, "on": Seat.CIRCULAR_SPLINE_ONCE}
    narrow, wide = (effect.term(r, once).columns.max() for r in (rows, replace(rows, averaged=4.0)))
    assert wide < 0.8 * narrow
