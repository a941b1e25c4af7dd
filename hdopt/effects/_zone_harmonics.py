"""Shared by the effects that act inside the meshing zones: harmonics of a deviation round one of the splines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array
from hdopt.effects.sines import sine_columns


def zone_harmonics(phase: Array, harmonics: Sequence[int]) -> Array:
    """sin and cos of each harmonic as met in zone 1 (`phase`) and in zone 2, half a turn on: shape (2, n, 2 k).

    sin(h (x + pi)) = (-1)^h sin(h x): even harmonics are alike in both zones, odd ones opposite (Jia 2021,
    Eqs. (31a), (31b), carried to h > 1). Every column lies in one piece, as filters and products read it.
    """
    first = sine_columns(phase, harmonics).T
    rows = np.empty((2, *first.shape))
    rows[0] = first
    np.multiply(first, np.repeat([(-1.0) ** h for h in harmonics], 2)[:, None], out=rows[1])
    return rows.transpose(0, 2, 1)


LEAST_PART = 0.002
"""Part of what a few harmonics explain that the least of them must add: less is what a shape leaves."""


def strongest_few(gram: Array, moment: Array, members: Sequence[int], most: int) -> list[tuple[int, ...]]:
    """The best harmonic of `members`, the best two with it, and so on up to `most`, each set in rising order.

    `gram` (2 k, 2 k) and `moment` (2 k,) are the inner products of the harmonics' columns with each other and with the
    residual.
    """

    def gain(chosen: Sequence[int]) -> float:
        index = [column for j in chosen for column in (2 * j, 2 * j + 1)]
        part = gram[np.ix_(index, index)]
        part = part + 1e-6 * np.trace(part) / len(part) * np.eye(len(part))
        return float(moment[index] @ np.linalg.solve(part, moment[index]))

    chosen: list[int] = []
    found = []
    for _ in range(min(most, len(members))):
        rest = set(range(len(members))) - set(chosen)
        chosen.append(max(sorted(rest), key=lambda i: gain([*chosen, i])))
        total = gain(chosen)
        least = min(total - gain([j for j in chosen if j != i]) for i in chosen) if len(chosen) > 1 else total
        if least < LEAST_PART * total:
            break
        found.append(tuple(sorted(members[j] for j in chosen)))
    return found
