"""What is wrong with a recording: each fault is found, then repaired with a warning that says what was done, or
refused.

A repair never invents data: rows are dropped, angles unwrapped, a sign turned, whole turns put back across a gap.
Whatever would need a guess (a wrong ratio, exchanged columns, a clock that runs back and forth) is refused.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import ARCMIN
from hdopt.recordings.encoder_step import encoder_step
from hdopt.recordings.ratio import check_ratio
from hdopt.recordings.recording import TURN, Recording
from hdopt.recordings.repairs import (
    GAP_FACTOR,
    LARGEST_LOSS,
    Checks,
    drop_empty_channels,
    drop_incomplete_rows,
    drop_outliers,
    drop_repeated_rows,
    error_arcmin,
    find_gaps,
    lock_missing_input,
    order_rows_in_time,
    restore_whole_turns,
    unwrap_angles,
)
from hdopt.words import counted

FEWEST_ROWS = 50
"""Below this nothing can be told apart from the 12 parameters of the base model."""
ARE_THE_SAME = 0.999
"""Correlation from which an error column is the input angle itself."""
SMALLEST_STEP_ARCMIN = 0.02
"""A finer grid is that of the digits written, or of an encoder that no drive can tell from a line."""
HIDDEN_BY_NOISE = 0.3
"""Steps below this share of the usual change between samples are lost in it."""
LARGEST_ERROR_ARCMIN = 600.0
SMALLEST_ERROR_ARCMIN = 1e-3
"""An error beyond these is in another unit than stated, or no error: drives have 0.1 to 60 arcmin."""


def checked_recording(channels: Mapping[str, Array], ratio: float, name: str) -> Recording:
    """The recording in `channels` (rad, s, Nm, deg C) after every check; raises `HdoptError` where it is unusable.

    `ratio` is the reduction N; `name` stands in every message.
    """
    checks = Checks(channels, ratio, name)
    drop_empty_channels(checks)
    if "output" not in checks.channels and "error" not in checks.channels:
        checks.refuse("neither an output angle nor an error was recorded; map one with --columns output=NAME:UNIT")
    drop_incomplete_rows(checks)
    order_rows_in_time(checks)
    drop_repeated_rows(checks)
    if len(checks) < FEWEST_ROWS:
        checks.refuse(
            f"{counted(len(checks), 'usable row')} of {checks.rows_read}; at least {FEWEST_ROWS} are needed, "
            "record longer or sample faster"
        )
    lock_missing_input(checks)
    check_error_column(checks)
    unwrap_angles(checks)
    reversed_output = turn_output_sign(checks)
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
    steps = steps_arcmin(checks)
    quantum = max(steps.values())
    warn_of_steps(checks, quantum)
    error = error_arcmin(checks)
    turns = float(np.ptp(checks.channels["input"])) / TURN
    if 0.02 <= turns < 2:
        covered = counted(f"{turns:.2g}", "input turn")
        checks.warn(f"the record covers {covered}; little can be told from less than a few whole turns")
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
        output_step_arcmin=steps["output"],
        input_step_arcmin=steps["input"],
        warnings=tuple(checks.warnings),
        understood=tuple(checks.said),
        output_reversed=reversed_output,
    )


def check_error_column(checks: Checks) -> None:
    """Refuse an error column that is zero or is the input angle; doubt one of a size that no drive has.

    `checks` holds the rows so far, and is changed in place.
    """
    error, angle = checks.get("error"), checks.channels["input"]
    if error is None:
        return
    size = float(np.ptp(error)) / ARCMIN
    if size == 0:
        checks.refuse("the error column is the same number throughout; map the column that holds the error")
    moves = float(np.ptp(angle)) >= 0.02 * TURN
    if moves and abs(float(np.corrcoef(angle, error)[0, 1])) > ARE_THE_SAME and size > 60:
        checks.refuse(
            "the error column follows the input angle: it is an angle, not an error; map it as output=NAME:UNIT, or "
            "name the error column"
        )
    if moves and not SMALLEST_ERROR_ARCMIN < size < LARGEST_ERROR_ARCMIN:
        checks.warn(f"the error spans {size:.3g} arcmin, which no drive has; check its unit (arcmin, arcsec, deg, rad)")


def turn_output_sign(checks: Checks) -> bool:
    """Turn around an output that is counted against the input; whether that was so.

    `checks` holds the rows so far, and is changed in place.
    """
    output = checks.get("output")
    if output is None:
        return False
    slope, travel = output_slope(checks)
    if travel <= 0.05 * TURN or slope >= -0.5:
        return False
    checks.channels["output"] = -output
    checks.warn("the output was counted against the input; its sign has been turned around")
    return True


def output_slope(checks: Checks) -> tuple[float, float]:
    """Slope of N x output against input by differences (gaps and lost turns do not move it), and the input's travel.

    `checks` holds the rows so far.
    """
    angle, output = checks.channels["input"], checks.channels["output"]
    lag = max(1, len(angle) // 400)
    d_in, d_out = angle[lag:] - angle[:-lag], output[lag:] - output[:-lag]
    usable = np.abs(d_in) > 0.25 * np.quantile(np.abs(d_in), 0.9)
    if not usable.any() or np.ptp(angle) == 0:
        return 1.0, 0.0
    # The median of local slopes: robust against wraps and gaps.
    return checks.ratio * float(np.median(d_out[usable] / d_in[usable])), float(np.ptp(angle))


def smooth_clock(checks: Checks) -> None:
    """Time stamps that jitter about an even clock are replaced by the even clock.

    `checks` holds the rows so far, and is changed in place.
    """
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


def steps_arcmin(checks: Checks) -> dict[str, float]:
    """Step of each channel's encoder in arcmin at the output, 0 where none shows that matters. `checks` holds the rows
    so far."""
    found = {}
    for channel, gain in (("input", 1 / checks.ratio), ("output", 1.0), ("error", 1.0)):
        angle = checks.get(channel)
        step = 0.0 if angle is None else encoder_step(angle, checks.get("time")) * gain / ARCMIN
        found[channel] = step if step > SMALLEST_STEP_ARCMIN else 0.0
    return found


def warn_of_steps(checks: Checks, quantum: float) -> None:
    """Say that the angles move in steps of `quantum` (arcmin at the output) where the noise does not hide them.

    `checks` holds the rows so far.
    """
    noise = np.median(np.abs(np.diff(error_arcmin(checks))))
    if quantum > HIDDEN_BY_NOISE * noise:
        checks.warn(
            f"the angles move in steps of {quantum:.2g} arcmin at the output; smaller effects hide between them"
        )
