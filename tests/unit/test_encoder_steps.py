"""Steps of a coarse output encoder: read off the angles, and taken out of the error about a model that may be wrong."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from hdopt.bench.cases import Spec, simulate
from hdopt.diagnosis import diagnose
from hdopt.diagnosis.inference.encoder_steps import added_by_reading, noise_before_reading, without_output_steps
from hdopt.diagnosis.inference.hidden_turns import without_samples
from hdopt.diagnosis.orientation import turn_round
from hdopt.diagnosis.settings import DEFAULT
from hdopt.drive.geometry import ARCMIN
from hdopt.recordings.encoder_step import encoder_step
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study

TURN = 2 * np.pi
STEP = 360 / 2**14
RATIO = 80.0
SETTINGS = DEFAULT.encoder_steps


@pytest.mark.parametrize("leaps", [1, 3, 7])
@pytest.mark.parametrize("precision", [np.float64, np.float32])
def test_step_is_read_off_levels_that_are_left_out(leaps, precision):
    """Would catch a step taken from the usual distance of levels: where the output moves by several, that is twice."""
    counts = np.cumsum(np.random.default_rng(0).integers(leaps // 2, leaps + 1, 5000)) - 40
    assert encoder_step(precision(counts * STEP)) == pytest.approx(STEP, rel=1e-4)


def test_angles_off_every_grid_have_no_step():
    rng = np.random.default_rng(1)
    assert encoder_step(np.cumsum(rng.random(3000))) == 0
    assert encoder_step(np.cumsum(rng.random(10))) == 0
    assert encoder_step(np.zeros(100)) == 0


def test_even_sampling_is_no_encoder():
    """Would catch a drive without error, sampled evenly: its output lies on an even grid as well."""
    even = np.arange(720) * 0.6
    assert encoder_step(even + np.random.default_rng(3).normal(0, 3e-4, len(even))) == 0
    there_and_back = np.r_[even, even[::-1]]
    assert encoder_step(there_and_back) == 0


def test_even_angles_with_lost_rows_are_no_encoder():
    """Would catch samples taken every degree of the input, some of them lost, called an encoder of 1 deg."""
    kept = np.random.default_rng(4).random(2000) > 0.1
    angle, time = np.arange(2000.0)[kept], 0.01 * np.arange(2000)[kept]
    assert encoder_step(angle, time) == 0
    assert encoder_step(angle) == 1  # without a clock nobody can tell


def test_an_encoder_slower_than_its_samples_has_a_step():
    """Would catch standing still on a step, for 100 samples each, called even sampling."""
    assert encoder_step(np.floor(np.arange(6000) / 100) * STEP) == pytest.approx(STEP, rel=1e-9)


def test_a_fast_input_on_a_coarse_encoder_has_a_step():
    """1 deg of the input, 60/80 arcmin at the output, though no reading comes twice: 3.7 deg a sample."""
    theta = 3.7 * np.arange(4000)
    output = theta / RATIO + 1e-3 * np.random.default_rng(5).normal(size=4000)
    table = pd.DataFrame({"time_s": theta, "input_angle_deg": np.floor(theta), "output_angle_deg": output})
    found = recording_from_table(table, RATIO)
    assert found.quantum_arcmin == pytest.approx(0.75, rel=1e-6)
    assert any("move in steps of 0.75 arcmin" in said for said in found.warnings)


def recorded(error_arcmin, theta, step_deg=STEP):
    """A recording whose output encoder reads the nearest of its steps."""
    output = np.degrees(theta) / RATIO - error_arcmin / 60
    if step_deg:
        output = np.round(output / step_deg) * step_deg
    table = pd.DataFrame({"time_s": theta, "input_angle_deg": np.degrees(theta), "output_angle_deg": output})
    return recording_from_table(table, RATIO)


THETA = np.arange(8000) * TURN / 100
KE = 0.1 * np.sin(2 * THETA + 0.4)


def wave(values, order):
    """Amplitude of a wave of `order` in `values` (n,)."""
    return 2 * abs(np.mean(values * np.exp(-1j * order * THETA)))


def smooth(missed=0.0):
    """A model that fits the truth but for a wave of order 3, `missed` (arcmin), and a zero that it finds."""

    def model(recordings):
        rows = gather(recordings)
        known = KE + missed * np.sin(3 * THETA)
        return known + np.mean(rows.error - known)

    return model


def test_a_recording_says_the_step_of_its_output():
    assert recorded(KE, THETA).output_step_arcmin == pytest.approx(60 * STEP, rel=1e-4)
    assert recorded(KE, THETA, 0).output_step_arcmin == 0


def test_the_folded_order_vanishes_and_what_the_model_missed_stays():
    """16384 steps an output turn are 204.8 an input turn, which 100 rows fold to 4.8: q/pi high as read. A wave that
    the model gets wrong by 0.05 comes back as the truth has it, to the scatter's standard error of 0.005."""
    record = recorded(KE, THETA)
    assert wave(record.error_arcmin, 4.8) == pytest.approx(60 * STEP / np.pi, rel=0.1)
    (freed,) = without_output_steps([record], smooth(0.05), SETTINGS)
    assert wave(freed.error_arcmin, 4.8) < 0.05 * wave(record.error_arcmin, 4.8)
    left = freed.error_arcmin - KE
    assert wave(left, 3) < 0.015
    assert np.std(left) < 0.7 * 60 * STEP / np.sqrt(12)


@pytest.mark.parametrize("waves", [1, 2, 3])
def test_noise_before_the_reading_leaves_no_wave_of_the_steps(waves):
    """Would catch edges taken for sharp: noise of 0.2 arcmin before steps of 1.3 leaves their first waves 0.13 and
    0.15 high. What may stay is four standard errors of what scatters."""
    record = recorded(KE + np.random.default_rng(7).normal(0, 0.2, len(THETA)), THETA)
    (freed,) = without_output_steps([record], smooth(), SETTINGS)
    left = freed.error_arcmin - KE
    order = waves * 16384 / RATIO
    assert wave(left - left.mean(), order) < 4 * np.std(left) * np.sqrt(2 / len(THETA))


def test_noise_before_the_reading_is_told_by_the_whole_steps_that_it_makes():
    """Readings of normal noise of 0.1 about places all over a step of 1: the theorem holds while noise is small."""
    rng = np.random.default_rng(8)
    place = rng.uniform(-0.5, 0.5, 200_000)
    wrong = np.round(place + rng.normal(0, 0.1, len(place)))
    assert noise_before_reading(1.0, float(np.std(wrong))) == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.2])
def test_what_reading_adds_is_its_mean_over_the_noise(noise):
    """Would catch a sign turned or the wrong edge. 20,000 draws at each place: four standard errors are
    0.014 at most."""
    rng = np.random.default_rng(9)
    place = np.linspace(-0.45, 0.45, 19)
    drawn = np.round(place[:, None] + noise * rng.normal(size=(19, 20_000))) - place[:, None]
    # A model says the place; a reading is left of it by whole steps less that place.
    np.testing.assert_allclose(added_by_reading(2.0 - place, 1.0, noise), drawn.mean(1), atol=0.015)


def test_the_output_stood_where_the_model_says():
    """Would catch whole steps taken for motion: a wave of the output angle could follow each of them."""
    (freed,) = without_output_steps([recorded(KE, THETA)], smooth(0.05), SETTINGS)
    model = THETA / RATIO - freed.output_angle
    # Of a smooth wave neighbours differ by 2 pi 3/100 of 0.15 arcmin at most; of whole steps by 1.3.
    assert np.max(np.abs(np.diff(model))) < 0.03 * ARCMIN
    np.testing.assert_allclose(gather([freed]).output, freed.output_angle)


def test_scatter_of_readings_is_turned_round_and_hidden_with_the_error():
    (freed,) = without_output_steps([recorded(KE, THETA)], smooth(0.05), SETTINGS)
    (turned,) = turn_round([freed])
    np.testing.assert_allclose(turned.output_angle, -freed.output_angle)
    hidden = THETA > 300
    (seen,) = without_samples([freed], [hidden])
    np.testing.assert_allclose(seen.output_angle, freed.output_angle[~hidden])


def test_steps_stay_where_something_else_is_larger_or_none_is_there():
    loud = recorded(KE + np.random.default_rng(2).normal(0, 1.0, len(THETA)), THETA)
    (kept,) = without_output_steps([loud], smooth(), SETTINGS)
    assert kept.output_step_arcmin == 0
    np.testing.assert_array_equal(kept.error_arcmin, loud.error_arcmin)
    # Steps that would scatter far more than what is left are none.
    (kept,) = without_output_steps([replace(recorded(KE, THETA, 0), output_step_arcmin=36.0)], smooth(), SETTINGS)
    assert kept.output_step_arcmin == 0
    fine = replace(recorded(KE, THETA), output_step_arcmin=0.0)
    (kept,) = without_output_steps([fine], smooth(), SETTINGS)
    np.testing.assert_array_equal(kept.error_arcmin, fine.error_arcmin)


@pytest.mark.slow
@pytest.mark.parametrize("reading", ["12-bit output", "14-bit output"])
def test_a_sound_drive_on_a_coarse_encoder_is_adequate(reading):
    """Before steps were taken out each was `unknown`, at an order to which the sampling folds them."""
    drive = load_study(drive="csf-25-80").drive
    drawn = simulate(Spec("coarse", 2, reading=reading, size="small", gear="csf-25-80"))
    answer = diagnose([recording_from_table(table, RATIO) for table in drawn.tables], drive)
    assert (answer.verdict, answer.effects) == ("adequate", ())


def test_moves_by_eight_or_nine_steps_tell_one():
    """480 samples a turn of 4,096 counts: no two of the angles lie nearer than eight steps. Would catch a step that is
    a whole part of the smallest move alone."""
    step = 360 / 4096
    angle = step * np.round(np.arange(20 * 480) * 360 / 480 / step)
    moved = angle[np.r_[0:4000, 4007:9600]]
    assert encoder_step(moved) == pytest.approx(step, rel=1e-9)
