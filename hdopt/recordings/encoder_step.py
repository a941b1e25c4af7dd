"""The step of an encoder, read off the angles that it gave: all of them lie on one even grid."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array

FEWEST_LEVELS = 20
"""Different angles from which a grid can be told."""
NEIGHBOURS = 0.05
"""Part of the usual distance between levels below which two are one, written with other digits."""
ON_THE_GRID = 0.02
"""How far from the grid, in steps, a level may lie by its written digits."""
ALL_ALIKE = 0.98
"""Share of the samples that move alike from which their evenness, not an encoder, makes the grid."""
ROW_LOST = 1.5
"""Usual time steps above which a row was lost in between: its move is that of two samples."""
PARTS = (1, 2, 3, 4, 5, 6)
"""Steps that the smallest distance between two levels may be."""
NEARLY_ALL = 0.99
"""Share of the levels that must lie on the grid: a few may be repaired rows. Of 20 levels off a grid a chance of
(2 x 0.02)^20 puts them all on it."""


def encoder_step(angle: Array, time: Array | None = None) -> float:
    """Step of the even grid on which the values of `angle` (n,) lie, in their unit; 0 where there is none.

    Levels may be left out, as where the output moves by several steps from sample to sample. The step is the smallest
    distance between levels, or a whole part of it, or what two distances differ by, made precise over ever more of
    them. `time` (n,) s, where it is
    known, tells where rows were lost: samples taken at even angles are then still seen to be even.
    """
    levels = np.unique(angle)
    apart = np.diff(levels)
    if len(levels) < FEWEST_LEVELS:
        return 0.0
    apart = apart[apart > NEIGHBOURS * np.median(apart)]
    tried = [float(apart.min()) / part for part in PARTS]
    # Of moves by eight or nine steps no small part of either is one step, but what they differ by is.
    differ = np.diff(np.unique(apart))
    tried += [float(one) for one in differ[differ > NEIGHBOURS * apart.min()][:1]]
    step = next((step for one in tried if (step := _refined(levels, one)) > 0), 0.0)
    return step if step > 0 and not _is_sampled_evenly(angle, step, time) else 0.0


def _is_sampled_evenly(angle: Array, step: float, time: Array | None) -> bool:
    """Whether nearly every sample moves on by the same number of steps: then the grid is that of the sampling. One that
    mostly stands still is an encoder's that is slower than its samples."""
    moves = np.abs(np.round(np.diff(angle) / step))
    if time is not None:
        between = np.diff(time)
        moves = moves[between < ROW_LOST * np.median(between)]
    if not len(moves):
        return False
    found, counts = np.unique(moves, return_counts=True)
    return bool(found[np.argmax(counts)] > 0 and counts.max() > ALL_ALIKE * len(moves))


def _refined(levels: Array, step: float) -> float:
    """`step` made precise over ever more of the `levels` (n,); 0 where they do not lie on its grid."""
    reach = 1
    while reach < len(levels) - 1:
        reach = min(2 * reach, len(levels) - 1)
        steps = round(float(levels[reach] - levels[0]) / step)
        step = float(levels[reach] - levels[0]) / max(steps, 1)
    places = (levels - levels[0]) / step
    return step if np.mean(np.abs(places - np.round(places)) < ON_THE_GRID) > NEARLY_ALL else 0.0
