"""A coarse output encoder: its steps taken out of the error wherever a smooth model says between which it stood.

An encoder of 12 or 14 bits reads the nearest of its steps. What that adds to the error is no noise: it is a sawtooth of
the output angle, which a steady sampling folds down to a few sharp orders that no physics of the drive has. With a
model m of the error that is right to a small part of a step q, the reading nearest to the model's own output is known,
and what is left is whole steps: the error is m + q round((e - m)/q). Over the places within a step its mean is the true
error whatever m was (a uniform dither: Widrow, Kollar, Quantization Noise, 2008, ch. 19), its scatter the root of q
times what m misses, in place of q/sqrt(12), and no order stands out of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from hdopt.arrays import Array
from hdopt.diagnosis.inference.neighbour_noise import noise_between_neighbours
from hdopt.diagnosis.settings import EncoderStepSettings
from hdopt.recordings.recording import OF_ROUNDING, Recording
from hdopt.recordings.rows import gather, neighbours_for

Smooth = Callable[[Sequence[Recording]], Array]
"""A smooth model of recordings: its errors (arcmin) on their averaged rows, (n,)."""


def without_output_steps(
    recordings: Sequence[Recording], smooth: Smooth, settings: EncoderStepSettings
) -> tuple[Recording, ...]:
    """`recordings` with the steps of their output encoder taken out about the model that `smooth` fits to them; as they
    are, with no step, where none shows or where something else is larger, by the `settings`.
    """
    step = max(one.output_step_arcmin for one in recordings)
    fine = tuple(replace(one, output_step_arcmin=0.0) for one in recordings)
    neighbours = noise_between_neighbours(recordings)
    if any(one.input_locked for one in recordings) or step <= settings.share_of_scatter * neighbours:
        return fine
    recordings = tuple(replace(one, output_step_arcmin=step) for one in recordings)
    found, scatter = recordings, math.inf
    for _ in range(settings.rounds):
        model = on_samples(recordings, smooth(found))
        left = [one.error_arcmin - m for one, m in zip(recordings, model, strict=True)]
        as_read = float(np.std(np.concatenate(left)))
        if not _is_most(step, as_read, settings):
            return fine
        now = float(np.std(np.concatenate([step * np.round(one / step) for one in left])))
        if now > settings.worth_a_round * scatter:
            break
        scatter = now
        noise = noise_before_reading(step, scatter)
        freed = [parted - added_by_reading(parted, step, noise) for parted in left]
        found = tuple(
            replace(one, error_arcmin=m + scattered, scatter_arcmin=scattered)
            for one, m, scattered in zip(recordings, model, freed, strict=True)
        )
    return found


def noise_before_reading(step: float, scatter: float) -> float:
    """Standard deviation (arcmin) of normal noise s before the nearest `step` (arcmin) is read, from the `scatter`
    (arcmin) of the whole steps that it makes: at an edge u away a reading is wrong by one step with the chance
    Phi(-|u|/s), so that scatter^2 = q s sqrt(2/pi) while s is small beside q."""
    return scatter**2 / (step * math.sqrt(2 / math.pi))


def added_by_reading(left: Array, step: float, noise: float) -> Array:
    """What reading the nearest `step` q (arcmin) adds to an error on the mean (arcmin, like `left`), where `noise` s
    (arcmin) precedes it: q (Phi((z - q/2)/s) - Phi((-z - q/2)/s)) - z. The place z of the output within its step is
    known from what is `left` (n,) of the error about a model, both arcmin, but for whole steps."""
    place = step * np.round(left / step) - left
    if noise == 0:
        return -place
    return step * (ndtr((place - step / 2) / noise) - ndtr((-place - step / 2) / noise)) - place


def _is_most(step: float, scatter: float, settings: EncoderStepSettings) -> bool:
    """Whether what a `step` adds is there and most of a `scatter`, both arcmin."""
    added = OF_ROUNDING * step
    return settings.share_of_scatter * scatter < added < scatter / settings.share_of_scatter


def on_samples(recordings: Sequence[Recording], values: Array) -> list[Array]:
    """`values` (n,) of the averaged rows of `recordings` on the samples of each, by straight lines."""
    counted = [replace(one, error_arcmin=np.arange(len(one), dtype=float)) for one in recordings]
    rows = gather(counted, neighbours_for(recordings))
    return [
        np.interp(np.arange(len(one)), rows.error[rows.record == i], values[rows.record == i])
        for i, one in enumerate(recordings)
    ]
