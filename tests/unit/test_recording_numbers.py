"""What is computed of a recording, number by number, against hand computation or another library."""

from dataclasses import replace
from math import exp, log, pi, radians, sqrt
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from hdopt.errors import HdoptError
from hdopt.recordings import figures
from hdopt.recordings.bench import load_bench
from hdopt.recordings.capability import gauge, outliers, performance
from hdopt.recordings.channels import mapped_channels, sensor_uncertainty_arcmin
from hdopt.recordings.clocks import _bend, on_one_clock, seconds_of
from hdopt.recordings.columns import Column, choose_columns, parse_columns
from hdopt.recordings.decision import decide, parse_limits
from hdopt.recordings.formats import ending
from hdopt.recordings.formats.messages import stamp_ns
from hdopt.recordings.formats.text import find_layout
from hdopt.recordings.orders import model_orders, order_spectrum
from hdopt.recordings.passes import find_passes, synchronous_average
from hdopt.recordings.ratio import measured_scale
from hdopt.recordings.read import LARGEST_RATIO, _check_ratio, recording_from_table
from hdopt.recordings.recording import Recording, turns_with_ends
from hdopt.recordings.repairs import Checks, drop_incomplete_rows, drop_outliers, find_gaps, unwrap_counter
from hdopt.recordings.rows import gather, quiet
from hdopt.recordings.stiffness import starting_torque_nm, torsion_of
from hdopt.recordings.table import Channel, Table, columns_of
from hdopt.recordings.units import parse_unit

TURN, ARCMIN, RATIO, RATE = 2 * pi, pi / 10800, 80.0, 360


@pytest.mark.parametrize(
    ("shape", "names"),
    [
        ((5,), ["angle"]),
        ((5, 1), ["angle"]),
        ((1, 5, 1), ["angle"]),
        ((3, 5), ["angle[0]", "angle[1]", "angle[2]"]),
        ((5, 3), ["angle[0]", "angle[1]", "angle[2]"]),
        ((1, 1), []),
        ((65, 70), []),
        ((2, 3, 4), []),
    ],
    ids=str,
)
def test_arrays_become_channels_along_their_longer_side(shape, names):
    """Each channel holds what stands along it, whichever way the array was written."""
    values = np.arange(np.prod(shape)).reshape(shape)
    found = columns_of("angle", values)
    assert [name for name, _ in found] == names
    along = np.atleast_2d(np.squeeze(values) if shape == (3, 5) else np.squeeze(values).T)
    assert [column.tolist() for _, column in found] == (along.tolist() if names else [])


@pytest.mark.parametrize(
    ("name", "said"), [("a.csv", ".csv"), ("a.CSV.GZ", ".csv"), ("a.b.txt", ".txt"), ("a.gz", ".gz"), ("a", "")]
)
def test_the_ending_says_what_a_compressed_file_is(name, said):
    assert ending(Path(name)) == said


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ({"stamp": SimpleNamespace(sec=2, nanosec=5)}, 2_000_000_005),
        ({"stamp": SimpleNamespace(sec=0, nanosec=7)}, 7),
        ({"stamp": SimpleNamespace(sec=0, nanosec=0)}, None),
        ({}, None),
    ],
)
def test_a_stamp_is_seconds_and_the_rest_in_ns(header, expected):
    assert stamp_ns(SimpleNamespace(header=SimpleNamespace(**header))) == expected
    assert stamp_ns(SimpleNamespace()) is None


def test_a_table_is_as_wide_as_its_second_half():
    """Lines above it may be more, narrower and numbers too."""
    above = ["5;7"] * 4
    rows = [f"{k};{2 * k};{3 * k}" for k in range(60)]
    layout = find_layout([*above, *rows], "utf-8", "file")
    assert (layout.first_row, len(layout.header)) == (4, 3)


def test_two_columns_that_could_be_the_torque_are_none():
    """Temperatures may be several; of two torques neither is taken, and angles that are not plain are asked for."""
    angle = np.linspace(0, 50, 200)
    channels = {name: Channel(angle + k) for k, name in enumerate(("motor_angle_deg", "load_angle_deg"))}
    both = {"torque_a_nm": Channel(angle), "torque_b_nm": Channel(angle)}
    found, _ = choose_columns(Table({**channels, **both}), "file")
    assert set(found) == {"input", "output"}
    with pytest.raises(HdoptError, match="torque: torque_a_nm or torque_b_nm"):
        choose_columns(Table({**channels, **both, "motor_angle_2_deg": Channel(angle)}), "file")


@pytest.mark.parametrize(("channel", "said"), [("time", "gives time the unit"), ("torque", "Nm"), ("input", "deg")])
def test_only_times_may_be_dates(channel, said):
    """A torque in 'iso' is told the units of a torque."""
    with pytest.raises(HdoptError) as refused:
        parse_unit(channel, "iso")
    assert said in str(refused.value)
    assert ("day.month.year" in str(refused.value)) == (channel == "time")


def there_and_back(turns=4, passes=2, rate=RATE):
    there = np.arange(turns * rate) * TURN / rate
    return np.concatenate([there if k % 2 == 0 else there[::-1] for k in range(passes)])


def recording(error, theta=None, **more):
    theta = there_and_back() if theta is None else theta
    return Recording("record", RATIO, theta, np.asarray(error, float), **{"time": 0.01 * np.arange(len(theta)), **more})


# reading


def read(column, values):
    table = Table({"out": Channel(np.asarray(values, float)), "in": Channel(np.zeros(len(values)))}, ())
    columns = {"input": Column("in", "rad"), "output": column}
    return mapped_channels(table, columns, False, "record").values["output"]


def test_sign_unit_and_calibration():
    """deg to rad, turned round; a reading is freed of its deviation, 36 arcsec at 90 deg and none at 0 and 180."""
    assert read(Column("out", "deg", -1.0), [10.0, 20.0]) == pytest.approx([-radians(10), -radians(20)])
    calibrated = Column("out", "deg", 1.0, ((0.0, 0.0), (90.0, 36.0), (180.0, 0.0)))
    off = np.array([0.0, 36.0, 18.0, 0.0]) / 3600
    assert read(calibrated, [0.0, 90.0, 135.0, 270.0]) == pytest.approx(np.radians([0.0, 90.0, 135.0, 270.0] - off))


def test_encoders_add_as_independent_at_the_output():
    """240 arcsec at the input are 3 at the output of N = 80; with 4 there, 5 arcsec."""
    columns = {"input": Column("a", "deg", uncertainty_arcsec=240.0), "output": Column("b", uncertainty_arcsec=4.0)}
    assert sensor_uncertainty_arcmin(columns, RATIO) == pytest.approx(5 / 60)


def test_times_of_day_pass_midnight():
    found, _ = seconds_of(np.array(["23:59:58.5", "23:59:59.5", "00:00:00.5", "00:00:01.5"], object), "time")
    assert np.diff(found) == pytest.approx(1.0)


def clocked(step_in, step_out, span=10.0):
    t_in, t_out = np.arange(0, span, step_in), np.arange(0, span, step_out)
    channels = {"input": Channel(t_in, time_s=t_in), "output": Channel(t_out, time_s=t_out)}
    return channels, {"input": 3.0 * t_in, "output": 2.0 * t_out}


def test_channels_meet_on_the_clock_of_the_slower_angle():
    for steps in ((0.01, 0.03), (0.03, 0.01)):
        values, said = on_one_clock(*clocked(*steps))
        assert np.diff(values["time"]) == pytest.approx(0.03)
        assert values["input"] / 3.0 == pytest.approx(values["time"])
        assert values["output"] / 2.0 == pytest.approx(values["time"])
        assert "interpolated" in said[0]


def test_a_pause_is_not_bridged():
    """The faster channel rests from 4 to 6 s: no row of the slower clock lies between."""
    channels, values = clocked(0.01, 0.03)
    moving = (channels["input"].time_s < 4) | (channels["input"].time_s > 6)
    time = channels["input"].time_s[moving]
    channels["input"] = Channel(time, time_s=time)
    found, _ = on_one_clock(channels, {**values, "input": 3.0 * time})
    assert not np.any((found["time"] > 4.01) & (found["time"] < 5.99))


@pytest.mark.parametrize("off", [1.02, 0.97])
def test_the_ratio_that_the_angles_show(off):
    theta = np.linspace(0, 20 * TURN, 4000)
    output = theta / (RATIO * off) + 2 * ARCMIN * np.sin(2 * theta)
    found = measured_scale(Checks({"input": theta, "output": output}, RATIO, "record"))
    assert found.ratio == pytest.approx(RATIO * off, rel=1e-3)
    assert found.slope == pytest.approx(1 / off, rel=1e-3)
    # The drive's own wave, 2 arcmin to either side, bends the line by 4 arcmin times N over 20 turns at most.
    assert found.uncertainty == pytest.approx(4 * ARCMIN * RATIO / (20 * TURN), rel=0.05)


def test_a_ratio_two_per_cent_off_is_refused():
    theta = np.degrees(np.linspace(0, 20 * TURN, 4000))
    table = pd.DataFrame({"input_angle_deg": theta, "output_angle_deg": theta / (RATIO * 1.02)})
    with pytest.raises(HdoptError, match=r"moves as for a ratio of 81\.6"):
        recording_from_table(table, RATIO)


def test_the_input_encoders_step_counts_at_the_output():
    """1 deg steps of the input: 60/80 = 0.75 arcmin at the output, more than the output encoder's 0.1."""
    theta = np.linspace(0, 3 * 360, 12_000)
    table = pd.DataFrame({"input_angle_deg": np.floor(theta), "output_angle_deg": np.round(theta / RATIO * 600) / 600})
    assert recording_from_table(table, RATIO).quantum_arcmin == pytest.approx(0.75, rel=1e-6)


def test_a_counter_of_four_turns_is_counted_on():
    """Both ways over its end."""
    theta = np.concatenate([np.linspace(0, 18 * TURN, 4000), np.linspace(18 * TURN, 3 * TURN, 3000)])
    checks = Checks({"input": np.mod(theta, 4 * TURN)}, RATIO, "record")
    unwrap_counter(checks, "input", checks.channels["input"])
    assert checks.channels["input"] == pytest.approx(theta)
    assert "runs over after 4 turns" in checks.warnings[0]


# passes and rows


def test_travel_counts_from_each_reversal():
    theta = there_and_back(3, 4)
    found = find_passes(theta + np.random.default_rng(0).normal(0, 1e-3, len(theta)))
    assert found.count == 4
    turns = np.array_split(np.arange(len(theta)), 4)
    for number, rows in enumerate(turns):
        inner = rows[5:-5]
        assert set(found.direction[inner]) == {1.0 if number % 2 == 0 else -1.0}
        assert found.since_reversal[inner] == pytest.approx(np.abs(theta[inner] - theta[rows[0]]), abs=0.05)
        assert set(found.first[inner]) == {number == 0}


def test_rows_are_means_with_their_conditions():
    theta = there_and_back(10, 2, rate=300)
    error = 0.5 * np.sin(theta)
    made = recording(error, theta)
    rows = gather([made], 4)
    for row in (10, 700, 800, 1400):
        members = np.flatnonzero(np.abs(np.arange(len(theta)) // 4 - row) < 1)
        assert rows.theta[row] == pytest.approx(theta[members].mean())
        assert rows.error[row] == pytest.approx(error[members].mean())
        assert rows.output[row] == pytest.approx((theta / RATIO - error * ARCMIN)[members].mean())
        speed = (1.0 if row < 750 else -1.0) * TURN / 300 / 0.01
        assert rows.speed[row] == pytest.approx(speed, rel=1e-6)
        assert rows.direction[row] == np.sign(speed)
    ends = theta[len(theta) // 2 - 1]
    assert rows.travel[800] == pytest.approx(np.degrees(abs(rows.theta[800] - ends)) / RATIO, abs=0.02)


def test_rows_end_at_a_reversal_and_weigh_by_their_samples():
    """1001 samples there: the last row of the pass has one of four, and a quarter of the weight."""
    there = np.arange(1001) * TURN / 100
    theta = np.r_[there, there[-2::-1]]
    rows = gather([recording(np.zeros(len(theta)), theta)], 4)
    last = np.flatnonzero(np.diff(rows.direction))[0]
    assert rows.weight[last] == pytest.approx(0.25)
    assert np.median(rows.weight) == 1.0


def test_speed_does_not_reach_over_a_gap():
    theta = np.arange(800) * TURN / 100
    time = 0.01 * np.arange(800) + np.where(np.arange(800) >= 400, 50.0, 0.0)
    segment = (np.arange(800) >= 400).astype(np.int64)
    rows = gather([recording(np.zeros(800), theta, time=time, segment=segment)])
    assert rows.speed == pytest.approx(TURN)


def test_a_slow_channel_loses_its_noise_and_nothing_else():
    """A drift of 3 K loses nine tenths of its read-out noise; a torque that swings in forty rows is left as it is; on
    both sides of a gap the record stands."""
    n = 6000
    noise = np.random.default_rng(4).normal(0, 0.05, n)
    one = np.zeros(n, np.int64)
    drift = 20 + 3 * np.linspace(0, 1, n)
    assert np.std(quiet(drift + noise, one) - drift) < 0.1 * 0.05 * 1.3
    swing = 5 * np.sin(TURN * np.arange(n) / 40)
    assert np.abs(quiet(swing + noise, one) - swing).max() < 0.3
    gap = np.arange(n) >= 3000
    stepped = np.where(gap, 10.0, 0.0) + noise
    found = quiet(stepped, gap.astype(np.int64))
    assert np.abs(found - np.where(gap, 10.0, 0.0)).max() < 5 * 0.05
    assert np.std((found - np.where(gap, 10.0, 0.0))[:2500]) < 0.2 * 0.05


def test_the_rest_of_a_turn_belongs_to_the_turn_before():
    """Ten turns and a fifth are ten blocks; ten and a half are eleven, in each of two recordings."""
    for more, blocks in ((20, 10), (50, 11)):
        theta = (np.arange(1000 + more) + 0.5) * TURN / 100
        rows = gather([recording(np.zeros(len(theta)), theta)] * 2)
        assert len(np.unique(rows.block)) == 2 * blocks
        assert rows.block[0] == 0 and (np.diff(rows.block) >= 0).all()


@pytest.mark.parametrize("end", ["start", "turning point"])
def test_a_turn_begins_once_though_noise_goes_over_it(end):
    """The input stands at a multiple of a turn, as recordings begin: the encoder's noise goes to and fro over it. Each
    row was a turn of its own, single rows were hidden as whole turns, and what fades after a start was fitted to none
    of it: friction beside a windup was `unknown`."""
    rate, standing = 100, 300
    ramp = np.arange(1, 10 * rate + 1) * TURN / rate
    still = np.random.default_rng(3).normal(0, 1e-5, standing)
    if end == "start":
        theta, ends = np.r_[still, ramp], 10
    else:
        theta, ends = np.r_[ramp + 1.0 - 10 * TURN, 1.0 + still, ramp[::-1] + 1.0 - 10 * TURN] - 1.0, 20
    rows = gather([recording(np.zeros(len(theta)), theta)])
    sizes = np.bincount(rows.block)
    assert abs(len(sizes) - ends) <= 1
    assert np.sort(sizes)[:-2].min() >= rate - 2 and sizes.max() <= rate + standing + 1


def test_the_coarsest_encoder_is_that_of_all_recordings():
    steps = [recording(np.zeros(1440), there_and_back(2), quantum_arcmin=q, output_step_arcmin=q) for q in (0.3, 0.1)]
    assert (gather(steps).quantum, gather(steps[::-1]).quantum) == (0.3, 0.3)
    assert gather(steps).output_step == 0.3


def test_a_unit_with_a_minus_turns_its_channel_round():
    columns = parse_columns("input=a:deg,output=b:-rad")
    assert [(c.name, c.unit, c.sign) for c in columns.values()] == [("a", "deg", 1.0), ("b", "rad", -1.0)]


def test_synchronous_average_has_the_error_of_its_means():
    rng = np.random.default_rng(0)
    angle = rng.uniform(0, 200, 40_000)
    values = np.cos(angle) + rng.normal(0, 0.5, 40_000)
    centre, mean, error = synchronous_average(angle, values, TURN, 36)
    count = np.bincount((np.mod(angle, TURN) / TURN * 36).astype(int))
    # A cell of 10 deg flattens a cosine by 0.1 %, and adds its own slope to the scatter.
    assert np.abs(mean - np.cos(centre)).max() < 5 * 0.5 / sqrt(count.min())
    assert error == pytest.approx(0.5 / np.sqrt(count), rel=0.1)


# orders


def test_amplitude_and_phase_of_a_cosine():
    theta = np.linspace(0, 300, 5000)
    signal = 0.7 + 0.3 * np.cos(2.0 * theta - 0.6) + 0.1 * np.cos(3.1 * theta + 1.0)
    found = order_spectrum(theta, signal, [2.0, 3.1])
    assert found.amplitudes == pytest.approx([0.3, 0.1], abs=1e-9)
    assert found.phases == pytest.approx([0.6, -1.0], abs=1e-9)
    assert found.mean == pytest.approx(0.7)


def test_every_model_order_stands_where_its_symbol_says():
    """Eightieths of a cycle, worked out by hand for N = 80."""
    eightieths = {
        "1/N": 1,
        "2/N": 2,
        "1-1/N": 79,
        "1": 80,
        "1+1/N": 81,
        "2-1/N": 159,
        "2": 160,
        "2(1+1/2N)": 161,
        "2(1+1/N)": 162,
        "3": 240,
        "3+1/N": 241,
        "4": 320,
        "4(1+1/4N)": 321,
        "4(1+1/2N)": 322,
        "5": 400,
        "5+1/N": 401,
    }
    assert {one.symbol: one.order * 80 for one in model_orders(80.0)} == pytest.approx(eightieths)


# figures and decisions


@pytest.mark.parametrize(
    ("value", "verdict"), [(0.83, "met"), (0.84, "not decidable"), (1.16, "not decidable"), (1.17, "missed")]
)
def test_a_guard_band_on_both_sides_of_the_limit(value, verdict):
    """ISO 14253-1: 1.645 standard uncertainties of 0.1 about a limit of 1."""
    assert decide("rms", value, 0.1, 1.0).verdict == verdict
    assert decide("rms", -value, 0.1, 1.0).verdict == verdict


def test_limits_in_their_units():
    assert parse_limits("rms=30arcsec,slope=2,one_turn=0.01deg") == pytest.approx(
        {"rms": 0.5, "slope": 2.0, "one_turn": 0.6}
    )
    assert parse_limits("slope=30arcsec/deg") == pytest.approx({"slope": 0.5})


@pytest.mark.parametrize("words", ["slope=1arcmin", "slope=1deg", "rms=1arcmin/deg", "return_error=2furlong"])
def test_a_limit_in_the_unit_of_another_quantity_is_refused(words):
    """Would catch a slope taken in arcmin, which is no slope, and a peak-to-peak in arcmin per degree."""
    with pytest.raises(HdoptError, match="its unit is one of arcmin"):
        parse_limits(words)


NOISE = np.random.default_rng(3).normal(0, 0.02, 8 * RATE)


def cells(error, theta=None):
    return figures.cells_of(recording(error, theta))


def test_noise_of_one_sample():
    error = 0.3 * np.sin(2 * there_and_back()) + NOISE
    assert figures.neighbour_noise(error) == pytest.approx(0.02, rel=0.05)


WAY = np.r_[np.ones(4 * RATE), -np.ones(4 * RATE)]


def test_play_is_return_error_and_no_part_of_the_rest():
    """Half an arcmin forward above backward, on 0.6 arcmin peak to peak of the drive's own."""
    own = 0.3 * np.sin(2 * there_and_back())
    found = cells(own + 0.25 * WAY)
    back = figures.return_error(found)
    assert back.median == pytest.approx(0.5, abs=0.01)
    assert figures.directional_peak_to_peak(found) == pytest.approx(0.6, abs=0.01)
    assert figures.rms(found) == pytest.approx(0.3 / sqrt(2), rel=0.01)


def test_steepest_slope_by_degree():
    """0.3 sin(2 theta) rises by 0.6 arcmin a radian; a line over 10 deg is 0.5 % less steep."""
    slope, _ = figures.steepest_slope(cells(0.3 * np.sin(2 * there_and_back())))
    assert slope == pytest.approx(0.6 * pi / 180, rel=0.02)


def test_repeatability_is_that_of_one_pass():
    """Two passes there, of independent noise: their difference has twice its variance."""
    theta = there_and_back(4, 4)
    noise = np.random.default_rng(5).normal(0, 0.05, len(theta))
    found = cells(0.3 * np.sin(2 * theta) + noise, theta)
    per_cell = RATE / round(TURN / found.width)
    assert figures.repeatability([found]) == pytest.approx(0.05 / sqrt(per_cell), rel=0.08)


def test_drift_is_the_slope_beside_the_play():
    """The record ends in the direction in which it did not begin: play must not be taken for drift."""
    along = np.linspace(0, 1, 8 * RATE)
    assert figures.drift(cells(0.8 * along + 0.25 * WAY)) == pytest.approx(0.8, rel=0.02)


def test_skew_is_told_from_play_by_two_speeds():
    theta = np.concatenate([there_and_back(2, 2, 400), there_and_back(2, 2, 200)])
    time = np.arange(len(theta)) * 0.005
    speed = np.gradient(theta, time)
    way = np.sign(speed)
    made = recording(0.003 * speed / RATIO / ARCMIN + 0.3 * way, theta, time=time)
    delay, _ = figures.skew_s(made)
    assert delay == pytest.approx(0.003, rel=0.02)


def sweep(friction=0.2):
    """Three lines of 20, 40 and 60 kNm/rad with knees at 8 and 20 Nm, 0.4 arcmin apart in both directions."""
    torque = 30 * np.sin(np.linspace(0, 6 * pi, 6000))
    size = np.abs(torque)
    windup = np.minimum(size, 8) / 20e3 + np.clip(size - 8, 0, 12) / 40e3 + np.maximum(size - 20, 0) / 60e3
    way = np.sign(np.gradient(torque))
    error = np.sign(torque) * windup / ARCMIN + friction * way * (1 + size / 30)
    return recording(error, np.zeros(6000), torque=torque)


def test_stiffness_knees_and_loss_of_a_known_sweep():
    found = torsion_of(sweep())
    assert found.stiffness == pytest.approx((20e3, 40e3, 60e3), rel=0.03)
    assert found.knees == pytest.approx((8.0, 20.0), rel=0.05)
    assert found.hysteresis_loss_arcmin == pytest.approx(0.4, rel=0.05)


def test_performance_is_that_of_the_fitted_log_normal():
    """(U - X50)/(X99.865 - X50) of scipy's distribution; the same interval from the same seed."""
    values = np.exp(np.random.default_rng(1).normal(log(0.8), 0.2, 30))
    fitted = stats.lognorm(np.std(np.log(values), ddof=1), scale=exp(np.mean(np.log(values))))
    expected = (2.0 - fitted.median()) / (fitted.ppf(stats.norm.cdf(3)) - fitted.median())
    found = performance(values, 2.0)
    assert found.ppk == pytest.approx(expected, rel=1e-9)
    assert found == performance(values, 2.0) != performance(values, 2.0, seed=2)
    assert found.low < found.ppk < found.high


def test_outliers_are_far_from_the_median():
    """A modified z-score of 3.5 is 5.2 median deviations of the logarithm."""
    values = np.exp(np.array([-2.0, -1.0, -1.0, -1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 5.1, 5.3]) * 0.1)
    assert outliers(values) == [10]


def test_mountings_scatter_beyond_their_repeats():
    """Random effects of a one-way analysis of variance, by hand for three mountings of four."""
    groups = np.array([[1.0, 1.2, 0.9, 1.1], [2.0, 2.1, 1.9, 2.2], [1.5, 1.4, 1.6, 1.3]])
    within = groups.var(axis=1, ddof=1).mean()
    between = 4 * groups.mean(axis=1).var(ddof=1)
    found = gauge(groups.ravel(), np.repeat(["a", "b", "c"], 4))
    assert found.repeatability == pytest.approx(sqrt(within))
    assert found.reproducibility == pytest.approx(sqrt((between - within) / 4))
    alike = gauge(np.tile([1.0, 1.2, 0.9, 1.1], 3), np.repeat(["a", "b", "c"], 4))
    assert alike.reproducibility == 0.0
    assert replace(found, repeats=3).total == found.total


def test_mountings_of_unequal_numbers():
    """The mean squares' size for groups of 2, 3 and 5 is (10 - 38/10)/2 = 3.1 (Searle, Linear Models, 1971, ch. 10)."""
    groups = [np.array([1.0, 1.2]), np.array([2.0, 2.1, 1.9]), np.array([1.5, 1.4, 1.6, 1.3, 1.7])]
    values = np.concatenate(groups)
    between = sum(len(g) * (g.mean() - values.mean()) ** 2 for g in groups) / 2
    within = sum(len(g) * g.var() for g in groups) / 7
    found = gauge(values, ["a"] * 2 + ["b"] * 3 + ["c"] * 5)
    assert found.reproducibility == pytest.approx(sqrt((between - within) / 3.1))


# figures at their edges


def test_a_cell_scatters_as_the_mean_of_its_samples():
    theta = there_and_back(4, 2, 3600)
    found = figures.cells_of(recording(np.random.default_rng(7).normal(0, 0.05, len(theta)), theta))
    assert len(found.error) < len(theta) / 4
    # Of some 2000 cells and more the standard deviation is known to 2 %.
    assert np.median(found.sigma) == pytest.approx(found.error.std(), rel=0.06)


def test_an_encoders_step_scatters_evenly_over_itself():
    """The standard deviation of what is spread evenly over 0.6 arcmin is 0.6/sqrt(12)."""
    found = figures.cells_of(recording(np.zeros(8 * RATE), quantum_arcmin=0.6))
    per_cell = RATE / round(TURN / found.width)
    assert np.median(found.sigma) == pytest.approx(0.6 / sqrt(12 * per_cell))


@pytest.mark.parametrize(("travel", "turns"), [(3.7, 3), (3.96, 4)])
def test_a_turn_counts_where_nine_tenths_of_it_were_seen(travel, turns):
    theta = np.arange(round(travel * RATE)) * TURN / RATE
    found, _ = figures.turn_peak_to_peaks(cells(0.3 * np.sin(2 * theta), theta))
    assert found == pytest.approx(np.full(turns, 0.6), rel=0.02)


def test_the_largest_return_error_keeps_its_sign():
    """Forward below backward by 0.25 to 0.75 arcmin."""
    back = figures.return_error(cells(-0.25 * WAY * (1 + 0.5 * np.sin(there_and_back()))))
    assert back.largest == pytest.approx(-0.75, abs=0.01)


@pytest.mark.parametrize(("quantum", "count"), [(0.3, 1), (0.5, 0)])
def test_a_slip_is_more_than_two_steps_of_the_encoder(quantum, count):
    theta = np.arange(4 * RATE) * TURN / RATE
    error = 0.05 * np.sin(2 * theta) + 0.8 * (theta >= 2 * TURN - 1e-9)
    found = figures.slips(cells(error, theta), quantum)
    assert len(found) == count
    assert all(height == pytest.approx(0.8, abs=0.05) for _, height in found)


def test_starting_torque_is_what_came_on_top_of_the_sensors_zero():
    """A sensor that shows 0.3 Nm at rest; the drive starts at 1 Nm more and then runs at 0.4."""
    k = np.arange(400)
    theta = np.where(k <= 100, 0.0, 0.1 * (k - 100))
    torque = 0.3 + np.where(k <= 100, k / 100, 0.4)
    made = recording(np.zeros(400), theta, torque=torque)
    assert starting_torque_nm(made) == pytest.approx(1.0)


def test_the_first_way_of_a_sweep_does_not_count():
    """It begins inside the loop; here it lies 3 arcmin beside it."""
    made = sweep()
    beside = replace(made, error_arcmin=made.error_arcmin + 3.0 * (np.arange(6000) < 500))
    found, without = torsion_of(beside), torsion_of(made)
    assert found.hysteresis_loss_arcmin == pytest.approx(0.4, rel=0.05)
    assert found.stiffness == pytest.approx(without.stiffness, rel=1e-6)


# repairs


def rows_read(n=1000, **channels):
    return Checks({"time": 0.01 * np.arange(n), "input": np.arange(n) * TURN / 100, **channels}, RATIO, "record")


@pytest.mark.parametrize(("steps", "parts"), [(3.5, 1), (6.0, 2)])
def test_a_gap_is_longer_than_four_usual_steps(steps, parts):
    time = 0.01 * np.arange(1000) + 0.01 * (steps - 1) * (np.arange(1000) >= 500)
    assert find_gaps(rows_read(time=time, error=np.zeros(1000)))[-1] + 1 == parts


@pytest.mark.parametrize(("every", "dropped"), [(100, True), (25, False)])
def test_single_samples_far_out_are_dropped_where_they_are_few(every, dropped):
    """One in a hundred of 20 arcmin; one in 25 is no fault of the read-out, but what the recording is."""
    error = np.random.default_rng(0).normal(0, 0.1, 1000)
    error[10::every] += 20.0
    checks = rows_read(error=error * ARCMIN)
    drop_outliers(checks, np.zeros(1000, np.int64))
    assert (len(checks) < 1000) is dropped


def test_a_torque_of_which_nine_tenths_are_missing_is_not_filled():
    """Half of it is filled in between; of a twentieth the rows without are dropped, and then too few are left."""
    half = np.where(np.arange(1000) % 2, np.nan, 5.0)
    checks = rows_read(error=np.zeros(1000), torque=half)
    drop_incomplete_rows(checks)
    assert len(checks) == 1000 and np.isfinite(checks.channels["torque"]).all()
    few = np.where(np.arange(1000) % 20, np.nan, 5.0)
    with pytest.raises(HdoptError, match="950 of 1000 rows hold missing values"):
        drop_incomplete_rows(rows_read(error=np.zeros(1000), torque=few))


def test_an_encoders_step_and_uncertainty_are_each_its_own(tmp_path):
    """Fault caught: the one in the place of the other, 0.01 deg being 36 arcsec."""
    path = tmp_path / "bench.toml"
    path.write_text('[columns.input]\ncolumn = "a"\nunit = "deg"\nstep_deg = 0.01\nuncertainty_arcsec = 7.0\n')
    column = load_bench(path).columns["input"]
    assert (column.step_deg, column.uncertainty_arcsec) == (0.01, 7.0)


@pytest.mark.parametrize(("role", "values", "said"), [("input", 5, "3.4"), ("output", 7, "3.4"), ("torque", 7, "")])
def test_a_straight_line_between_samples_misses_an_eighth_of_the_second_difference(role, values, said):
    """A second difference of 0.008 rad: a thousandth of a radian is 3.438 arcmin. Fault caught: a ninth of it."""
    angles = 0.5 * 0.008 * np.arange(values) ** 2
    words = _bend(role, angles)
    assert words == (f", missing about {said} arcmin at its shaft" if said else "")
    assert _bend(role, angles[:4]) == ""


def test_lines_above_a_table_may_be_more_than_its_rows():
    """The width of a table is that of most lines of its second half. Fault caught: of nearly all lines."""
    above = [f"{k};{k}" for k in range(230)]
    rows = [f"{k};{2 * k};{3 * k}" for k in range(220)]
    layout = find_layout([*above, *rows], "utf-8", "file")
    assert (layout.first_row, len(layout.header)) == (230, 3)


def test_the_largest_ratio_is_a_ratio():
    _check_ratio(LARGEST_RATIO)
    with pytest.raises(HdoptError, match="at most 100000"):
        _check_ratio(np.nextafter(LARGEST_RATIO, np.inf))


def test_turns_reach_as_far_beyond_either_end_as_neighbours_are_apart():
    assert turns_with_ends(0.96, 0.02) == pytest.approx(1.0)
