"""Steps of a coarse input encoder: gone where the motion says what they add, and kept where it does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import scipy.ndimage
import scipy.signal

from hdopt.diagnosis import diagnose, pipeline
from hdopt.diagnosis.inference.input_steps import (
    beyond_smooth,
    hold_throughout,
    regression,
    smoothed,
    without_input_steps,
)
from hdopt.diagnosis.settings import DEFAULT
from hdopt.drive.geometry import ARCMIN
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.recording import Recording
from hdopt.study import load_study

SETTINGS = DEFAULT.encoder_steps
RATIO, COUNTS, A_TURN, TURN = 80.0, 4096, 480, 2 * np.pi
STEP = TURN / COUNTS
STEP_ARCMIN = STEP / RATIO / ARCMIN


def there_and_back(turns=30, rate=A_TURN):
    """A motion at one speed: its angle falls on no count at the start."""
    there = 0.123 * STEP + np.arange(turns * rate) * TURN / rate
    return np.r_[there, there[::-1]]


def read(angle, error=0.0, noise=0.003, **more):
    """A recording of the motion `angle` read to the nearest count, of a drive with this `error`, arcmin."""
    output = angle / RATIO - (error + np.random.default_rng(1).normal(0, noise, len(angle))) * ARCMIN
    taken = STEP * np.round(angle / STEP)
    return Recording("record", RATIO, taken, (taken / RATIO - output) / ARCMIN, input_step_arcmin=STEP_ARCMIN, **more)


def line(recording, order, rows=slice(None)):
    """Amplitude of one order of the error, arcmin."""
    return 2 * abs(np.mean(recording.error_arcmin[rows] * np.exp(-1j * order * recording.input_angle[rows])))


def test_orders_that_steady_sampling_folds_are_gone():
    """Of 4,096 counts 480 samples a turn make order 224 (9 x 480 - 4,096), and twice as many counts order 32: q/(2 pi),
    alike there and back (of 15 places within a step, 6 % beside it). An encoder of 32 lines was named by them at 0.97.
    What is left is what the window holds of them, and the noise, and the angle is where the input stood."""
    angle = there_and_back()
    coarse = read(angle)
    (fine,) = without_input_steps([coarse], SETTINGS)
    assert line(coarse, 32) == pytest.approx(STEP_ARCMIN / TURN, rel=0.06)
    assert line(fine, 32) < 0.1 * line(coarse, 32)
    assert np.std(fine.error_arcmin) < 0.4 * np.std(coarse.error_arcmin)
    ends = np.abs(np.arange(len(angle)) - len(angle) / 2) < 200
    assert np.abs(fine.input_angle - angle)[~ends].max() < 0.3 * STEP
    # Angle and error belong together: the output stands where it was read.
    np.testing.assert_allclose(fine.output_angle, coarse.output_angle, atol=1e-12)


def test_what_the_drive_does_stays():
    """Lines of an encoder below a step, and the drive's own error, in what was freed of steps."""
    angle = there_and_back()
    (fine,) = without_input_steps([read(angle, 0.02 * np.sin(24 * angle) + 0.3 * np.sin(2 * angle))], SETTINGS)
    assert line(fine, 24) == pytest.approx(0.02, rel=0.03)
    assert line(fine, 2) == pytest.approx(0.3, rel=0.01)


def test_a_motion_that_is_not_smooth_is_believed():
    """An input that moves to and fro by a third of a step at order 40, which its output follows: taken for steps this
    would be a line of the error. The recording is the same one."""
    angle = there_and_back()
    moving = read(angle + STEP / 3 * np.sin(40 * angle))
    assert without_input_steps([moving], SETTINGS)[0] is moving
    assert line(moving, 40) < 0.2 * STEP_ARCMIN / 3


@pytest.mark.parametrize("kept", ["no step", "locked", "noise", "short"])
def test_where_nothing_is_known_the_recording_stays(kept):
    recording = {
        "no step": replace(read(there_and_back()), input_step_arcmin=0.0),
        "locked": replace(read(there_and_back()), input_angle=np.zeros(60 * A_TURN)),
        "noise": read(there_and_back(turns=3), noise=0.2),
        "short": read(there_and_back(turns=1, rate=24)[:24]),
    }[kept]
    assert without_input_steps([recording], SETTINGS)[0] is recording


def test_parts_between_gaps_are_smoothed_by_themselves():
    """A gap of three radians in the middle is no motion of one sample."""
    angle = there_and_back()
    angle[20 * A_TURN :] += 3.0
    segment = (np.arange(len(angle)) >= 20 * A_TURN).astype(np.int64)
    (fine,) = without_input_steps([read(angle, segment=segment)], SETTINGS)
    near = np.abs(np.arange(len(angle)) - 20 * A_TURN) < 40
    assert np.abs(fine.input_angle - angle)[near].max() < 0.5 * STEP
    assert np.std((fine.input_angle - angle)[near]) < 0.5 * STEP / 12**0.5


def test_about_a_reversal_steps_stay():
    """No smooth motion turns back from one sample to the next: there the reading stands as it was."""
    angle = there_and_back(rate=120) / STEP
    beyond, _ = beyond_smooth(np.round(angle), np.zeros(len(angle)), SETTINGS)
    middle = len(angle) // 2
    assert not beyond[middle - 5 : middle + 5].any()
    assert np.std(beyond[100:1000]) == pytest.approx(1 / 12**0.5, rel=0.1)


@pytest.mark.parametrize("window", [7, 25, 101])
def test_smoothing_is_that_of_the_library(window):
    values = np.random.default_rng(2).normal(0, 1, 300) + np.linspace(0, 40, 300)
    expected = scipy.signal.savgol_filter(values, window, 3)
    np.testing.assert_allclose(smoothed(values, window, 3), expected, atol=1e-9)


def test_regression_by_hand():
    """Two thirds of what was added, and a scatter of 0.1 over four of five rows, each of which adds one."""
    added = np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    error = 2 / 3 * added + np.array([0.1, 0.1, -0.1, -0.1, 5.0])
    share, spread = regression(error, added)
    assert (share, spread) == pytest.approx((2 / 3, 0.05))
    assert regression(error, 0 * added) == (0.0, np.inf)


def table_of(angle, error):
    return pd.DataFrame(
        {
            "time_s": np.arange(len(angle)) / 120,
            "input_angle_deg": np.degrees(STEP * np.round(angle / STEP)),
            "output_angle_deg": np.round(np.degrees(angle / RATIO - error * ARCMIN) * 1200) / 1200,
        }
    )


def test_a_diagnosis_sees_recordings_without_the_steps_of_their_input(monkeypatch):
    angle = there_and_back()
    recording = recording_from_table(table_of(angle, 0.3 * np.sin(2 * angle)), RATIO)
    assert recording.input_step_arcmin == pytest.approx(STEP_ARCMIN)
    assert recording.output_step_arcmin == pytest.approx(0.05)

    class Seen(Exception):
        pass

    def stop(recordings, *about):
        raise Seen(*recordings)

    monkeypatch.setattr(pipeline, "without_output_steps", stop)
    with pytest.raises(Seen) as seen:
        pipeline.gather_evidence([recording], None, 1, DEFAULT)
    (seen,) = seen.value.args
    assert line(seen, 32) < 0.2 * line(recording, 32)


@pytest.mark.parametrize("window", [1, 3, 21, 31])
def test_a_window_holds_where_each_of_it_does(window):
    """As a running minimum, cut off at both ends. Faults caught: a window one short on either side, or beyond an end
    of 30 rows."""
    flags = np.random.default_rng(window).random(30) > 0.1
    expected = scipy.ndimage.minimum_filter1d(flags.astype(np.int8), window) > 0
    np.testing.assert_array_equal(hold_throughout(flags, window), expected)


@pytest.mark.slow
def test_a_drive_behind_a_coarse_input_encoder_has_nothing_hidden():
    """As the bench has it that was named an encoder of 32 lines."""
    study = load_study(drive="csf-25-80")
    angle = there_and_back(turns=45)
    rng = np.random.default_rng(0)
    error = kinematic_error_arcmin(study.drive, study.errors, angle) + rng.normal(0, 0.013, len(angle))
    found = diagnose([recording_from_table(table_of(angle, error), RATIO)], study.drive)
    assert (found.verdict, found.effects) == ("adequate", ())
