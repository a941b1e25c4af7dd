"""A coarse input encoder: what reading its steps adds, taken out of the error where the motion says what it is.

An input encoder of 2,000 or 4,096 counts reads the nearest of its steps. At a steady speed and sampling this sawtooth
folds down to sharp orders, alike there and back, that no physics of the drive has and no phase gives away. But the
motion between the steps is smoother than the steps: a cubic over some ten samples about each (Savitzky and Golay, Anal.
Chem. 36, 1964) says where the input stood, and the reading less that is what was added, r. If that is so, the error
holds r once: its regression on r is 1. Where the input itself moved so, its own ripple, the output followed and the
error holds nothing of it: the regression is less, and nothing is taken out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.diagnosis.numerical import TINY
from hdopt.diagnosis.settings import EncoderStepSettings
from hdopt.drive.geometry import ARCMIN
from hdopt.recordings.recording import Recording


def without_input_steps(recordings: Sequence[Recording], settings: EncoderStepSettings) -> tuple[Recording, ...]:
    """`recordings` with the steps of their input encoder taken out of angle and error, each by itself; as they are
    where none shows, where the motion between them is not smooth, or where the error does not hold them, by the
    `settings`.
    """
    return tuple(_smoothed(one, settings) for one in recordings)


def _smoothed(recording: Recording, settings: EncoderStepSettings) -> Recording:
    """One `recording` without the steps of its input, or as it is."""
    step = recording.input_step_arcmin
    if step == 0 or recording.input_locked:
        return recording
    in_steps = recording.input_angle / recording.ratio / ARCMIN / step
    added, error = np.zeros(len(recording)), np.zeros(len(recording))
    for rows in _pieces(recording):
        added[rows], error[rows] = beyond_smooth(in_steps[rows], recording.error_arcmin[rows] / step, settings)
    share, spread = regression(error, added)
    if spread > settings.known_to or abs(share - 1) > settings.off_by:
        return recording
    return replace(
        recording,
        input_angle=recording.input_angle - added * (step * recording.ratio * ARCMIN),
        error_arcmin=recording.error_arcmin - added * step,
    )


def _pieces(recording: Recording) -> list[slice]:
    """The rows of each part between gaps of a `recording`."""
    n = len(recording)
    ends = [] if recording.segment is None else (np.flatnonzero(np.diff(recording.segment)) + 1).tolist()
    return [slice(*both) for both in zip([0, *ends], [*ends, n], strict=True)]


def beyond_smooth(angle: Array, error: Array, settings: EncoderStepSettings) -> tuple[Array, Array]:
    """What the read `angle` (n,), in steps, has beyond a smooth motion, and the `error` (n,) beyond the same smoothing,
    (n,) each: over the widest of the `settings`' windows throughout which no reading is farther off than a step's
    half allows; 0 where none is.
    """
    beyond, of_error = np.zeros(len(angle)), np.zeros(len(angle))
    for window in settings.smooth_over:
        if len(angle) < window:
            break
        off = angle - smoothed(angle, window, settings.smooth_degree)
        smooth = hold_throughout(np.abs(off) < settings.farthest_off, window)
        beyond = np.where(smooth, off, beyond)
        of_error = np.where(smooth, error - smoothed(error, window, settings.smooth_degree), of_error)
    return beyond, of_error


def hold_throughout(flags: Mask, window: int) -> Mask:
    """Whether all of the `window` of `flags` (n,) about each hold, an odd number, as far as there are so many, (n,)."""
    half, place = window // 2, np.arange(len(flags))
    missed = np.r_[0, np.cumsum(~flags)]
    from_here, to_there = np.maximum(place - half, 0), np.minimum(place + half + 1, len(flags))
    return np.asarray(missed[to_there] == missed[from_here])


def regression(error: Array, added: Array) -> tuple[float, float]:
    """Coefficient of the regression of `error` (n,) on what was `added` (n,), and its standard deviation; infinite
    where nothing was."""
    power = float(added @ added)
    if power < TINY:
        return 0.0, math.inf
    share = float(added @ error) / power
    return share, float(np.std((error - share * added)[added != 0])) / math.sqrt(power)


def smoothed(values: Array, window: int, degree: int) -> Array:
    """`values` (n,), n >= `window`, each by the polynomial of a `degree` fitted to the `window` samples about it, an
    odd number; by the first and the last such at the ends. As `scipy.signal.savgol_filter`, which loads all of
    `scipy.stats` for a second.
    """
    powers = np.vander(np.linspace(-1.0, 1.0, window), degree + 1)
    fitted = powers @ np.linalg.pinv(powers)
    half = window // 2
    found = np.convolve(values, fitted[half], "same")
    found[:half], found[-half:] = fitted[:half] @ values[:window], fitted[-half:] @ values[-window:]
    return np.asarray(found)
