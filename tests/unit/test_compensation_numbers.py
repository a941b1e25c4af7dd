"""What a compensation is worth, what it expects and how its return error crosses, number by number."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.compensation.applied import crosses, crossing_deg
from hdopt.compensation.path import crossing_of, half_about, half_return, path_of, paths_of
from hdopt.compensation.pursuit import independent_share
from hdopt.compensation.surface import AT_ONCE, Crossing, Harmonics, grid_angles, nothing, surface_of
from hdopt.compensation.writers import homing_arcmin
from hdopt.compensation.zones import zone_values
from hdopt.workflow.compensate import _per_recording, _predicted, _worth

RATIO = 50.0


def there_and_back(turns=4, rate=200, records=1):
    """Rows of a motion there, back and there again, in each of so many recordings."""
    ramp = np.arange(turns * rate) * 2 * np.pi / rate
    theta = np.tile(np.r_[ramp, ramp[::-1], ramp], records)
    way = np.tile(np.repeat([1.0, -1.0, 1.0], len(ramp)), records)
    travel = np.tile(np.degrees(np.r_[ramp, ramp, ramp]) / RATIO, records)
    first = np.tile(np.repeat([True, False, False], len(ramp)), records)
    record = np.repeat(np.arange(records), 3 * len(ramp))

    class Rows(SimpleNamespace):
        def __len__(self):
            return len(self.theta)

    starts = np.flatnonzero(np.r_[True, (np.diff(way) != 0) | (np.diff(record) != 0)])
    return Rows(
        theta=theta,
        direction=way,
        travel=travel,
        first=first,
        record=record,
        records=records,
        reverses=True,
        piece=record,
        starts=starts,
    )


def test_play_crosses_over_its_own_width_and_friction_by_e():
    """After a reversal half-way over the crossing play stands in the middle; friction is 1/e of both sides off after
    its length. Where the recording began on the other side, it crosses there first."""
    rows = there_and_back()
    back = (rows.direction < 0) & (rows.travel <= 2.0)
    straight = path_of(rows, Crossing(2.0, 1.0, True))
    np.testing.assert_allclose(straight[back], 1 - rows.travel[back], atol=1e-12)
    friction = path_of(rows, Crossing(2.0, 1.0))
    np.testing.assert_allclose(friction[back], -1 + 2 * np.exp(-rows.travel[back] / 2.0), atol=2e-5)
    begun = path_of(rows, Crossing(2.0, -1.0))
    first = rows.first & (rows.travel <= 2.0)
    np.testing.assert_allclose(begun[first], 1 - 2 * np.exp(-rows.travel[first] / 2.0), atol=1e-12)


def test_a_pass_goes_on_where_the_one_before_it_ended():
    """A crossing longer than a pass never gets across: the third begins where the second ended."""
    rows = there_and_back()
    path = path_of(rows, Crossing(100.0, 1.0))
    ends = np.flatnonzero(np.diff(rows.direction))
    assert path[ends[1]] > 0.4
    assert path[ends[1] + 1] == pytest.approx(path[ends[1]], abs=1e-9)


def test_a_start_is_a_side_of_the_first_motion():
    """Begun on the side of a backward motion, the path is -1 at once."""
    rows = there_and_back()
    rows.direction = -rows.direction
    assert path_of(rows, Crossing(2.0, 1.0))[0] == pytest.approx(-1.0)


def test_play_is_tried_over_as_much_travel_as_it_is_wide():
    """Half a return error of 3 arcmin is play of 6: a tenth of a degree."""
    tried = [crossing.deg for crossing in paths_of(there_and_back(), 3.0) if crossing.straight]
    assert tried == pytest.approx([0.1] * 3)
    assert not [crossing for crossing in paths_of(there_and_back()) if crossing.straight]


def test_the_shortest_crossing_is_three_usual_rows():
    """Of the output's travel; a jump of the travel at each reversal is no usual row."""
    rows = there_and_back(rate=200)
    shortest = min(crossing.deg for crossing in paths_of(rows) if crossing.deg > 0)
    assert shortest == pytest.approx(3 * 360 / 200 / RATIO)


def test_half_the_return_error_is_taken_beside_zeros_and_orders():
    """0.4 arcmin to either side beside zeros 5 arcmin apart and a first order that differs between the directions'
    angles. Faults caught: the zeros of two recordings taken as one, no zero, no order beside."""
    rows = there_and_back(records=2)
    rows.direction[rows.record == 1] = 1.0  # the second recording runs one way: its zero is not the other's
    error = 0.4 * rows.direction + np.where(rows.record == 1, 5.0, 0.0) + 0.7 * np.sin(rows.theta)
    some = rows.theta % (2 * np.pi) < np.where(rows.direction > 0, 4.0, 7.0)  # angles seen more often backward
    seen = SimpleNamespace(**{k: v[some] if np.ndim(v) else v for k, v in vars(rows).items() if k != "starts"})
    assert half_about(seen, error[some]) == pytest.approx(0.4, abs=1e-9)
    assert half_return(0.4 * rows.direction + 3.0, np.ones((len(rows), 1)), rows.direction) == pytest.approx(0.4)
    seen.reverses = False
    assert half_about(seen, error[some]) == 0.0


@pytest.mark.parametrize(("share", "taken"), [(0.9, False), (1.1, True)])
def test_a_crossing_over_a_length_must_pay_for_itself_and_for_how_many_were_tried(share, taken):
    """The fall of n independent log squares against log n and twice the log of the number tried. Half of the values
    are independent. Faults caught: either price left out, all values independent."""
    n, independent = 4000, 0.5
    rng = np.random.default_rng(0)
    at_once, over, noise = (v - v.mean() for v in rng.normal(size=(3, n)))
    over -= at_once * (at_once @ over) / (at_once @ at_once)
    for other in (at_once, over):
        noise -= other * (other @ noise) / (other @ other)
    other = Crossing(2.0)
    paths = {AT_ONCE: at_once, other: over, **{Crossing(3.0 + k): at_once for k in range(30)}}
    price = math.log(n) + 2 * math.log(len(paths))
    fall = share * price / (n * independent)  # log of the squares with at once over those with the other
    size = np.sqrt((np.exp(fall) - 1) * (noise @ noise) / (over @ over))
    found = crossing_of(noise + size * over, np.ones((n, 1)), paths, independent)
    assert found == (other if taken else AT_ONCE)


def test_homing_of_either_shaft_adds_by_its_own_orders():
    """c cos(k a) moved by a degree is off by k c sin(1 deg) rms over root two; the output's is c cos(j b)."""
    found = Harmonics(np.array([4, 0]), np.array([0, 3]), np.array([0.5, 0.2]), np.zeros(2))
    homing = homing_arcmin(found, RATIO)
    for value, order, size in ((homing[0], 4, 0.5), (homing[1], 3, 0.2)):
        assert value == pytest.approx(2 * size * math.sin(math.radians(order) / 2) / math.sqrt(2), rel=1e-3)


def test_words_say_how_a_return_error_crosses():
    for crossing, words in ((AT_ONCE, "at once"), (Crossing(2.0), "exponentially"), (Crossing(2.0, 1.0, True), "line")):
        assert words in crosses(crossing)


def test_an_exponential_has_crossed_nine_tenths_where_it_says():
    """From -1, 1 - 2 exp(-x/L) = 0.8 at L ln 10, the law that `hysteresis.transition_deg` is said in. Fault caught: the
    length at which it falls to 1/e said as the travel, 2.3 times too short."""
    deg = crossing_deg(Crossing(0.2))
    assert 1 - 2 * np.exp(-deg / 0.2) == pytest.approx(0.8)
    assert crossing_deg(Crossing(0.2, 1.0, True)) == 0.2


def test_terms_added_keep_the_return_error_of_the_first():
    empty = nothing(0.3)
    one = Harmonics(empty.k, empty.j, empty.cos, empty.sin, 0.3, Crossing(2.0))
    both = one + Harmonics(np.array([1]), np.array([0]), np.ones(1), np.zeros(1), 9.0)
    assert (both.back, both.crossing, len(both)) == (0.3, Crossing(2.0), 1)


def test_a_surface_has_no_mean_and_no_line_at_half_its_cells():
    """A constant is the zero's; a line that alternates from cell to cell is no harmonic of either angle."""
    constant = Harmonics(np.array([0, 2]), np.array([0, 1]), np.array([5.0, 0.4]), np.zeros(2))
    surface = surface_of([constant])
    assert surface.values.mean() == pytest.approx(0.0, abs=1e-12)
    inputs, outputs = grid_angles((8, 6))
    assert inputs[:, 0] == pytest.approx(np.arange(8) * np.pi / 4)
    assert outputs[0] == pytest.approx(np.arange(6) * np.pi / 3)
    rows, columns = surface.values.shape
    waves = np.cos(np.arange(rows) * 2 * np.pi / rows), np.where(np.arange(columns) % 2, 1.0, -1.0)
    alternating = surface_of([], np.outer(*waves))
    assert np.abs(alternating.harmonics(5).cos).max() < 1e-12


def test_what_zones_make_has_the_driving_one_about_zero():
    """Zone 1 at 3 arcmin where zone 2 is at 1: the larger is moved to zero, and the other with it."""
    teeth = SimpleNamespace(zones=lambda angles: np.tile([[3.0], [1.0]], (1, angles.shape[1])), sense=1.0)
    first, second = zone_values(teeth, (8, 4))
    assert (first.max(), second.max()) == (0.0, -2.0)


def test_a_fall_is_worth_it_by_two_standard_errors_over_stretches():
    """Stretches of an eighth of the beat: 60 turns of N = 80 are six of ten turns. The squares fall by one on average;
    their spread over the six is that of known falls."""
    block = np.repeat(np.arange(60), 5)
    rows = SimpleNamespace(ratio=80.0, block=block)
    for falls, worth in (([1.0, 1.5, 0.5, 1.2, 0.8, 1.0], True), ([4.0, -2.0, 4.0, -2.0, 3.0, -1.0], False)):
        after = np.sqrt(10.0 - np.repeat(falls, 50))
        found, evidence, _ = _worth(np.full(300, np.sqrt(10.0)), after, rows)
        assert evidence == pytest.approx(np.mean(falls) / (np.std(falls, ddof=1) / np.sqrt(6)))
        assert found is worth
    few = SimpleNamespace(ratio=80.0, block=np.zeros(300, int))
    assert _worth(np.full(300, 2.0), np.full(300, 1.0), few) == (False, 0.0, 1)


def test_what_is_expected_is_the_mean_with_the_usual_spread():
    """Two recordings of 1 and 3 arcmin, known to 0.3 and 0.4: 2, with 1.96 roots of their mean variance."""
    value, low, high = _predicted([(1.0, 0.3), (3.0, 0.4)])
    spread = 1.96 * math.sqrt((0.09 + 0.16) / 2)
    assert (value, low, high) == (2.0, pytest.approx(2.0 - spread, rel=1e-4), pytest.approx(2.0 + spread, rel=1e-4))
    assert _predicted([(0.1, 5.0)])[1] == 0.0


def test_each_recording_has_its_own_extremes_and_its_speed_by_the_minute():
    """60 r/min are 2 pi rad/s, whichever way."""
    record = np.repeat([0, 1], 3)
    rows = SimpleNamespace(record=record, records=2, speed=2 * np.pi * np.array([1.0, 1, 1, -2, -2, -2]))
    held = np.array([0.0, 1.0, 0.5, 0.0, 4.0, 1.0]), np.array([0.0, 0.2, 0.1, 0.0, 0.5, 1.0])
    names = [SimpleNamespace(name="a"), SimpleNamespace(name="b")]
    a, b = _per_recording(names, rows, held, [(0.3, 0.1), (1.1, 0.1)])
    assert (a.name, a.speed_rpm, a.before, a.after, a.expected) == ("a", pytest.approx(60.0), 1.0, 0.2, 0.3)
    assert (a.low, a.high) == (pytest.approx(0.3 - 0.196, rel=1e-3), pytest.approx(0.3 + 0.196, rel=1e-3))
    assert (b.name, b.speed_rpm, b.before, b.after, b.expected) == ("b", pytest.approx(120.0), 4.0, 1.0, 1.1)


@pytest.mark.parametrize("r", [0.0, 0.3, 0.8, -0.5])
def test_noise_that_stays_alike_holds_fewer_independent_values(r):
    """(1 - r)/(1 + r) of an autoregression of first order (Bartlett); noise that turns over holds no more than there
    are. Faults caught: products that are not divided by the power, a lag of none, more values than there are."""
    fresh = np.random.default_rng(5).normal(size=200_000)
    left = np.empty_like(fresh)
    left[0] = fresh[0]
    for i in range(1, len(fresh)):
        left[i] = r * left[i - 1] + fresh[i]
    expected = (1 - max(r, 0.0)) / (1 + max(r, 0.0))
    # Four standard errors of a first autocorrelation, 1/sqrt(n), twice over in the share.
    assert independent_share(1e-3 * left) == pytest.approx(expected, abs=8 / math.sqrt(len(left)))
