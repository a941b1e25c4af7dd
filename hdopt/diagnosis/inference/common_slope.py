"""A large slope of the error by the input angle, taken out of all recordings before anything is fitted.

A ratio or an encoder's gain that is off by a per mille makes an error of tens of arcmin, in which a drive's own of one
would be fitted as a trifle: its base would bend to the line, and its noise would be measured on it. So such a slope is
taken out first, and stays free beside every fit. An error that grows with the angle has two readings: the output moves
by another ratio, or the input angle itself is counted wrongly, and then every order of the drive stands elsewhere. How
well the base fits says which of them it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.settings import NuisanceSettings
from hdopt.drive.geometry import ARCMIN
from hdopt.recordings.recording import TURN, Recording


@dataclass(frozen=True)
class TakenSlope:
    """`slope` of the error by the input angle as recorded, rad/rad, that was taken out about `centre` (rad), of the
    recording's own angle; `input_gain`: how many times too far the input angle counts (1 where the output, or the
    ratio, is what is off).
    """

    slope: float
    centre: float
    input_gain: float = 1.0

    def columns(self, theta: Array) -> Array:
        """What stays free beside every fit at the input angles `theta` (n,), as corrected: (n, 1), arcmin for an error
        of one rad per rad of input.
        """
        return (theta - self.centre / self.input_gain)[:, None] / ARCMIN

    @property
    def turned(self) -> TakenSlope:
        """The same slope of recordings turned round: angle and error both change their sign."""
        return replace(self, centre=-self.centre)

    def of_input(self, ratio: float) -> TakenSlope:
        """The same slope where the input is what is counted wrongly: input / N grows too fast. `ratio` is N."""
        return replace(self, input_gain=1 / (1 - ratio * self.slope))

    def take_out(self, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
        """`recordings` without the slope, their input angles as the drive turned."""
        return tuple(
            replace(
                one,
                input_angle=one.input_angle / self.input_gain,
                error_arcmin=one.error_arcmin - self.slope / ARCMIN * (one.input_angle - self.centre),
            )
            for one in recordings
        )


def common_slope(recordings: Sequence[Recording], settings: NuisanceSettings) -> TakenSlope | None:
    """The slope that all `recordings` share, each with a zero of its own; None where it is no larger than the physics
    of a drive may make it, by the `settings`, or not most of what varies.
    """
    if any(one.input_locked for one in recordings):
        return None
    angles = [one.input_angle - one.input_angle.mean() for one in recordings]
    errors = [one.error_arcmin - one.error_arcmin.mean() for one in recordings]
    angle, error = np.concatenate(angles), np.concatenate(errors)
    travel = max(float(np.ptp(one)) for one in angles)
    power, varies = float(angle @ angle), float(error @ error)
    if travel < settings.slope_turns * TURN or power == 0 or varies == 0:
        return None
    slope = float(angle @ error) / power
    explained = slope**2 * power / varies
    if abs(slope) * travel < settings.slope_arcmin or explained < settings.slope_share:
        return None
    return TakenSlope(slope * ARCMIN, float(np.mean(recordings[0].input_angle)))


def input_is_off(as_recorded: Sequence[float], corrected: Sequence[float], settings: NuisanceSettings) -> bool:
    """Whether the base leaves less power with the input angle `corrected` than `as_recorded`, by the `settings`.

    Both are whitened sums of squares of fits made alike, of the base alone and beside smooth columns. All must say so:
    waves of the teeth bend a base beside smooth columns to either reading, but not the base alone.
    """
    return all(math.log(one / other) > settings.slope_axis for one, other in zip(as_recorded, corrected, strict=True))
