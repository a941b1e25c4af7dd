"""Descriptions without physics: each finds its own and nothing that it is not; the generic basis spans what it says."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.ndimage
from test_effect_physics import RATE, RATIO, TURN, moving
from test_windup_curves import fit_of

from hdopt.diagnosis.alternatives import alternatives, in_time
from hdopt.diagnosis.alternatives.in_time import strongest_frequencies
from hdopt.diagnosis.alternatives.late import lagging, longest_recording
from hdopt.diagnosis.alternatives.moments import smoothed
from hdopt.diagnosis.inference.base_excitation import motion_of
from hdopt.diagnosis.inference.change_points import find_steps
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.generic_basis import generic_columns
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.settings import DEFAULT
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.term import Term

ONES = {one.id: one for one in alternatives(DEFAULT.alternatives)}
ROWS = 20 * RATE
LEVELS = np.repeat([2.0, 3.0, 5.0], [6 * RATE, 8 * RATE, 6 * RATE])
"""Three speeds: of two any function is one of their squares."""
RECORD = moving(
    (8, 6, 6),
    speed=LEVELS * np.repeat([1.0, -1.0, 1.0], [8 * RATE, 6 * RATE, 6 * RATE]),
    time=np.cumsum(TURN / RATE / LEVELS),
    record=np.repeat([0, 1], [12 * RATE, 8 * RATE]),
)
T, AT = RECORD.theta, np.arange(ROWS)
CLOCK = RECORD.time - RECORD.time[0]
TORQUE, SPEED = RECORD.torque / np.max(np.abs(RECORD.torque)), np.abs(RECORD.speed) / 5.0
ALONG = np.linspace(-1, 1, ROWS)
NOISE = np.random.default_rng(6).normal(0, 1e-3, ROWS)
"""What a step stands out of: without any, nothing is usual."""


def answering(target, lag):
    """What follows a `target` with a `lag` (s), row by row, from rest at the start of either recording of RECORD."""
    found = np.zeros(ROWS)
    for row in range(1, ROWS):
        if RECORD.record[row] == RECORD.record[row - 1]:
            keep = np.exp(-(RECORD.time[row] - RECORD.time[row - 1]) / lag)
            found[row] = keep * found[row - 1] + (1 - keep) * target[row]
    return found


SIGNALS = {
    "_sine_in_angle": [
        0.3 * np.sin(5.37 * T + 0.4),
        0.3 * np.sin(7.41 * T) + 0.1 * np.cos(6.91 * T) + 0.2 * np.sin(7.91 * T),
    ],
    "_sine_in_time": [0.2 * np.cos(TURN * 1.37 * CLOCK + 1.0), 0.4 * np.sin(TURN * 0.7 / CLOCK[-1] * CLOCK)],
    "_jump": [NOISE + 0.5 * (AT >= 731), NOISE + 0.5 * (AT >= 400) - 0.8 * (AT >= 1500)],
    "_bump": [0.4 * np.exp(-0.5 * ((AT - 900) / 40) ** 2)],
    "_changing_order": [0.2 * ALONG * np.sin(3 * T + 0.2), 0.2 * ALONG * np.cos(2 * (1 + 1 / RATIO) * T)],
    "_even_in_torque": [
        0.2 * np.abs(TORQUE),
        0.2 * TORQUE**2,
        0.3 * TORQUE * np.sin(T + 0.5),
        0.3 * TORQUE * np.cos(2 * T + 0.5),
    ],
    "_late_in_torque": [0.3 * answering(TORQUE, 1.9), 0.3 * answering(TORQUE, 0.5)],
    "_torque_in_motion": [
        0.2 * load * motion
        for load in (TORQUE, np.abs(TORQUE))
        for motion in (RECORD.direction, RECORD.speed / 5.0, SPEED)
    ],
    "_even_in_speed": [0.3 * SPEED, 0.3 * SPEED**2, 0.3 * answering(SPEED, 1.9), 0.3 * answering(SPEED**2, 0.7)],
    "_scale": [1e-5 * T / ARCMIN],
    "_skew": [3e-5 * CLOCK * RECORD.speed / RATIO / ARCMIN],
    "_zero": [0.4 * (RECORD.record == 1)],
}


def test_every_description_but_that_of_the_drive_is_asked():
    """A contact that varies follows the drive's own motion, mains want faster rows: both have tests of their own."""
    assert set(SIGNALS) | {"_varying_contact", "_mains"} == set(ONES)


@pytest.mark.parametrize("reach", [1, 9, 40])
def test_a_bump_is_looked_for_by_the_sums_of_all_neighbours(reach):
    """As the library has them that goes through each, also where the kernel is longer than the record."""
    values = np.random.default_rng(reach).normal(size=50)
    kernel = np.exp(-((np.arange(-reach, reach + 1) / reach) ** 2))
    expected = scipy.ndimage.convolve1d(values, kernel, mode="constant")
    np.testing.assert_allclose(smoothed(values, kernel), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "signal"), [pytest.param(n, s, id=f"{n}-{i}") for n, own in SIGNALS.items() for i, s in enumerate(own)]
)
def test_a_description_finds_its_own(name, signal):
    """A fit from what its search offers leaves a hundredth. Would catch a power, wave or form that is not offered, an
    angle for a time, and a grid that leaves out its ends."""
    one = ONES[name]
    assert one.lacks(RECORD) is None
    offered = one.search(FitProbe(refine(fit_of(RECORD, signal), 2)))
    left = [np.std(refine(fit_of(RECORD, signal, [term]), 12).residual) for term in offered]
    assert min(left) < 0.01 * np.std(signal)


def test_what_answers_speed_late_answers_it_in_the_end():
    """Of a jump of the speed 63 % is there after the lag, at any row rate; a fit keeps it within a hundredth of a
    recording and the whole. Faults caught: a lag counted in rows, or over both recordings; one that starts where the
    last recording ended."""
    lag = 0.5
    found = lagging(RECORD, np.ones(ROWS), lag)
    for record in (0, 1):
        own = RECORD.record == record
        since = RECORD.time[own] - RECORD.time[own][0]
        np.testing.assert_allclose(found[own], 1 - np.exp(-since / lag), atol=1e-12)
    one, longest = ONES["_even_in_speed"], longest_recording(RECORD)
    assert longest == pytest.approx(max(np.ptp(RECORD.time[RECORD.record == record]) for record in (0, 1)))
    for asked, kept in ((1e-9, 0.01 * longest), (1e9, longest)):
        term = one.term(RECORD, {"power": 1.0, "lag_s": asked})
        assert term.shape["lag_s"] == pytest.approx(kept)
        assert np.isfinite(term.columns).all()
    plain = one.term(RECORD, {"power": 1.0})
    assert term.trials == len(DEFAULT.alternatives.lags) * plain.trials
    assert not plain.steps


@pytest.mark.parametrize("lag", [0.7, 1.9, 5.0])
def test_what_answers_torque_late_is_offered_near_its_lag(lag):
    """Within the factor of 2^(1/2) that lies between two lags that are tried. Fault caught: one lag is tried, from
    which a fit has far to go."""
    offered = ONES["_late_in_torque"].search(FitProbe(refine(fit_of(RECORD, 0.3 * answering(TORQUE, lag)), 2)))
    assert min(abs(np.log2(term.shape["lag_s"] / lag)) for term in offered) < 0.55


def test_load_in_motion_pays_for_the_products_that_the_record_shows():
    """Torque and its size times direction, speed and its size; in one direction a speed has no sign, and at one speed
    it is the direction."""
    one, shape = ONES["_torque_in_motion"], {"load": 0.0, "motion": 0.0}
    there = moving((18,), speed=LEVELS_OF_WHOLE)
    for record, products in ((RECORD, 6), (there, 2), (WHOLE, 2)):
        assert one.term(record, shape).trials == products
        assert one.lacks(record) is None


def test_without_a_clock_speed_is_answered_at_once():
    record = replace(RECORD, time=None)
    offered = ONES["_even_in_speed"].search(FitProbe(refine(fit_of(record, SIGNALS["_even_in_speed"][0]), 2)))
    assert [sorted(term.shape) for term in offered] == [["power"]]


@pytest.mark.parametrize("name", SIGNALS)
def test_what_competes_with_the_catalogue_pays_odds(name):
    """An effect of equal fit goes before it: log prior odds below none."""
    offered = ONES[name].search(FitProbe(refine(fit_of(RECORD, SIGNALS[name][0]), 2)))
    assert all(term.odds < 0 for term in offered)


WHOLE = moving()
LEVELS_OF_WHOLE = np.repeat([2.0, 3.0, 5.0], 6 * RATE)
LOCKED = moving(locked=True, theta=np.zeros(18 * RATE))


@pytest.mark.parametrize(
    ("name", "lacking"),
    [
        ("_sine_in_angle", moving((3,))),
        ("_sine_in_time", moving(time=None)),
        ("_sine_in_time", LOCKED),
        ("_jump", LOCKED),
        ("_jump", moving(output_step=0.1)),
        ("_bump", moving(output_step=0.1)),
        ("_changing_order", moving((3,))),
        ("_even_in_torque", moving(torque=None)),
        ("_even_in_torque", moving(torque=np.full(18 * RATE, 5.0))),
        ("_late_in_torque", moving(torque=None)),
        ("_late_in_torque", moving(time=None)),
        ("_torque_in_motion", moving(torque=None, speed=LEVELS_OF_WHOLE)),
        ("_torque_in_motion", moving((18,), speed=np.full(18 * RATE, 2.0))),
        ("_torque_in_motion", LOCKED),
        ("_even_in_speed", WHOLE),
        ("_even_in_speed", moving(speed=None)),
        ("_scale", moving((1,))),
        ("_scale", LOCKED),
        ("_skew", moving(speed=np.full(18 * RATE, 2.0))),
        ("_skew", moving(time=None, speed=None)),
        ("_zero", WHOLE),
        ("_varying_contact", moving((3,))),
    ],
)
def test_a_description_is_not_asked_of_a_record_that_cannot_show_it(name, lacking):
    """A speed of both signs and one size is no speed that varies for what is even in it."""
    assert ONES[name].lacks(lacking)
    assert ONES[name].lacks(RECORD) is None


def test_a_contact_varies_by_half_at_most():
    """Of k_e: the largest share of any wave."""
    term = Term("_varying_contact", {"waves": 1.0}, columns=np.ones((3, 2)))
    for share, shows in ((0.45, True), (0.55, False)):
        estimate = FitEstimate(np.array([0.1, -share]), np.eye(2) * 1e-6)
        assert ONES["_varying_contact"].every_part_shows(term, estimate) == shows


def test_a_contact_that_varies_makes_the_drives_motion_larger_and_smaller():
    motion = np.sin(2 * T + 0.3)
    term = ONES["_varying_contact"].term(RECORD, {"waves": 2.0}, motion)
    wanted = [np.sin(T), np.cos(T), np.sin(2 * T), np.cos(2 * T)]
    assert np.allclose(term.columns, motion[:, None] * np.column_stack(wanted), atol=1e-9)
    added = ONES["_varying_contact"].response(RECORD, term.shape, np.array([0.1, 0.2, 0.3, 0.4]), motion[:, None])
    assert np.allclose(added[:, 0], term.columns @ [0.1, 0.2, 0.3, 0.4])


def test_a_jump_at_a_reversal_is_doubtful():
    """Within half an input turn, 60 rows, of a reversal (rows 960 and 1680) or of a recording's start (1440)."""
    for row, doubtful in ((960 + 50, True), (1680 - 50, True), (1440 + 50, True), (960 + 70, False), (1300, False)):
        assert ONES["_jump"].term(RECORD, {"row": float(row)}).doubtful == doubtful


def test_frequencies_of_a_record_in_its_own_time():
    """Three lines in Hz, the strongest first, each to a fraction of the record's resolution; rows a quarter lost."""
    seen = np.sort(np.random.default_rng(4).permutation(18 * RATE)[: 13 * RATE])
    rows = replace(WHOLE, **{k: getattr(WHOLE, k)[seen] for k in ("theta", "time", "piece", "record", "direction")})
    clock = rows.time
    lines = {2.0: 3.11, 1.0: 0.83, 0.5: 6.5}
    residual = 5.0 + sum(size * np.cos(TURN * f * clock + size) for size, f in lines.items())
    found = strongest_frequencies(rows, residual, DEFAULT.alternatives)
    assert found == pytest.approx(list(lines.values()), abs=0.3 / np.ptp(clock))


def test_waves_slower_than_the_record_shows_are_asked_in_time(monkeypatch):
    """From 0.35 waves a record on: below 0.4 the transform has none, and a fit does not begin by itself."""
    asked = []
    monkeypatch.setattr(in_time, "best_terms", lambda probe, terms, most=1: asked.extend(terms) or [])
    ONES["_sine_in_time"].search(FitProbe(fit_of(RECORD, np.sin(9 * CLOCK))))
    waves = [term.shape["frequency_hz"] * CLOCK[-1] for term in asked]
    assert all(any(abs(wave - slow) < 1e-9 for wave in waves) for slow in (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8))


# the generic basis


BASIS = moving((44, 12, 8), speed=np.repeat([2.0, -3.0, 3.0], [44 * RATE, 12 * RATE, 8 * RATE]))
LONG = np.arange(64 * RATE)
UNDER = {
    "integer order": lambda c: np.sin(11 * c.theta + 0.3) + np.cos(c.theta),
    "output order": lambda c: np.cos(4 * c.theta / RATIO + 0.1) + np.sin(c.theta / RATIO),
    "output-synchronous order": lambda c: sum(
        np.sin(order * c.theta + 0.2) for order in (1 - 1 / RATIO, 1 + 1 / RATIO, 3 - 1 / RATIO, 3 + 3 / RATIO)
    ),
    "time": lambda c: (c.time - 20.0) ** 4 + c.time,
    "torque": lambda c: (
        c.torque**4
        - 3 * c.torque**3
        + 100 * c.torque * (np.cos(2 * c.theta + 0.4) + c.direction)
        - 40 * c.torque * c.speed
    ),
    "temperature": lambda c: c.temperature**2 - c.temperature,
    "speed": lambda c: c.speed + np.abs(c.speed) * (np.cos(4 * c.theta) + np.sin(2 * c.theta) + np.sin(c.theta)),
    "direction": lambda c: c.direction * (1 + np.sin(c.theta) + np.cos(2 * c.theta)),
    "reversal": lambda c: np.where(c.first, 0.0, c.direction * np.exp(-c.travel / (0.02 * c.travel.max()))),
}


@pytest.mark.parametrize("domain", UNDER)
def test_the_generic_basis_spans_what_each_domain_may_do(domain):
    """From the columns of that domain alone (and a constant), to rounding. Would catch a degree, a side or a wave that
    is missing, and a column under another domain's name."""
    columns, domains = generic_columns(rows_of(BASIS))
    own = np.column_stack([np.ones(len(LONG)), columns[:, [d == domain for d in domains]]])
    signal = UNDER[domain](BASIS)
    left = signal - own @ np.linalg.lstsq(own, signal, rcond=None)[0]
    assert np.std(left) < 1e-6 * np.std(signal)


def rows_of(conditions):
    return fit_of(conditions, np.zeros(len(conditions))).problem.rows


def test_the_generic_basis_has_no_more_columns_than_it_says():
    """Twelve whole orders; four of the output; k -+ 1/N and k (1 + 1/N) of four; degrees 4, 4 and 2; torque with two
    orders, the direction and the speed; speed by degree 3 and three orders; direction with two, and three lengths. Less
    gives nothing."""
    counts = {
        "integer order": 24,
        "output order": 8,
        "output-synchronous order": 22,  # 1 (1 + 1/N) is 1 + 1/N
        "time": 4,
        "torque": 10,
        "temperature": 2,
        "speed": 9,
        "direction": 5,
        "reversal": 3,
    }
    _, domains = generic_columns(rows_of(BASIS))
    assert {domain: domains.count(domain) for domain in counts} == counts
    assert len(domains) == sum(counts.values())
    bare = moving((8,), time=None, speed=None, torque=None, temperature=None)
    assert set(generic_columns(rows_of(bare))[1]) == {"integer order"}


def test_a_locked_input_has_no_orders():
    _, domains = generic_columns(rows_of(replace(LOCKED, speed=None)))
    counts = {"time": 4, "torque": 4, "temperature": 2, "direction": 1, "reversal": 3}
    assert {domain: domains.count(domain) for domain in domains} == counts


# motion and steps


def test_the_motion_before_the_spring_is_the_base_and_what_excites():
    """Waves of a bearing move the output; an encoder's error does not, and neither does what acts inside the zones
    again."""
    base = np.cos(2 * T)
    bearing = Term("bearing_pass", {"lines": (0,)}, columns=np.column_stack([np.sin(3 * T), np.cos(3 * T)]))
    encoder = Term("encoder_input_eccentricity", {}, columns=np.sin(T)[:, None])
    found = motion_of(base, [bearing, encoder], [np.array([0.2, 0.1]), np.array([5.0])])
    assert np.allclose(found, base + 0.2 * np.sin(3 * T) + 0.1 * np.cos(3 * T))


def test_the_clearest_step_is_the_one_that_stands_out_most_of_its_own_scatter():
    """A step of 3 among noise of 0.1 is found before one of 1; the residual is without both, to the noise of the means
    of 216 rows on either side."""
    noise = np.random.default_rng(8).normal(0, 0.1, 3000)
    at = np.arange(3000)
    rows, left = find_steps(noise + 1.0 * (at >= 700) + 3.0 * (at >= 2100), most=2)
    assert rows == [2100, 700]
    assert np.abs(left - left.mean() - (noise - noise.mean())).max() < 0.1


def test_no_motion_no_description_of_a_contact():
    with pytest.raises(ValueError, match="follows the drive's motion"):
        ONES["_varying_contact"].term(RECORD, {"waves": 1.0})
    probe = SimpleNamespace(samples=RECORD, motion=None)
    with pytest.raises(ValueError, match="follows the drive's motion"):
        ONES["_varying_contact"].search(probe)
