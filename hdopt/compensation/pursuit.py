"""Harmonics of input and output angle that a record supports, found one after another.

Orthogonal matching pursuit (Pati, Rezaiifar and Krishnaprasad 1993) over k input orders and j output orders; it stops
where the next term would take away no more than noise does (Bayes' information criterion, with the noise's colour).
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.compensation.fine import LEAST_TURNS, fine_pairs
from hdopt.compensation.surface import Harmonics

INPUT_ORDERS = 10
OUTPUT_ORDERS = 10
"""Orders k + j/N up to these are tried: those of both splines and their products lie there."""
LEAST_NEW = 0.2
"""A term whose columns lie so far within those already there cannot be told from them by this record."""
CELLS = 4000
"""Rows that the search looks at; the fit at the end takes all."""


def dictionary(span_output_turns: float) -> list[tuple[int, int]]:
    """The pairs (k, j) to try for a record that spans `span_output_turns`: neighbours in j only where it parts them."""
    # Those of the output alone are no neighbours of others: a load that follows its angle is of order 1.
    # Orders j/N apart are a cycle apart over a whole output turn; a shorter record carries every second, third ... one.
    step = max(1, math.ceil(0.9 / max(span_output_turns, 1e-9)))
    if step > OUTPUT_ORDERS:
        return [(k, 0) for k in range(1, INPUT_ORDERS + 1)]
    every = 1 if span_output_turns >= LEAST_TURNS else step
    pairs = [
        (k, j)
        for k in range(INPUT_ORDERS + 1)
        for j in range(-OUTPUT_ORDERS, OUTPUT_ORDERS + 1)
        if j % (every if k == 0 else step) == 0
    ]
    return [(k, j) for k, j in pairs if k > 0 or j > 0]


def pursue(
    angles: tuple[Array, Array],
    residual: Array,
    zeros: Array,
    direction: Array | None,
    pairs: list[tuple[int, int]],
    terms: int,
) -> Harmonics:
    """At most `terms` harmonics of `residual` (n,) arcmin over input and output `angles`, both (n,) rad.

    `pairs` are the (k, j) to try. `zeros` (n, q) are columns that are free anyway; `direction` (n,) +1/-1, or the path
    between, gives a return error, None none. Effective independent values are counted by the first autocorrelation of
    what is left, so that coloured noise is not taken for harmonics.
    """
    free = zeros if direction is None else np.column_stack([zeros, direction])
    some = _some(len(residual))
    chosen = _chosen((angles[0][some], angles[1][some]), residual[some], free[some], pairs, terms, len(pairs))
    found = _fitted(angles, residual, zeros, direction, chosen)
    if len(chosen) == terms:
        return found
    # An encoder's lines are far finer than any pair: every row for them, on what is left.
    left = residual - found.at(*angles, 0.0 if direction is None else direction)
    fine, among = fine_pairs(angles, left - _mean_of(free, left), (INPUT_ORDERS, OUTPUT_ORDERS))
    more = _chosen(angles, left, free, fine, terms - len(chosen), among)
    return _fitted(angles, residual, zeros, direction, [*chosen, *more]) if more else found


def _some(count: int) -> Index:
    """About `CELLS` of so many rows, one of every few by chance: at even steps a fine wave would pass for slow."""
    step = max(1, count // CELLS)
    starts = np.arange(0, count - step + 1, step)
    return np.asarray(starts + np.random.default_rng(0).integers(step, size=len(starts)), np.int64)


def _mean_of(free: Array, left: Array) -> Array:
    """What `free` columns (n, q) take of what is `left` (n,)."""
    basis, _ = np.linalg.qr(free)
    return np.asarray(basis @ (basis.T @ left), float)


def _chosen(
    angles: tuple[Array, Array], y: Array, free: Array, pairs: list[tuple[int, int]], terms: int, among: int
) -> list[tuple[int, int]]:
    """At most `terms` of the `pairs`, one after another, that take more of `y` (n,) beside `free` columns (n, q) than
    the largest of `among` would by chance."""
    if not pairs:
        return []
    basis, _ = np.linalg.qr(free)
    left = y - basis @ (basis.T @ y)
    turned = [
        {order: np.exp(1j * order * angle) for order in {pair[which] for pair in pairs}}
        for which, angle in enumerate(angles)
    ]
    waves = np.array([turned[0][k] * turned[1][j] for k, j in pairs])
    # Single precision to choose among them: half the memory to read for every term.
    cos, sin = waves.real.astype(np.float32), waves.imag.astype(np.float32)
    chosen: list[int] = []
    for _ in range(terms):
        now = left.astype(np.float32)
        score = (cos @ now) ** 2 + (sin @ now) ** 2
        score[chosen] = 0.0
        best = int(np.argmax(score))
        new = np.column_stack([waves[best].real, waves[best].imag])
        for _ in range(2):
            new = new - basis @ (basis.T @ new)
        part, size = np.linalg.qr(new)
        if np.abs(np.diag(size)).min() < LEAST_NEW * math.sqrt(len(y)):
            break
        after = left - part @ (part.T @ left)
        gain = len(y) * math.log(max(float(left @ left), 1e-300) / max(float(after @ after), 1e-300))
        if gain * independent_share(after) < 2 * math.log(len(y)) + 2 * math.log(among):
            break
        chosen.append(best)
        basis = np.column_stack([basis, part])
        left = after
    return [pairs[c] for c in chosen]


def independent_share(left: Array) -> float:
    """Share of independent values in what is `left` (n,): (1 - r)/(1 + r) by its first autocorrelation r."""
    r = float(left[1:] @ left[:-1]) / max(float(left @ left), 1e-300)
    return (1 - min(max(r, 0.0), 0.98)) / (1 + min(max(r, 0.0), 0.98))


def _fitted(
    angles: tuple[Array, Array], residual: Array, zeros: Array, direction: Array | None, pairs: list[tuple[int, int]]
) -> Harmonics:
    """The chosen pairs fitted together on all rows."""
    m = len(pairs)
    phases = [k * angles[0] + j * angles[1] for k, j in pairs]
    blocks = [*(np.cos(p) for p in phases), *(np.sin(p) for p in phases), zeros]
    if direction is not None:
        blocks.append(direction)
    solution = np.linalg.lstsq(np.column_stack(blocks), residual, rcond=1e-8)[0]
    k, j = np.array(pairs, np.int64).reshape(m, 2).T
    back = float(solution[-1]) if direction is not None else 0.0
    return Harmonics(k, j, np.asarray(solution[:m], float), np.asarray(solution[m : 2 * m], float), back)
