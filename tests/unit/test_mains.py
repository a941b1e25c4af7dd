"""Hum of the mains: found at either frequency and nowhere else, and said instead of an encoder that fits as well."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_effect_physics import RATE, RATIO, TURN, moving
from test_windup_curves import fit_of

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.alternatives import AnyFrequency, Mains
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.penalty import Scale, penalty
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict.named_effect import chance_right
from hdopt.diagnosis.verdict.residual_structure import in_what_way
from hdopt.effects import EFFECTS
from hdopt.recordings.read import Recording

SPEED = 22.0
"""rad/s; 3.5 turns a second of 120 rows: their rate holds 208 Hz."""
FAST = moving((30, 30), time=np.arange(60 * RATE) * TURN / RATE / SPEED)
CLOCK = FAST.time


SHORT = moving((3, 3), time=np.arange(6 * RATE) * TURN / RATE / SPEED)
"""1.7 s: lines 0.6 Hz apart, three times the tolerance, cannot be told."""
TWICE = replace(FAST, record=np.repeat([0, 1], 30 * RATE), time=np.r_[CLOCK[: 30 * RATE], CLOCK[: 30 * RATE]])
"""Two recordings, each with a clock that begins at 0."""


def hum(hz, third=0.0, clock=CLOCK):
    return 0.1 * np.cos(TURN * hz * clock + 0.7) + third * np.sin(TURN * 3 * hz * clock)


def offered(signal, record=FAST):
    return Mains().search(FitProbe(refine(fit_of(record, signal), 2)))


@pytest.mark.parametrize("hz", [49.91, 50.0, 50.03, 50.09, 59.9, 60.1])
@pytest.mark.parametrize("third", [0.0, 0.05, 3.0])
def test_hum_is_found_within_the_tolerance_of_either_mains(hz, third):
    """A fit from what is offered leaves a hundredth and says its frequency. Would catch one mains for both, a triple
    left out or looked for elsewhere, and a grid with gaps."""
    signal = hum(hz, third)
    fits = [refine(fit_of(FAST, signal, [term]), 12) for term in offered(signal)]
    best = min(fits, key=lambda fit: np.std(fit.residual))
    assert np.std(best.residual) < 0.01 * np.std(signal)
    assert best.terms[0].shape["frequency_hz"] == pytest.approx(hz, abs=1e-3)


def test_hum_of_a_short_recording_is_found():
    """Would catch a grid without two places."""
    signal = hum(50.04, clock=SHORT.time)
    left = [np.std(refine(fit_of(SHORT, signal, [term]), 12).residual) for term in offered(signal, SHORT)]
    assert min(left) < 0.02 * np.std(signal)


def test_hum_has_a_phase_in_each_recording():
    """Opposite ones too, whose powers add up. Would catch a phase for both, and waves that are added before their
    power."""
    signal = np.where(TWICE.record == 0, 1, -1) * hum(50.06, 0.05, clock=TWICE.time)
    fits = [refine(fit_of(TWICE, signal, [term]), 12) for term in offered(signal, TWICE)]
    assert min(np.std(fit.residual) for fit in fits) < 0.01 * np.std(signal)


def test_hours_of_rows_are_looked_at_in_little_memory():
    """Two hours of 250 rows a second: a table of places by cells would take gigabytes."""
    rows = 2 * 3600 * 250
    clock = np.arange(rows) / 250
    long = SimpleNamespace(known_time=clock, record=np.zeros(rows, np.int64), records=1)
    tracemalloc.start()
    off, power = Mains()._spectrum(long, hum(50.0313, clock=clock), 50.0, 1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 50 + off[np.argmax(power[0])] == pytest.approx(50.0313, abs=1e-4)
    assert peak < 20 * 8 * rows


@pytest.mark.parametrize("hz", [49.0, 51.0, 55.0, 61.0])
def test_a_line_beside_the_mains_is_none_of_theirs(hz):
    """17 s tell lines apart that are 0.06 Hz from each other. Would catch a tolerance of per cents."""
    signal = hum(hz)
    left = [np.std(refine(fit_of(FAST, signal, [term]), 12).residual) for term in offered(signal)]
    assert min(left) > 0.9 * np.std(signal)


@pytest.mark.parametrize(("asked", "kept"), [(53.0, 50.1), (48.0, 49.9), (57.0, 59.88), (60.05, 60.05)])
def test_hum_keeps_to_the_tolerance_of_the_nearer_mains(asked, kept):
    """Would catch a frequency that a fit may move anywhere."""
    term = Mains().term(FAST, {"frequency_hz": asked, "multiples": 1.0})
    assert term.shape["frequency_hz"] == pytest.approx(kept)


def test_hum_is_looked_for_only_where_rows_hold_it(monkeypatch):
    """Rows at 2 rad/s hold 19 Hz; at 8 rad/s the mains of either frequency, and not their triple."""
    assert offered(np.zeros(18 * RATE), moving()) == []
    slower, tried, term = replace(FAST, time=CLOCK * SPEED / 8), [], Mains.term
    monkeypatch.setattr(Mains, "term", lambda own, rows, shape: tried.append(shape) or term(own, rows, shape))
    offered(hum(50, clock=slower.time), slower)
    assert {shape["multiples"] for shape in tried} == {1.0}
    assert {round(shape["frequency_hz"], -1) for shape in tried} == {50, 60}
    assert Mains().lacks(replace(FAST, time=None)) and Mains().lacks(moving(locked=True))
    assert Mains().lacks(FAST) is None


def test_hum_is_the_likelier_of_two_lines_at_its_place():
    """It pays neither for a search over all frequencies nor for being doubtful: at its frequency no chance puts a line,
    and an encoder that happens to have its order there pays for all its numbers of lines."""
    signal = hum(50)
    scale = Scale(rows=float(len(CLOCK)))
    mains, any_line, encoder = (
        refine(fit_of(FAST, signal, [term]), 12).terms
        for term in (
            offered(signal)[0],
            AnyFrequency().search(FitProbe(refine(fit_of(FAST, signal), 2)))[0],
            EFFECTS["encoder_interpolation"].search(FitProbe(refine(fit_of(FAST, hum(50)), 2)))[0],
        )
    )
    gain = 1000.0
    assert penalty(mains, gain, scale) < penalty(any_line, gain, scale) - 0.04 * gain
    assert penalty(mains, gain, scale) < penalty(encoder, gain, scale)


def there_and_back(lines, noise, seed):
    """A recording of a gear without a model, 40 turns forward and back at one speed, with hum at exactly the order of
    an output encoder of `lines` lines, as a cosine about the reversal: both fit it to the last digit."""
    rng = np.random.default_rng(seed)
    there = np.arange(40 * RATE) * TURN / RATE
    theta = np.r_[there, there[::-1]]
    time = np.arange(len(theta)) * TURN / RATE * lines / RATIO / 50 / TURN
    middle = (time[len(there) - 1] + time[len(there)]) / 2
    error = 0.05 * np.cos(TURN * 50 * (time - middle)) + rng.normal(0, noise, len(theta))
    return Recording("hum", RATIO, theta, error, time=time)


def test_hum_at_the_order_of_an_encoder_is_not_called_one():
    """At one speed both explain all; that one of them is at 50 Hz is no chance, and the answer says so."""
    found = diagnose([there_and_back(473, 0.02, 3)], None, RATIO)
    assert found.verdict == "unknown"
    assert found.where["period_s"] == pytest.approx(1 / 50, rel=1e-4)
    assert found.where["rms_arcmin"] == pytest.approx(0.05 / np.sqrt(2), rel=0.02)
    assert "between its 473 lines" in found.says and "hum of the mains, 50 Hz" in found.says
    assert "another speed" in found.separating_test


def test_hum_of_two_speeds_is_located_in_time():
    """At a second speed it has another order than any encoder: nothing is named."""
    slow, fast = there_and_back(473, 0.02, 3), there_and_back(611, 0.02, 4)
    found = diagnose([slow, fast], None, RATIO)
    assert (found.verdict, found.effects) == ("unknown", ())
    assert "a hum of 50 Hz as of the mains" in found.says


def test_an_encoder_away_from_the_mains_is_named_as_surely_as_such_names_were_right():
    """The same at 37 Hz. Faults caught: any line in time for hum, and a confidence of all that was weighed."""
    hummed = there_and_back(473, 0.02, 3)
    found = diagnose([replace(hummed, time=hummed.time * 50 / 37)], None, RATIO)
    assert (found.verdict, [one.id for one in found.effects]) == ("named", ["encoder_interpolation"])
    fit = found.to_dict()["fit"]
    right = chance_right(1, fit["heldout_rms_extended_arcmin"] / fit["noise_floor_arcmin"], DEFAULT.verdict)
    assert found.effects[0].confidence == pytest.approx(right * (1 - fit["false_alarm_p"]), rel=1e-3)


def test_a_slow_wave_is_no_hum():
    """Would catch a slow wave's period said as a frequency."""
    where = {"domain": "time", "orders_per_input_turn": [], "direction": "both", "period_s": 0.4}
    where |= {"share_of_residual": 1.0, "rms_arcmin": 0.1}
    assert in_what_way(where) == ", a wave of 0.4 s"
