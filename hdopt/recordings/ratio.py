"""Whether the angles agree with the ratio: N against N + 1, a nameplate that is off by one, an encoder's gain."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hdopt.drive.geometry import ARCMIN
from hdopt.recordings.recording import TURN
from hdopt.recordings.repairs import Checks

RATIO_TOLERANCE = 0.01
"""Slope of output against input; a kinematic error cannot change it by a per cent over a tenth of a turn."""
LEAST_DRIFT_ARCMIN = 30.0
"""A slope that is off by less than this over the whole record may be windup or play on a short stroke."""
INTEGER_SHARE = 0.2
"""The record decides between whole ratios where its uncertainty is below this share of their distance."""


@dataclass(frozen=True)
class Scale:
    """Slope of N x output against input: `slope` with its `uncertainty` (95 %, both relative to 1), and the `ratio`
    that it means."""

    slope: float
    uncertainty: float
    ratio: float


def measured_scale(checks: Checks) -> Scale | None:
    """The ratio that the angles show by least squares; None where they move too little, or only an error was recorded.

    The kinematic error itself bends the line: what is left of it, peak to peak, over the output's travel bounds the
    error of the slope.

    `checks` holds the rows so far.
    """
    if "output" not in checks.channels:
        return None
    angle, output = checks.channels["input"], checks.channels["output"]
    if max(np.ptp(angle), np.ptp(output)) < 0.1 * TURN or np.ptp(angle) == 0:
        return None
    centred = angle - angle.mean()
    slope = checks.ratio * float(centred @ (output - output.mean()) / (centred @ centred))
    left = checks.ratio * (output - output.mean()) - slope * centred
    low, high = np.quantile(left, [0.005, 0.995])
    uncertainty = float(high - low) / float(np.ptp(angle))
    return Scale(slope, uncertainty, checks.ratio / slope if slope else math.inf)


def check_ratio(checks: Checks) -> None:
    """Refuse a ratio that the angles contradict; say what they confirm, and what the record is too short to tell.

    `checks` holds the rows so far, and is changed in place.
    """
    scale = measured_scale(checks)
    if scale is None:
        return
    off, doubt, given = scale.slope - 1, scale.uncertainty, checks.ratio
    travel = float(np.ptp(checks.channels["input"])) / given / ARCMIN
    if abs(scale.slope) < 1e-6:
        checks.refuse("the output angle does not follow the input; check which columns are mapped")
    whole = round(abs(scale.ratio))
    decided = doubt * given < INTEGER_SHARE
    if decided and whole != round(given) and abs(abs(scale.ratio) - whole) < max(doubt * given, 0.01) * 1.5:
        _refuse(checks, scale)
    if abs(off) > RATIO_TOLERANCE and abs(off) * travel >= LEAST_DRIFT_ARCMIN:
        _refuse(checks, scale)
    if abs(off) > doubt and abs(off) * travel > 0.2:
        checks.warn(
            f"the output moves {off:+.2%} against input/{given:g} (to {doubt:.1g}), a drift of "
            f"{abs(off) * TURN / given / ARCMIN:.2g} arcmin an input turn: an encoder's gain or counts, or the ratio"
        )
    elif decided:
        checks.say(f"the angles confirm the ratio of {given:g} within {max(abs(off), doubt):.1g} of it")
    else:
        checks.say(
            f"the ratio of {given:g} is taken as given: the record is too short to tell it from {given + 1:g} or "
            f"{max(given - 1, 1):g}"
        )


def _refuse(checks: Checks, scale: Scale) -> None:
    found, given = scale.ratio, checks.ratio
    gear = f"a gear before the input encoder: /gear{1 / abs(scale.slope):.4g}"
    hint = f"check the ratio, the columns and their units ({gear})"
    if abs(scale.slope / given**2 - 1) < 0.05:
        hint = "input and output look exchanged"
    elif any(abs(abs(scale.slope) * factor - 1) < 0.05 for factor in (math.degrees(1), math.radians(1))):
        hint = "one angle looks to be in degrees and the other in radians; check the units in --columns"
    elif any(abs(abs(scale.slope) * factor - 1) < 0.02 for factor in (360, 1 / 360)):
        hint = "one angle looks to be in turns and the other in degrees; check the units in --columns"
    elif abs(abs(found) - (given + 1)) < 0.3:
        hint = (
            f"this is N + 1: of a strain wave gear the circular spline is the output here, or the nameplate is off by "
            f"one; if so give --drive none --ratio {round(abs(found))}, or a study with these teeth"
        )
    elif abs(abs(found) - (given - 1)) < 0.3:
        hint = (
            f"this is N - 1: of a strain wave gear the ratio given is that of the circular spline as output, or off by "
            f"one; if so give --drive none --ratio {round(abs(found))}, or a study with these teeth"
        )
    checks.refuse(f"the output moves as for a ratio of {found:.6g}, the ratio given is {given:g}; {hint}")
