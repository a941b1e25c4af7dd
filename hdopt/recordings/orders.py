"""Order spectrum: amplitudes at exact, non-integer orders (cycles per input turn) by least squares.

Orders of a harmonic drive lie 1/N apart, closer than the bins of a short record's Fourier transform. So amplitudes are
fitted at the known orders, and what the record's length cannot separate is computed and reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.words import counted

INSEPARABLE_GROWTH = 3.0
"""Neighbouring orders count as not separable when together they make their errors at least this many times larger."""
SOUND = 1e-4
"""Least eigenvalue of the Gram matrix of unit columns from which normal equations are as good as any: rounding then
grows 1e4 times, and the correction takes that away."""


@dataclass(frozen=True)
class ModelOrder:
    """An order of the model's own kinematic error: its symbol, its value for a drive, what makes it."""

    symbol: str
    order: float
    origin: str


def model_orders(ratio: float) -> tuple[ModelOrder, ...]:
    """The orders of the model for the reduction ratio N: those of Jia 2021, Table 6, then those it leaves out.

    E1: input-axis errors, fixed to ground like the CS teeth; E2: wave-generator errors. The driving zone is the larger
    of two, so each cause alone makes even orders, and causes that turn differently mix.
    """
    n = ratio
    return (
        ModelOrder("1/N", 1 / n, "FS teeth against E1 or CS teeth: the beat"),
        ModelOrder("1", 1.0, "E2 together with E1 or CS teeth"),
        ModelOrder("2", 2.0, "E1, CS teeth"),
        ModelOrder("2(1+1/2N)", 2 + 1 / n, "FS teeth together with E1 or CS teeth"),
        ModelOrder("2(1+1/N)", 2 + 2 / n, "FS teeth"),
        ModelOrder("2/N", 2 / n, "FS teeth: harmonic of the beat"),
        ModelOrder("1-1/N", 1 - 1 / n, "E2 together with FS teeth"),
        ModelOrder("1+1/N", 1 + 1 / n, "E2 together with FS teeth"),
        ModelOrder("2-1/N", 2 - 1 / n, "FS teeth together with E1 or CS teeth"),
        ModelOrder("3", 3.0, "change of driving zone (harmonic of order 1)"),
        ModelOrder("3+1/N", 3 + 1 / n, "change of driving zone, E2 with FS teeth"),
        ModelOrder("4", 4.0, "change of driving zone (harmonic of order 2)"),
        ModelOrder("4(1+1/4N)", 4 + 1 / n, "change of driving zone, FS teeth with CS teeth"),
        ModelOrder("4(1+1/2N)", 4 + 2 / n, "change of driving zone (harmonic of FS teeth)"),
        ModelOrder("5", 5.0, "change of driving zone (harmonic of order 1)"),
        ModelOrder("5+1/N", 5 + 1 / n, "change of driving zone, E2 with FS teeth"),
    )


@dataclass(frozen=True)
class OrderSpectrum:
    """Amplitudes and phases at `orders`, shape (m,): signal = sum of amplitude cos(order theta - phase) + mean.

    `error_growth` says how many times larger each amplitude's standard error is than if its order stood alone.
    `inseparable` lists the groups of orders that this record cannot tell apart.
    """

    orders: Array
    amplitudes: Array
    phases: Array
    mean: float
    residual_rms: float
    error_growth: Array
    inseparable: tuple[tuple[float, ...], ...]


def order_columns(theta: ArrayLike, orders: Sequence[float]) -> Array:
    """Columns 1, cos(o theta), sin(o theta) for each order; shape (n, 1 + 2 m).

    `theta` (n,) input angles in rad, `orders` (m,) in cycles per input turn.
    """
    angles = np.multiply.outer(np.asarray(theta, float), np.asarray(orders, float))
    columns = np.empty((len(angles), 1 + 2 * angles.shape[1]))
    columns[:, 0] = 1.0
    columns[:, 1::2], columns[:, 2::2] = np.cos(angles), np.sin(angles)
    return columns


def order_spectrum(theta: ArrayLike, signal: ArrayLike, orders: Sequence[float]) -> OrderSpectrum:
    """Fit `signal` (n,) over input angles `theta` (rad, need not be even) by a mean and the given orders together.

    Orders in cycles per input turn, above 0, all different. Raises `HdoptError` where the record has too few
    samples, or is so short that the orders cannot be told apart at all.
    """
    theta, signal = np.asarray(theta, float), np.asarray(signal, float)
    wanted: Array = np.asarray(orders, float)
    if theta.shape != signal.shape or theta.ndim != 1:
        raise HdoptError(f"angles have shape {theta.shape}, the signal {signal.shape}; give two lists of equal length")
    if np.any(~np.isfinite(wanted)) or np.any(wanted <= 0) or len(np.unique(wanted)) < len(wanted):
        raise HdoptError("orders must be finite, above 0 and all different")
    columns = order_columns(theta, orders)
    if len(theta) <= columns.shape[1]:
        raise HdoptError(
            f"{counted(len(theta), 'sample')} cannot carry {counted(len(orders), 'order')}; "
            f"at least {columns.shape[1] + 1} are needed"
        )
    gram = columns.T @ columns
    coefficients = _coefficients(columns, gram, signal)
    if coefficients is None:
        turns = np.ptp(theta) / (2 * np.pi)
        raise HdoptError(
            f"a record of {turns:.3g} input turns cannot tell these orders apart: "
            f"{', '.join(f'{order:g}' for order in orders)}; leave some out or record more turns"
        )
    cos, sin = coefficients[1::2], coefficients[2::2]
    return OrderSpectrum(
        orders=wanted,
        amplitudes=np.hypot(cos, sin),
        phases=np.arctan2(sin, cos),
        mean=float(coefficients[0]),
        residual_rms=float(np.sqrt(np.mean((signal - columns @ coefficients) ** 2))),
        error_growth=_growth(gram),
        inseparable=_inseparable(gram, float(np.ptp(theta)), orders),
    )


def _coefficients(columns: Array, gram: Array, signal: Array) -> Array | None:
    """Least squares of `signal` (n,) by `columns` (n, k) with their Gram matrix; None where they cannot be told apart.

    By normal equations with one correction where these are sound, which loses nothing and takes a tenth of the time.
    """
    size = np.sqrt(np.diag(gram))
    if np.linalg.eigvalsh(gram / np.multiply.outer(size, size))[0] > SOUND:
        found = np.linalg.solve(gram, columns.T @ signal)
        return np.asarray(found + np.linalg.solve(gram, columns.T @ (signal - columns @ found)))
    found, _, rank, _ = np.linalg.lstsq(columns, signal, rcond=1e-10)
    return None if rank < columns.shape[1] else np.asarray(found, np.float64)


def error_growth(theta: ArrayLike, orders: Sequence[float]) -> Array:
    """How many times each order's amplitude error grows because the other orders are fitted too; shape (m,), >= 1.

    `theta` (n,) input angles in rad, `orders` in cycles per input turn.
    """
    columns = order_columns(theta, orders)
    return _growth(columns.T @ columns)


def _growth(gram: Array) -> Array:
    """`error_growth` from the Gram matrix (1 + 2 m, 1 + 2 m) of the orders' columns."""
    size = np.sqrt(np.diag(gram))
    variance = np.diag(np.linalg.pinv(gram / np.multiply.outer(size, size), rcond=1e-14))
    growth: Array = np.sqrt(np.maximum(variance[1::2], variance[2::2]))
    return growth


def inseparable_groups(theta: ArrayLike, orders: Sequence[float]) -> tuple[tuple[float, ...], ...]:
    """Groups of neighbouring orders that this record cannot tell apart.

    Neighbours lie within one cycle over the record of each other; a group counts when fitting it together makes
    the error of one of its orders at least `INSEPARABLE_GROWTH` times larger. Over one output turn (N input turns) the
    orders 2, 2(1 + 1/2N) and 2(1 + 1/N) stand apart; for N = 80, errors grow 10 times at 20 turns and 44 times at 10.

    `theta` (n,) input angles in rad, `orders` in cycles per input turn.
    """
    columns = order_columns(theta, orders)
    return _inseparable(columns.T @ columns, float(np.ptp(np.asarray(theta, float))), orders)


def _inseparable(gram: Array, travel: float, orders: Sequence[float]) -> tuple[tuple[float, ...], ...]:
    """`inseparable_groups` from the Gram matrix of the columns of all `orders` over a `travel` in rad."""
    one_cycle = 2 * np.pi / travel
    groups: list[list[int]] = []
    for place in np.argsort(np.asarray(orders, float)).tolist():
        if groups and orders[place] - orders[groups[-1][-1]] < one_cycle * (1 - 1e-9):
            groups[-1].append(place)
        else:
            groups.append([place])

    def grown(group: list[int]) -> float:
        columns = [0, *(column for place in group for column in (1 + 2 * place, 2 + 2 * place))]
        return float(_growth(gram[np.ix_(columns, columns)]).max())

    found = [group for group in groups if len(group) > 1 and grown(group) >= INSEPARABLE_GROWTH]
    return tuple(tuple(float(orders[place]) for place in group) for group in found)
