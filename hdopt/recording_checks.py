"""What is wrong with a recording: each fault is found, then repaired with a warning that says what was done, or
refused.

A repair never invents data: rows are dropped, angles unwrapped, a sign turned, whole turns put back across a gap.
Whatever would need a guess (a wrong ratio, exchanged columns, a clock that runs back and forth) is refused.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hdopt.drive import ARCMIN
from hdopt.errors import HdoptError
from hdopt.recording import TURN, Recording

Array = NDArray[np.float64]

FEWEST_ROWS = 50
"""Below this nothing can be told apart from the 12 parameters of the base model."""
LARGEST_LOSS = 0.5
"""Refuse a file that loses more than this share of its rows."""
RATIO_TOLERANCE = 0.01
"""Slope of output against input; a kinematic error cannot change it by a per cent over a tenth of a turn."""
GAP_FACTOR = 4.0
"""A step longer than this many typical ones is a gap."""


class Checks:
    """The channels of one recording on their way through the checks, with the warnings collected."""

    def __init__(self, channels: Mapping[str, Array], ratio: float, name: str) -> None:
        self.channels = dict(channels)
        self.ratio = ratio
        self.name = name
        self.warnings: list[str] = []
        self.rows_read = len(next(iter(channels.values())))

    def warn(self, text: str) -> None:
        self.warnings.append(f"{self.name}: {text}")

    def refuse(self, text: str) -> None:
        raise HdoptError(f"{self.name}: {text}")

    def keep(self, rows: NDArray) -> None:
        self.channels = {key: values[rows] for key, values in self.channels.items()}

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())))

    def get(self, channel: str) -> Array | None:
        return self.channels.get(channel)


def checked_recording(channels: Mapping[str, Array], ratio: float, name: str) -> Recording:
    """The recording in `channels` (rad, s, Nm, deg C) after every check; raises `HdoptError` where it is unusable."""
    checks = Checks(channels, ratio, name)
    drop_empty_channels(checks)
    if "output" not in checks.channels and "error" not in checks.channels:
        checks.refuse("neither an output angle nor an error was recorded; map one with --columns output=NAME:UNIT")
    drop_incomplete_rows(checks)
    order_rows_in_time(checks)
    drop_repeated_rows(checks)
    if len(checks) < FEWEST_ROWS:
        checks.refuse(
            f"{len(checks)} usable rows of {checks.rows_read}; at least {FEWEST_ROWS} are needed, "
            "record longer or sample faster"
        )
    lock_missing_input(checks)
    unwrap_angles(checks)
    turn_output_sign(checks)
    segment = find_gaps(checks)
    restore_whole_turns(checks, segment)
    check_ratio(checks)
    segment = drop_outliers(checks, segment)
    if len(checks) < LARGEST_LOSS * checks.rows_read:
        checks.refuse(
            f"only {len(checks)} of {checks.rows_read} rows are usable; more than half is lost, record again or "
            "cut the file to its sound part"
        )
    smooth_clock(checks)
    quantum = quantisation(checks)
    error = error_arcmin(checks)
    turns = float(np.ptp(checks.channels["input"])) / TURN
    if 0.02 <= turns < 2:
        checks.warn(f"the record covers {turns:.2g} input turns; little can be told from less than a few whole turns")
    return Recording(
        name=name,
        ratio=ratio,
        input_angle=checks.channels["input"],
        error_arcmin=error,
        time=checks.get("time"),
        torque=checks.get("torque"),
        temperature=checks.get("temperature"),
        segment=segment,
        quantum_arcmin=quantum,
        warnings=tuple(checks.warnings),
    )


def error_arcmin(checks: Checks) -> Array:
    """KE = input/N - output in arcmin, or the error as it was recorded."""
    if "error" in checks.channels:
        return checks.channels["error"] / ARCMIN
    return (checks.channels["input"] / checks.ratio - checks.channels["output"]) / ARCMIN


def drop_empty_channels(checks: Checks) -> None:
    """An optional channel without any number is no channel."""
    for channel in ("time", "torque", "temperature"):
        values = checks.get(channel)
        if values is not None and not np.isfinite(values).any():
            checks.warn(f"the {channel} column holds no numbers and is left out")
            del checks.channels[channel]


def drop_incomplete_rows(checks: Checks) -> None:
    """Rows with a NaN, an infinity or text where a number is due."""
    for channel in ("torque", "temperature"):
        values = checks.get(channel)
        if values is not None and 0 < (~np.isfinite(values)).mean() <= 0.9:
            # A slow channel is often logged at a lower rate than the angles: interpolate it instead of losing the rows.
            good = np.isfinite(values)
            if good.mean() < 0.9:
                index = np.arange(len(values))
                checks.channels[channel] = np.interp(index, index[good], values[good])
                checks.warn(f"{channel} is given in {good.mean():.0%} of the rows and interpolated between them")
    good = np.all([np.isfinite(values) for values in checks.channels.values()], axis=0)
    lost = int((~good).sum())
    if lost:
        checks.keep(good)
        checks.warn(f"{lost} rows with missing values dropped")
    if lost > LARGEST_LOSS * checks.rows_read:
        checks.refuse(f"{lost} of {checks.rows_read} rows hold missing values; more than half is lost")


def order_rows_in_time(checks: Checks) -> None:
    """Rows out of order are sorted where few; a clock that keeps running backward is refused."""
    time = checks.get("time")
    if time is None or len(time) < 2:
        return
    backward = np.diff(time) < 0
    if not backward.any():
        return
    share = backward.mean()
    if share > 0.5:
        checks.refuse("time runs backward through most of the file; reverse the rows, or map time=NAME:-s")
    if share > 0.02:
        checks.refuse(
            f"time runs backward at {int(backward.sum())} of {len(time)} rows; recordings may have been joined: "
            "split the file, or leave time out of --columns"
        )
    # A restarted clock: the angles go on although the time starts anew.
    jumps = np.flatnonzero(backward)
    if np.any(time[jumps + 1] <= time[0] + 0.01 * np.ptp(time)) and np.ptp(time) > 0:
        checks.refuse(
            f"the clock starts anew at row {int(jumps[0]) + 2}; the file joins several recordings: split it there"
        )
    checks.keep(np.argsort(time, kind="stable"))
    checks.warn(f"{int(backward.sum())} rows were out of order in time and have been sorted")


def drop_repeated_rows(checks: Checks) -> None:
    """A row whose time equals the one before it was written twice."""
    time = checks.get("time")
    if time is None or len(time) < 2:
        return
    same = np.r_[False, np.diff(time) == 0]
    if same.any():
        if same.mean() > LARGEST_LOSS:
            checks.refuse(
                f"{int(same.sum())} of {len(time)} rows repeat the time of the row before; "
                "time is too coarse: write it with more digits, or leave it out of --columns"
            )
        checks.keep(~same)
        checks.warn(f"{int(same.sum())} repeated rows dropped")


def lock_missing_input(checks: Checks) -> None:
    """Without an input channel the input was locked: only torque moved."""
    if "input" in checks.channels:
        if np.ptp(checks.channels["input"]) == 0 and checks.get("torque") is None:
            checks.refuse("the input angle never changes and no torque was recorded; there is nothing to explain")
        return
    if checks.get("torque") is None:
        checks.refuse("no input angle was recorded; map one with --columns input=NAME:UNIT")
    checks.channels["input"] = np.zeros(len(checks))


def unwrap_angles(checks: Checks) -> None:
    """Angles that jump back by a whole turn are counted on."""
    for channel in ("input", "output"):
        angle = checks.get(channel)
        if angle is None or len(angle) < 3:
            continue
        steps = np.diff(angle)
        jumps = np.abs(steps) > 0.5 * TURN
        if not jumps.any() or np.ptp(angle) > 1.02 * TURN:
            continue
        typical = np.median(np.abs(steps[~jumps])) if (~jumps).any() else TURN
        if jumps.mean() > 0.4 or typical > 0.3 * TURN:
            checks.refuse(
                f"the {channel} angle is wrapped to one turn and moves about {typical / TURN:.2g} turns a sample; "
                "the turns cannot be counted: sample faster, or record it unwrapped"
            )
        checks.channels[channel] = np.unwrap(angle, period=TURN)
        checks.warn(f"the {channel} angle was wrapped to one turn and has been unwrapped at {int(jumps.sum())} places")


def turn_output_sign(checks: Checks) -> None:
    """An output counted against the input is turned around."""
    output = checks.get("output")
    if output is None:
        return
    slope, travel = output_slope(checks)
    if travel > 0.05 * TURN and slope < -0.5:
        checks.channels["output"] = -output
        checks.warn("the output was counted against the input; its sign has been turned around")


def output_slope(checks: Checks) -> tuple[float, float]:
    """Slope of N x output against input by differences (gaps and lost turns do not move it), and the input's travel."""
    angle, output = checks.channels["input"], checks.channels["output"]
    lag = max(1, len(angle) // 400)
    d_in, d_out = angle[lag:] - angle[:-lag], output[lag:] - output[:-lag]
    usable = np.abs(d_in) > 0.25 * np.quantile(np.abs(d_in), 0.9)
    if not usable.any() or np.ptp(angle) == 0:
        return 1.0, 0.0
    # The median of local slopes: robust against wraps and gaps.
    return checks.ratio * float(np.median(d_out[usable] / d_in[usable])), float(np.ptp(angle))


def check_ratio(checks: Checks) -> None:
    """Refuse a ratio that the angles contradict."""
    if "output" not in checks.channels:
        return
    angle, output = checks.channels["input"], checks.channels["output"]
    if max(np.ptp(angle), np.ptp(output)) < 0.1 * TURN or np.ptp(angle) == 0:
        return
    centred = angle - angle.mean()
    slope = checks.ratio * float(centred @ (output - output.mean()) / (centred @ centred))
    drift = abs(slope - 1) * np.ptp(angle) / checks.ratio / ARCMIN
    if abs(slope - 1) <= RATIO_TOLERANCE or drift < 30:
        return
    if abs(slope) < 1e-6:
        checks.refuse("the output angle does not follow the input; check which columns are mapped")
    found = checks.ratio / slope
    hint = "check the ratio"
    if abs(slope / checks.ratio**2 - 1) < 0.05:
        hint = "input and output look exchanged"
    elif any(abs(abs(slope) * factor - 1) < 0.05 for factor in (math.degrees(1), math.radians(1))):
        hint = "one angle looks to be in degrees and the other in radians; check the units in --columns"
    elif abs(abs(found) - (checks.ratio + 1)) < 0.3:
        hint = "this is N + 1: the circular spline is the output here, give --ratio accordingly"
    checks.refuse(f"the output moves as for a ratio of {found:.6g}, the ratio given is {checks.ratio:g}; {hint}")


def find_gaps(checks: Checks) -> NDArray[np.int64]:
    """Segment number of each row: it counts up where time (or, without time, the input) jumps."""
    time, angle = checks.get("time"), checks.channels["input"]
    steps = np.diff(time) if time is not None else np.abs(np.diff(angle))
    typical = np.median(steps[steps > 0]) if (steps > 0).any() else 0.0
    gaps = steps > GAP_FACTOR * typical if typical > 0 else np.zeros(len(steps), bool)
    if time is None:
        # A speed that varies is no gap: only steps far from their neighbours count.
        gaps &= steps > 0.02 * TURN
    if gaps.any():
        what = f"{steps[gaps].sum():.3g} s" if time is not None else f"{steps[gaps].sum() / TURN:.3g} input turns"
        checks.warn(f"{int(gaps.sum())} gaps ({what} missing in all); the parts are kept apart")
    return np.r_[0, np.cumsum(gaps)].astype(np.int64)


def restore_whole_turns(checks: Checks, segment: NDArray[np.int64]) -> None:
    """Whole turns lost in a gap of a wrapped angle are put back: the error must not jump by a whole turn."""
    if "output" not in checks.channels or segment[-1] == 0:
        return
    angle, output = checks.channels["input"], checks.channels["output"]
    starts = np.flatnonzero(np.diff(segment)) + 1
    restored = 0
    for start in starts:
        jump = (angle[start] - angle[start - 1]) - checks.ratio * (output[start] - output[start - 1])
        turns = round(jump / TURN)
        if turns and abs(jump - turns * TURN) < 0.2 * TURN:
            angle = np.r_[angle[:start], angle[start:] - turns * TURN]
            restored += 1
    if restored:
        checks.channels["input"] = angle
        checks.warn(f"whole input turns lost in {restored} gaps have been put back")


def drop_outliers(checks: Checks, segment: NDArray[np.int64]) -> NDArray[np.int64]:
    """Single samples far from their neighbours, forward and back at once, are read-out faults."""
    error = error_arcmin(checks)
    if len(error) < 20:
        return segment
    from scipy.ndimage import median_filter

    off = np.abs(error - median_filter(error, size=7, mode="nearest"))
    scale = 1.4826 * np.median(off) + 1e-12
    spikes = off > max(25 * scale, 1.0)
    if 0 < spikes.mean() <= 0.02:
        checks.keep(~spikes)
        checks.warn(f"{int(spikes.sum())} samples far from their neighbours (backward jumps, read-out faults) dropped")
        return segment[~spikes]
    return segment


def smooth_clock(checks: Checks) -> None:
    """Time stamps that jitter about an even clock are replaced by the even clock."""
    time = checks.get("time")
    if time is None or len(time) < FEWEST_ROWS:
        return
    steps = np.diff(time)
    typical = np.median(steps)
    usual = steps[steps < GAP_FACTOR * typical]
    jitter = 1.4826 * np.median(np.abs(usual - typical)) / typical if typical > 0 else 0.0
    if jitter > 0.02:
        checks.warn(
            f"the clock jitters by {jitter:.0%} of a sample interval; speeds are taken over several samples; a delay "
            "between channels is known only to that"
        )


def quantisation(checks: Checks) -> float:
    """Step of the coarser encoder in arcmin at the output, 0 where none shows."""
    quantum = 0.0
    channels = {"input": 1 / checks.ratio, "output": 1.0, "error": 1.0}
    for channel, gain in channels.items():
        angle = checks.get(channel)
        if angle is None:
            continue
        levels = np.unique(angle)
        # Steps show where the angle stands still for a sample or more while it should move.
        if len(levels) < 3 or np.mean(np.diff(angle) == 0) < 0.1:
            continue
        step = float(np.median(np.diff(levels))) * gain / ARCMIN
        quantum = max(quantum, step)
    noise = np.median(np.abs(np.diff(error_arcmin(checks))))
    if quantum > 0.02 and quantum > 0.3 * noise:
        checks.warn(
            f"the angles move in steps of {quantum:.2g} arcmin at the output; smaller effects hide between them"
        )
    return quantum
