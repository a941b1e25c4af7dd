"""Both sides of the bounds of a recording's repairs and figures, each value worked out here."""

import numpy as np
import pandas as pd
import pytest

from hdopt.drive.geometry import ARCMIN
from hdopt.errors import HdoptError
from hdopt.recordings import figures
from hdopt.recordings.checks import steps_arcmin
from hdopt.recordings.clocks import on_one_clock
from hdopt.recordings.columns import choose_columns
from hdopt.recordings.decision import decide, verdict_line
from hdopt.recordings.encoder_step import encoder_step
from hdopt.recordings.orders import error_growth, inseparable_groups
from hdopt.recordings.passes import conditions
from hdopt.recordings.ratio import check_ratio
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.recording import Recording
from hdopt.recordings.repairs import (
    Checks,
    drop_outliers,
    find_gaps,
    order_rows_in_time,
    unwrap_angles,
    unwrap_counter,
)
from hdopt.recordings.rows import gather
from hdopt.recordings.stiffness import mean_where_known, starting_torque_nm, torsion_of
from hdopt.recordings.table import Channel, Table

TURN, RATIO, ROWS = 2 * np.pi, 80.0, 1000
THETA = np.arange(ROWS) * TURN / 100


def rows_of(**channels):
    return Checks({"input": THETA, **channels}, RATIO, "record")


def recording(error, theta, **more):
    return Recording("record", RATIO, theta, np.asarray(error, float), **more)


# repairs


@pytest.mark.parametrize(("height", "dropped"), [(7.0, False), (7.5, True)])
def test_a_sample_is_a_fault_from_25_of_the_others_deviations(height, dropped):
    """Samples of +-0.1 in turn lie 0.2 from the median of the seven about them, so that 25 deviations (1.4826 medians
    each) are 7.41: a sample of 0.1 + 7.0 is 7.2 off, one of 0.1 + 7.5 is 7.7 off. Faults of 200 arcmin beside it do
    not widen the scale."""
    error = 0.1 * np.resize([1.0, -1.0], ROWS)
    error[400] += height
    error[10:150:10] += 200.0
    checks = rows_of(error=error * ARCMIN)
    drop_outliers(checks, np.zeros(ROWS, np.int64))
    assert len(checks) == ROWS - 14 - dropped


@pytest.mark.parametrize(("jump", "parts"), [(0.015, 1), (0.025, 2)])
def test_without_a_clock_a_gap_is_a_fiftieth_of_a_turn(jump, parts):
    """The input moves by a thousandth of a turn a sample, and once by many of these."""
    theta = np.arange(ROWS) * TURN / 1000 + (np.arange(ROWS) >= 500) * jump * TURN
    segment = find_gaps(Checks({"input": theta}, RATIO, "record"))
    assert segment[-1] + 1 == parts


@pytest.mark.parametrize(("turns_a_sample", "counted"), [(0.02, True), (0.12, True), (0.28, True), (0.35, False)])
def test_wrapped_turns_are_counted_up_to_three_tenths_of_one_a_sample(turns_a_sample, counted):
    angle = 0.1 + np.arange(200) * turns_a_sample * TURN
    checks = Checks({"input": np.mod(angle, TURN)}, RATIO, "record")
    if counted:
        unwrap_angles(checks)
        assert np.allclose(checks.channels["input"], angle)
    else:
        with pytest.raises(HdoptError, match=r"moves about 0\.35 turns a sample; the turns cannot be counted"):
            unwrap_angles(checks)


def test_a_step_of_half_a_turn_is_no_wrap():
    """It says nothing of the way: the angle stays as it was read."""
    angle = np.resize([0.0, TURN / 2], 60)
    checks = Checks({"input": angle}, RATIO, "record")
    unwrap_angles(checks)
    assert np.array_equal(checks.channels["input"], np.resize([0.0, TURN / 2], 60)) and checks.warnings == []


@pytest.mark.parametrize("begin", [0.0, 2.0], ids=["upward", "downward"])
def test_an_angle_that_also_steps_within_its_range_is_no_counter_that_runs_over(begin):
    """Half the range at once, from 1 turn to 3 or from 3 to 1, is no move between samples: how often it ran over is not
    known."""
    angle = np.mod(begin * TURN + np.linspace(0, 10 * TURN, 2001) + (np.arange(2001) > 1000) * 2 * TURN, 4 * TURN)
    as_it_was = angle.copy()
    checks = Checks({"input": angle}, RATIO, "record")
    unwrap_counter(checks, "input", angle)
    assert np.array_equal(checks.channels["input"], as_it_was) and checks.warnings == []


def test_a_clock_that_goes_back_by_more_than_a_few_rows_starts_anew():
    """35 steps back at row 601 of 1000: twenty rows repeat times from before the ten last. One wild stamp is none."""
    time = 0.01 * np.arange(ROWS)
    time[600:] -= 0.35
    with pytest.raises(HdoptError, match="the clock starts anew at row 601"):
        order_rows_in_time(rows_of(time=time))
    wild = 0.01 * np.arange(ROWS)
    wild[595] = 1e4
    checks = rows_of(time=wild)
    order_rows_in_time(checks)
    assert ["1 time stamp was out of order" in said for said in checks.warnings] == [True]


@pytest.mark.parametrize(("slope", "refused"), [(1.47, False), (1.73, True)])
def test_a_slope_on_a_short_stroke_may_be_windup_up_to_half_a_degree(slope, refused):
    """A fifth of an input turn is 54 arcmin of an output with N = 80: 0.47 of it are 25, and 0.73 are 39 arcmin."""
    theta = np.linspace(0, 0.2 * TURN, 400)
    checks = Checks({"input": theta, "output": slope * theta / RATIO}, RATIO, "record")
    if refused:
        with pytest.raises(HdoptError, match="moves as for a ratio of 46"):
            check_ratio(checks)
    else:
        check_ratio(checks)


# columns and clocks


def test_channels_of_one_clock_bring_their_time():
    time = 0.5 + 0.01 * np.arange(300)
    channels = {role: Channel(time, time_s=time) for role in ("input", "output")}
    values, said = on_one_clock(channels, {"input": 3.0 * time, "output": time})
    assert np.array_equal(values["time"], time) and said == []


@pytest.mark.parametrize("start", [8e6, 1.7e9])
def test_seconds_since_1970_count_from_the_first(start):
    """A clock that has run for three months is as it was."""
    table = pd.DataFrame({"t": start + 0.01 * np.arange(ROWS), "i": THETA, "o": THETA / RATIO})
    found = recording_from_table(table, RATIO, "time=t:s,input=i:rad,output=o:rad")
    assert found.time[0] == (start if start < 1e7 else 0.0)
    assert np.diff(found.time) == pytest.approx(0.01, abs=1e-6)  # digits of 1.7e9 in a float: 2.4e-7


def test_what_is_missing_among_the_columns_is_named():
    angle = np.linspace(0, 50, 200)
    with pytest.raises(HdoptError, match="no column is plainly output"):
        choose_columns(Table({"motor_angle_deg": Channel(angle), "other": Channel(angle)}), "file")


def test_a_column_whose_name_ends_with_another_unit_is_no_angle():
    """The motor's torque, temperature, clock and speed are not its angle, whatever stands before the unit."""
    names = ["motor_deg", "load pos [deg]", "motor_torque_Nm", "motor temp (C)", "motor_time_s", "motor_speed_deg"]
    angle = np.linspace(0, 50, 200)
    found, _ = choose_columns(Table({name: Channel(angle) for name in names}), "file")
    assert {channel: column.name for channel, column in found.items()} == {
        "time": "motor_time_s",
        "input": "motor_deg",
        "output": "load pos [deg]",
        "torque": "motor_torque_Nm",
        "temperature": "motor temp (C)",
    }


# the step of an encoder


@pytest.mark.parametrize(("step", "told"), [(0.015, 0.0), (0.03, 0.03)])
def test_an_encoders_step_counts_from_a_fiftieth_of_an_arcmin(step, told):
    """At the output; a finer one no drive can tell from a line."""
    error = np.round(2.0 * np.sin(2.3 * THETA) / step) * step * ARCMIN
    assert steps_arcmin(rows_of(error=error))["error"] == pytest.approx(told, rel=1e-3)


@pytest.mark.parametrize(("off", "found"), [(0.017, 1.0), (0.025, 0.0)])
def test_levels_lie_on_a_grid_up_to_a_fiftieth_of_its_step(off, found):
    levels = np.arange(200) + off * np.r_[0.0, np.resize([1.0, -1.0], 198), 0.0]
    assert encoder_step(np.repeat(levels, 2)) == pytest.approx(found, rel=1e-3)


def test_the_step_is_that_between_neighbours_whatever_lies_far_off():
    """A pause of 100,000 steps is no step, and neither is a level written with other digits."""
    levels = np.r_[np.arange(200.0), np.arange(100_200.0, 100_400.0)]
    assert encoder_step(np.repeat(levels, 2)) == pytest.approx(1.0)
    assert encoder_step(np.repeat(np.r_[levels[:200], 50.0 + 0.01], 2)) == pytest.approx(1.0, rel=1e-3)


# passes and rows


def test_the_condition_of_a_pass():
    """Ten turns there in 20 s at 3 Nm and 21 deg C, six back in 6 s at -2 Nm and 25 deg C."""
    theta = np.r_[np.linspace(0, 10 * TURN, 2001), np.linspace(10 * TURN, 4 * TURN, 601)[1:]]
    there = np.arange(len(theta)) <= 2000
    made = recording(
        np.zeros(len(theta)),
        theta,
        time=0.01 * np.arange(len(theta)),
        torque=np.where(there, 3.0, -2.0),
        temperature=np.where(there, 21.0, 25.0),
    )
    out, back = conditions(made)
    assert (out.direction, out.torque, out.temperature) == (1.0, 3.0, 21.0)
    assert (back.direction, back.torque, back.temperature) == (-1.0, -2.0, 25.0)
    # A pass begins with the first row after the reversal.
    assert (out.turns, back.turns) == pytest.approx((10.0, 6.0 * 599 / 600))
    assert (out.speed, back.speed) == pytest.approx((TURN / 2, TURN))


def test_a_locked_record_has_forty_blocks_in_its_order():
    torque = 10 * np.sin(np.linspace(0, 2 * TURN, 200))
    rows = gather([recording(0.1 * torque, np.zeros(200), torque=torque, time=0.1 * np.arange(200))])
    assert rows.block.tolist() == [row // 5 for row in range(200)]


@pytest.mark.parametrize(("rest", "blocks"), [(30, 10), (37, 11)])
def test_a_third_of_a_turn_is_a_block(rest, blocks):
    theta = (np.arange(1000 + rest) + 0.5) * TURN / 100
    assert gather([recording(np.zeros(len(theta)), theta)]).blocks == blocks


# figures


def test_a_group_is_inseparable_where_one_of_its_orders_is():
    """Over 20 turns 2.045 and 2.048 are a sixteenth of a cycle apart, and 2.0 nine tenths of one from both."""
    theta = np.arange(20 * 100) * TURN / 100
    growth = error_growth(theta, [2.0, 2.045, 2.048])
    assert growth.min() < 3 < 10 < growth.max()
    assert inseparable_groups(theta, [2.0, 2.045, 2.048]) == ((2.0, 2.045, 2.048),)


@pytest.mark.parametrize("row", [792, 793, 794])
@pytest.mark.parametrize("height", [0.5, -0.5])
def test_counts_slip_once_either_way(height, row):
    """The cell that a slip lies in is an average of both sides: it shows on both of its edges, and is one slip."""
    theta = np.arange(4 * 360) * TURN / 360
    error = 0.1 * np.sin(2 * theta) + np.where(np.arange(len(theta)) > row, height, 0.0)
    ((place, found),) = figures.slips(figures.cells_of(recording(error, theta)), 0.0)
    # A cell has three samples of a degree; the wave bends by 0.1 x 4 arcmin a rad^2, over 0.15 rad at most 0.01.
    assert place == pytest.approx(theta[row], abs=0.06)
    assert found == pytest.approx(height, abs=0.02)


@pytest.mark.parametrize(("faster", "told"), [(1.105, False), (1.12, True)])
def test_a_delay_is_told_from_speeds_a_tenth_apart(faster, told):
    """The tenth is of the larger speed. The error of an output that is late by 2 ms grows by the speed at the output:
    2 ms x 1 turn a second / 80, 0.54 arcmin."""
    theta, time, error, start = [], [], [], 0.0
    for speed in (1.0, faster, 1.0, faster):
        for way in (1.0, -1.0):
            duration = 3.0 / speed
            t = np.arange(0, duration, 0.002)
            there = speed * t * TURN
            theta.append(there if way > 0 else there[-1] - there)
            time.append(start + t)
            error.append(np.full(len(t), 0.002 * way * speed * 21600 / RATIO))
            start += duration
    made = recording(np.concatenate(error), np.concatenate(theta), time=np.concatenate(time))
    found = figures.skew_s(made)
    assert (found is not None) == told
    if found is not None:
        assert found[0] == pytest.approx(0.002, rel=0.01)


@pytest.mark.parametrize(("value", "side"), [(0.5, "0.5 below 1"), (1.5, "0.5 above 1")])
def test_a_verdict_says_on_which_side_of_the_limit_the_value_is(value, side):
    assert f"{value} arcmin is {side}, guard band 0.16" in verdict_line(decide("rms", value, 0.1, 1.0), {})


@pytest.mark.parametrize(
    ("rows", "rest", "told"), [(500, 15, False), (500, 25, True), (6000, 40, False), (6000, 80, True)]
)
def test_a_drive_is_at_rest_for_twenty_rows_and_a_hundredth_of_the_record(rows, rest, told):
    """The torque rises to 4 Nm in the rest, and is 1 Nm while the input turns."""
    theta = np.r_[np.zeros(rest), 0.1 * np.arange(1, rows - rest + 1)]
    torque = np.r_[np.linspace(0.0, 4.0, rest), np.full(rows - rest, 1.0)]
    found = starting_torque_nm(recording(np.zeros(rows), theta, torque=torque))
    assert found == (pytest.approx(4.0) if told else None)


@pytest.mark.filterwarnings("error")
def test_a_place_that_no_sweep_reaches_has_no_mean_and_no_warning():
    """`hdopt inspect` said `RuntimeWarning: Mean of empty slice` where sweeps end apart."""
    curves = [np.array([1.0, 2.0, np.nan, np.nan]), np.array([np.nan, 4.0, 5.0, np.nan])]
    np.testing.assert_array_equal(mean_where_known(curves), [1.0, 3.0, 5.0, np.nan])


@pytest.mark.parametrize("knees", [(0.29, 0.61), (0.07, 0.15), (0.52, 0.93), (0.88, 0.95)])
def test_knees_are_found_between_the_places_tried(knees):
    """Slopes of 3, 2 and 1 arcmin over the largest torque, 20 Nm; places tried are 0.83 Nm apart, the curve's 0.25."""
    torque = np.concatenate([np.linspace(-20, 20, 801)[1:], np.linspace(20, -20, 801)[1:]] * 2)
    size = np.abs(torque) / 20
    first, second = knees
    parts = [np.minimum(size, first), np.clip(size - first, 0, second - first), np.maximum(size - second, 0)]
    windup = np.sign(torque) * (3 * parts[0] + 2 * parts[1] + 1 * parts[2])
    found = torsion_of(recording(windup, np.zeros(len(torque)), torque=torque))
    assert np.array(found.knees) / 20 == pytest.approx(knees, abs=0.012)
    nm_per_rad = [20 / (slope * ARCMIN) for slope in (3, 2, 1)]
    assert found.stiffness[:2] == pytest.approx(nm_per_rad[:2], rel=0.05)
