"""Measured teeth that are not those of the recorded drive are told, by `inspect` and by what is compensated.

The record is of a drive whose 162 teeth were drawn once, 3 um each; its table is given as it is, 40 teeth off, with the
other sign, or not at all.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from test_compensate import error_of, recorded

from hdopt.drive.teeth import MeasuredTeeth
from hdopt.study import load_study
from hdopt.workflow.acceptance_sheet import TEETH_SHOW
from hdopt.workflow.compensate import LEAVES_MORE, _without_the_model
from hdopt.workflow.compensation_trials import HARMONICS, TEETH
from hdopt.workflow.inspect import inspect
from hdopt.workflow.waveform_fit import fit_waveform

GIVEN = {"as they are": (0, 1.0), "40 teeth off": (40, 1.0), "the other sign": (0, -1.0)}


def toothed(shift=0, sign=1.0):
    values = sign * np.roll(np.random.default_rng(2).normal(0, 0.003, 162), shift)
    return replace(load_study(drive="csf-25-80").drive, cs_teeth=MeasuredTeeth.of(values, "single"))


@cache
def record(turns=82):
    drive = toothed()
    return recorded(lambda theta: error_of(drive, theta), turns)


@pytest.mark.parametrize("given", GIVEN)
def test_teeth_that_hardly_show_are_told(given):
    """Faults caught: the share turned round, no word on what to check."""
    found = inspect([record()], toothed(*GIVEN[given]))
    told = [warning for warning in found.warnings if "measured teeth hardly show" in warning]
    assert bool(told) == (given != "as they are")
    assert all("first_tooth_deg" in warning and "orientation" in warning for warning in told)
    untold = inspect([record()], replace(toothed(), cs_teeth=None))
    assert not any("measured teeth" in warning for warning in untold.warnings)


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
