"""Measured teeth that lie otherwise, or are not those of the recorded drive, are told, by `inspect` and by what is
compensated.

The record is of a drive whose 162 teeth were drawn once, 3 um each; its table is given as it is, 40 teeth off, with the
other sign, numbered the other way round, as that of another spline, or not at all.
"""

import math
import re
from dataclasses import replace
from functools import cache

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st
from test_compensate import error_of, recorded

from hdopt.drive.teeth import MeasuredTeeth
from hdopt.kinematics.load_sharing import LoadSharing
from hdopt.study import load_study
from hdopt.workflow.acceptance_sheet import TEETH_SHOW
from hdopt.workflow.compensate import LEAVES_MORE, _without_the_model
from hdopt.workflow.compensation_trials import HARMONICS, TEETH
from hdopt.workflow.inspect import inspect
from hdopt.workflow.lying_teeth import MOST_ROWS, Lie, keys_of, stride_of
from hdopt.workflow.waveform_fit import fit_waveform

GIVEN = {"as they are": (0, 1.0), "40 teeth off": (40, 1.0), "the other sign": (0, -1.0)}
PITCH_DEG = 360 / 162


def toothed(shift=0, sign=1.0):
    values = sign * np.roll(np.random.default_rng(2).normal(0, 0.003, 162), shift)
    return replace(load_study(drive="csf-25-80").drive, cs_teeth=MeasuredTeeth.of(values, "single"))


@cache
def record(turns=82, sign=1.0):
    drive = toothed()
    return recorded(lambda theta: sign * error_of(drive, theta), turns)


def words_on_teeth(recordings, drive):
    return [warning for warning in inspect(recordings, drive).warnings if "measured teeth" in warning]


def first_tooth_deg(words, spline="cs_teeth"):
    return float(re.search(rf"\[{spline}\] first_tooth_deg = (\d+\.\d)", words).group(1))


@pytest.mark.parametrize(
    ("turns", "sign", "backwards", "negated", "first_deg"),
    [
        (82, 1.0, False, False, 0.0),
        (82, 1.0, True, True, 111.0),
        (50, -1.0, True, False, 0.0),
        (50, 1.0, False, True, 0.0),
        (82, 1.0, False, False, 47.3),
    ],
)
def test_teeth_that_lie_otherwise_are_told_how(turns, sign, backwards, negated, first_deg):
    """As the drive's own table is given, so it must be laid back. Faults caught: a table mirrored about another tooth,
    an angle counted the other way, one orientation tried alone (without teeth, the wrong one looks clear)."""
    own = toothed().cs_teeth
    # As a file gives them that says neither.
    given = replace(Lie(math.radians(first_deg), backwards, negated).of(own), backwards=False, negated=False)
    words = words_on_teeth([record(turns, sign)], replace(toothed(), cs_teeth=given))
    if not (backwards or negated or first_deg):
        assert not words
        return
    (told,) = words
    assert told.startswith("the measured teeth lie otherwise in the record: ")
    # Half a turn on, both zones change their names.
    assert 0 <= first_tooth_deg(told) <= 180
    assert abs((first_tooth_deg(told) + 90) % 180 - 90) < PITCH_DEG / 3
    assert ('numbered = "counterclockwise"' in told) == backwards
    assert ("sign = -1" in told) == negated
    least = float(re.search("the model leaves ([0-9.]+) arcmin", told).group(1))
    assert least < 0.011  # the record's noise is 0.01


def test_what_is_told_goes_into_the_study_as_it_stands():
    """A drive that has the keys already is told those that it must have. Would catch what is told beside the keys."""
    laid = toothed().cs_teeth.laid(1.0, backwards=True, negated=True)
    assert keys_of(laid) == 'first_tooth_deg = 57.3, numbered = "counterclockwise", sign = -1'
    assert keys_of(Lie(-0.5, backwards=True).of(laid)) == "first_tooth_deg = 331.4, sign = -1"
    assert Lie(laid.first_angle, backwards=True, negated=True).of(laid).deviations == toothed().cs_teeth.deviations


def test_teeth_of_both_splines_are_laid_one_beside_the_other():
    """Fault caught: one round alone, with the teeth of the other spline left out."""
    drive = toothed()
    fs = MeasuredTeeth.of(np.random.default_rng(3).normal(0, 0.003, 160), "single", math.radians(200.0))
    drive = replace(drive, fs_teeth=fs)
    given = replace(
        drive, cs_teeth=toothed(40).cs_teeth, fs_teeth=replace(Lie(0.0, negated=True).of(fs), negated=False)
    )
    (told,) = words_on_teeth([recorded(lambda theta: error_of(drive, theta), 82)], given)
    cs, fs = first_tooth_deg(told), first_tooth_deg(told, "fs_teeth")
    assert cs == pytest.approx(180 - 40 * PITCH_DEG, abs=PITCH_DEG)
    assert fs == pytest.approx(20.0, abs=PITCH_DEG)
    assert told.count("sign = -1") == 1


@pytest.mark.parametrize("turns", [82, 30])
def test_teeth_of_another_spline_hardly_show(turns):
    """No lie of theirs is claimed, in a short record either. Faults caught: the share turned round, a lie that leaves a
    little less taken for the right one."""
    values = np.random.default_rng(9).normal(0, 0.003, 162)
    (told,) = words_on_teeth([record(turns)], replace(toothed(), cs_teeth=MeasuredTeeth.of(values, "single")))
    assert told.startswith("the measured teeth hardly show in the record: ")
    assert "orientation" in told
    assert not words_on_teeth([record(turns)], replace(toothed(), cs_teeth=None))


@pytest.mark.parametrize(
    ("rows", "per_turn"), [(80_000, 400.0), (6560, 80.0), (3000, 80.0), (100_000, 360.2), (90_000, 1.0), (20_000, 0.3)]
)
def test_few_rows_of_a_long_record_see_all_of_a_turn(rows, per_turn):
    """Would catch 20 rows a turn of 400, always the same: an eighth of 162 teeth."""
    taken = np.arange(0, rows, stride_of(rows, per_turn))
    assert min(rows, MOST_ROWS) / 2 < len(taken) <= MOST_ROWS
    assert len(np.unique(taken % max(round(per_turn), 1))) == max(round(per_turn), 1)


@hypothesis.settings(max_examples=30)
@hypothesis.given(
    st.lists(st.floats(-0.01, 0.01), min_size=8, max_size=30), st.floats(0, 7), st.booleans(), st.booleans()
)
def test_a_lie_is_the_table_turned_mirrored_and_negated(values, first, backwards, negated):
    """Of what the teeth in contact make of it, at any place of the spline."""
    sharing, own = LoadSharing(2.0), MeasuredTeeth(tuple(values), 1.0)
    places = 12 * len(values)
    lain = sharing.table(Lie(first, backwards, negated).of(own))
    at = np.arange(places) * (2 * math.pi / places)
    # Where tooth 1 stands the lain table has what the given one has at its own first tooth.
    came_from = 1.0 + (-1.0 if backwards else 1.0) * (at - first)
    again = sharing.table(replace(own, first_angle=0.0))
    nearest = np.interp(
        np.mod((came_from - 1.0) / (2 * math.pi), 1.0) * places, np.arange(places + 1), [*again, again[0]]
    )
    assert lain == pytest.approx((-1.0 if negated else 1.0) * nearest, abs=3 * np.abs(np.diff(again)).max() + 1e-12)


def test_right_teeth_beside_something_else_are_left_in_peace():
    """The model leaves more than noise, for a wave that it has not. Would catch a fit without teeth that has them."""
    drive = toothed()
    found = inspect([recorded(lambda theta: error_of(drive, theta) + 0.07 * np.sin(7.3 * theta), 82)], drive)
    assert any("the model leaves" in warning for warning in found.warnings)
    assert not any("measured teeth" in warning for warning in found.warnings)


def test_how_much_wrong_teeth_leave():
    """The figures that the threshold stands on: 0.95 and 0.99, right teeth a tenth of it."""
    without = fit_waveform([record(162)], replace(toothed(), cs_teeth=None)).rms_arcmin
    share = {name: fit_waveform([record(162)], toothed(*how)).rms_arcmin / without for name, how in GIVEN.items()}
    assert share["as they are"] < 0.15
    assert TEETH_SHOW < share["40 teeth off"] == pytest.approx(0.95, abs=0.02)
    assert TEETH_SHOW < share["the other sign"] == pytest.approx(0.99, abs=0.02)


@pytest.mark.parametrize(("turns", "said"), [(30, "cover more of the beat"), (82, "a beat is covered")])
def test_an_open_orientation_says_what_would_decide_it(turns, said):
    """A drive without errors looks alike either way, however long it is recorded."""
    found = inspect([recorded(lambda theta: 0.0 * theta, turns)], load_study(drive="csf-25-80").drive)
    assert "not decided by this record" in found.checks["orientation"]
    assert said in found.checks["orientation"]


@pytest.mark.parametrize(
    ("method", "model", "teeth", "told"),
    [
        (HARMONICS, 0.5, 0.3, True),
        (HARMONICS, 0.5, 0.11, False),
        (TEETH, 0.5, 0.3, False),
        (HARMONICS, None, None, False),
    ],
)
def test_a_compensation_without_the_model_says_so(method, model, teeth, told):
    """Where the drive's model leaves more, in its best form, than harmonics alone. Faults caught: its worst form, a
    word where it is in, or where no drive was given."""
    signs = np.resize([1.0, -1.0], 100)
    trials = {HARMONICS: 0.1 * signs}
    if model is not None:
        trials |= {"model": model * signs, TEETH: teeth * signs}
    found = _without_the_model(method, trials)
    assert bool(found) == told
    assert 0.11 < LEAVES_MORE * 0.1 < 0.3
    assert all("0.3 arcmin rms" in warning and "0.1" in warning for warning in found)
