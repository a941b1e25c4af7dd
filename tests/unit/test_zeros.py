"""Recordings of which some were counted from zero again: what hangs on the output is met where it stood."""

from dataclasses import replace

import numpy as np
import pytest

from hdopt.diagnosis.inference.zeros import freed_of_zeros
from hdopt.diagnosis.orientation import turn_round
from hdopt.diagnosis.settings import DEFAULT
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import gather

RATIO, FROM_ZERO = 30.0, 640.0
SETTINGS = DEFAULT.nuisance
INPUT = np.linspace(3.0, 80.0, 500)
ERROR = 0.3 * np.sin(INPUT)


def recorded(zero, physics=0.0):
    return Recording("one", RATIO, INPUT, ERROR + zero + physics)


def off_in_arcmin(one):
    """How far the output of a recording stands from where the ratio has it, without its error, arcmin."""
    return np.degrees(one.output_angle - INPUT / RATIO) * 60 + ERROR - np.median(ERROR)


def test_outputs_are_counted_from_one_place():
    """Faults caught: an output that was counted from zero again taken for one that had turned: of 2048 lines each
    recording had its own phase, and their sum over both was nil; the zeros of all recordings, the first as well, or of
    none, taken out; the error, in which zeros are free, changed too."""
    first, other = freed_of_zeros([recorded(FROM_ZERO), recorded(-FROM_ZERO)], SETTINGS)
    assert off_in_arcmin(first) == pytest.approx(0.0, abs=1e-9)
    assert off_in_arcmin(other) == pytest.approx(0.0, abs=1e-9)
    assert np.median(first.error_arcmin) == pytest.approx(0.0, abs=1e-9)
    assert np.median(other.error_arcmin) == pytest.approx(-2 * FROM_ZERO)
    rows = gather([first, other])
    assert np.ptp(rows.output - rows.theta / RATIO) < np.radians(0.7 / 60)


@pytest.mark.parametrize("apart", [0.0, SETTINGS.shared_zero_arcmin - 0.01])
def test_where_no_zero_was_set_anew_the_output_is_read(apart):
    """What a load or the warmth turns it by is motion. Fault caught: any difference taken for a zero."""
    first, other = freed_of_zeros([recorded(FROM_ZERO), recorded(FROM_ZERO, apart)], SETTINGS)
    assert (first.output_zero_arcmin, other.output_zero_arcmin) == (0.0, 0.0)
    assert off_in_arcmin(other) == pytest.approx(-apart, abs=1e-9)


def test_hidden_samples_say_nothing_of_a_zero():
    """Fault caught: a diagnosis of a part that learns of the rest by its median."""
    hidden = INPUT > 30.0
    error = recorded(0.0).error_arcmin + np.where(hidden, 99.0, 0.0)
    first = replace(recorded(0.0), error_arcmin=error)
    found = freed_of_zeros([first, recorded(FROM_ZERO)], SETTINGS, [hidden, np.zeros(len(INPUT), bool)])
    assert np.median(found[0].error_arcmin[~hidden]) == pytest.approx(0.0, abs=1e-9)
    seen = replace(recorded(0.0), input_angle=INPUT[~hidden], error_arcmin=error[~hidden])
    without = freed_of_zeros([seen, recorded(FROM_ZERO)], SETTINGS)
    assert [one.output_zero_arcmin for one in found] == [one.output_zero_arcmin for one in without]


def test_turned_round_an_output_stands_where_it_stood():
    """Fault caught: a zero that keeps its sign where the error changes it."""
    for one in freed_of_zeros([recorded(FROM_ZERO), recorded(-FROM_ZERO)], SETTINGS):
        (turned,) = turn_round([one])
        assert turned.output_angle == pytest.approx(-one.output_angle)
