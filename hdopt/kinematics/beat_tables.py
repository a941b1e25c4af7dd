"""Tables of teeth as the walk of a beat reads them: wrapped around, and the FS table at all phases at once.

Over a beat every input angle meets the FS teeth in P phases, which lie whole table places apart: with the FS table
written as a comb of P columns, one angle's P deviations of a zone are four rows of it, weighed and added, which the
processor does in lanes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, cast

import numpy as np
from numba import njit

from hdopt.arrays import Array
from hdopt.kinematics.lanes.single import unsigned

# Least and largest do not depend on the order in which lanes are taken; sums keep theirs.
compiled = njit(error_model="numpy", fastmath={"contract", "nsz", "nnan", "arcp"})

# The same compiled into its callers: a call counts the references to every array that it is given, which takes longer
# than what these do.
inlined = njit(error_model="numpy", fastmath={"contract", "nsz", "nnan", "arcp"}, forceinline=True)

whole_of = cast("Callable[[float], int]", np.int32)
"""A number without its fraction, which the processor takes off lane by lane."""

PER_RAD = 1 / (2 * math.pi)
"""Turns in a radian."""
BEFORE, WRAPPED = 1, 4
"""Places that a wrapped row repeats before its first, and in all: those that a cubic reads across its ends."""
TINY = 1e-12
"""mm: what keeps the differences of a table of zeros apart."""
FLOORS = 128
"""Differences of both zones, of either sign, for which the floor of the driving deviation is tabulated."""


class Comb(NamedTuple):
    """The FS table as `rows` (n/P + 4, 2 P): place i of the table stands in row i mod n/P + 1, column i // (n/P), the
    columns twice and the rows wrapped around. Its least and largest value, its steepest slope (1/rad) and its largest
    second and third difference over a grid angle; mm of arc. `floor` (K,) is the least over all places x of
    max(F(x) + D/2, F(x + pi) - D/2), for differences D of both zones from 0 to `reach` mm, which are those for -D too:
    below it the driving deviation cannot fall."""

    rows: Array
    floor: Array
    reach: float
    least: float
    largest: float
    slope: float
    bend: float
    bow: float


class Four(NamedTuple):
    """The first of four neighbours in a wrapped row, and their weights in the cubic through them."""

    first: int
    w_a: float
    w_b: float
    w_c: float
    w_d: float


@inlined
def four(place: float) -> Four:
    """`Four` at a `place` from 0 to n of a wrapped row of n places."""
    whole = whole_of(place)
    x = place - whole
    # Products in pairs: -x (x - 1) (x - 2)/6 and so on.
    below, above = x * (x - 1), (x + 1) * (x - 2)
    return Four(unsigned(whole), -below * (x - 2) / 6, (x - 1) * above / 2, -x * above / 2, (x + 1) * below / 6)


@inlined
def by_four(values: Array, at: Four) -> float:
    """The cubic of a wrapped row of `values` (n + 4,) where `at` says."""
    i = at.first
    low = at.w_a * values[i] + at.w_b * values[i + unsigned(1)]
    return float(low + at.w_c * values[i + unsigned(2)] + at.w_d * values[i + unsigned(3)])


@compiled
def least_of(values: Array, n: int) -> float:
    """Least of the first `n` of `values`, which are folded in halves and lost: lane by lane, as a loop over all of them
    would not be."""
    while n > 1:
        half = (n + 1) // 2
        for i in range(n - half):
            a, b = values[i], values[i + half]
            values[i] = a if a < b else b
        n = half
    return float(values[0])


@compiled
def wrap(table: Array, out: Array) -> None:
    """Fill `out` (n + 4,) with a periodic `table` (n,), wrapped around at both ends."""
    n = len(table)
    for i in range(n):
        out[i + BEFORE] = table[i]
    wrap_ends(out)


@compiled
def wrap_ends(row: Array) -> None:
    """Fill the ends of a wrapped `row` (n + 4,) from the n places between them."""
    n = len(row) - WRAPPED
    row[0] = row[n]
    for i in range(WRAPPED - BEFORE):
        row[n + BEFORE + i] = row[BEFORE + i]


def circle(places: int) -> Array:
    """Cosine and sine of so many `places` of a turn, (2, n): what `with_sine` makes sines of."""
    turn = np.arange(places) * (2 * math.pi / places)
    return np.stack([np.cos(turn), np.sin(turn)])


@compiled
def with_sine(table: Array, amplitude: float, phase: float, circle: Array, out: Array) -> None:
    """Fill `out` (n,) with a spline's `table` (n,) and a sine of `amplitude` and `phase` (rad) of one wave beside it,
    mm of arc; `circle` (2, n)."""
    along, across = amplitude * math.sin(phase), amplitude * math.cos(phase)
    cos, sin = circle[0], circle[1]
    for i in range(len(table)):
        out[i] = table[i] + (along * cos[i] + across * sin[i])


@compiled
def second_difference(table: Array, stride: int) -> float:
    """Largest second difference of a periodic `table` over so many of its places (`stride`), in its unit."""
    return differences(table, stride)[0]


@compiled
def differences(table: Array, stride: int) -> tuple[float, float]:
    """Largest second and third difference of a periodic `table` (n,) over so many of its places (`stride`), in its
    unit."""
    n = len(table)
    longer, seconds, thirds = np.empty(n + 3 * stride), np.empty(n), np.empty(n)
    for i in range(n):
        longer[i] = table[i]
    for i in range(3 * stride):
        longer[n + i] = longer[i]
    b, c, d = longer[stride:], longer[2 * stride :], longer[3 * stride :]
    for i in range(n):
        near, far = longer[i] - 2 * b[i] + c[i], b[i] - 2 * c[i] + d[i]
        seconds[i], thirds[i] = -abs(near), -abs(far - near)
    return -least_of(seconds, n), -least_of(thirds, n)


@compiled
def _range_of(table: Array) -> tuple[float, float, float]:
    """Least and largest value of a periodic `table` (n,), and its largest step from one place to the next."""
    n = len(table)
    values, opposite, steps = np.empty(n), np.empty(n), np.empty(n)
    after = table[1:]
    for i in range(n):
        values[i], opposite[i] = table[i], -table[i]
    for i in range(n - 1):
        steps[i] = -abs(after[i] - table[i])
    steps[n - 1] = -abs(table[0] - table[n - 1])
    return least_of(values, n), -least_of(opposite, n), -least_of(steps, n)


@compiled
def _fill_floor(table: Array, reach: float, floor: Array) -> None:
    """Fill `floor` (K,) of `Comb` from a `table` of an even number of places: every one makes a V over D with its
    lowest point where both zones are equal."""
    half, last = len(table) // 2, len(floor) - 1
    step = reach / last
    for k in range(last + 1):
        floor[k] = math.inf
    for i in range(half):
        one, two = table[i], table[i + half]
        apart, mean = abs(two - one), (one + two) / 2
        k = unsigned(whole_of(apart / step))
        x = apart - k * step
        at_low, at_high = mean + x / 2, mean + (step - x) / 2
        floor[k] = floor[k] if floor[k] < at_low else at_low
        k = k + unsigned(1)
        floor[k] = floor[k] if floor[k] < at_high else at_high
    for k in range(1, last + 1):
        floor[k] = min(floor[k], floor[k - 1] + step / 2)
    for k in range(last - 1, -1, -1):
        floor[k] = min(floor[k], floor[k + 1] + step / 2)


@compiled
def fill_comb(table: Array, phases: int, stride: int, rows: Array, floor: Array) -> Comb:
    """`Comb` of a periodic `table` (n,), n even and a multiple of `phases`, into `rows` (n/phases + 4, 2 phases) and
    `floor` (K,); `stride` is a grid angle in places of the table."""
    n = len(table)
    apart = n // phases
    least, largest, step = _range_of(table)
    for row in range(apart):
        for column in range(phases):
            value = table[column * apart + row]
            rows[row + BEFORE, column], rows[row + BEFORE, column + phases] = value, value
    for column in range(2 * phases):
        rows[0, column] = rows[apart, column - 1 if column > 0 else 2 * phases - 1]
        for i in range(WRAPPED - BEFORE):
            rows[apart + BEFORE + i, column] = rows[BEFORE + i, column + 1 if column + 1 < 2 * phases else 0]
    reach = 1.01 * (largest - least) + TINY
    _fill_floor(table, reach, floor)
    bend, bow = differences(table, stride)
    return Comb(rows, floor, reach, least, largest, step * n * PER_RAD, bend, bow)


@inlined
def _on_comb(comb: Comb, angle: float) -> tuple[int, Four]:
    """The column and the four rows of `comb` at an `angle` (rad) on the FS."""
    phases, apart = comb.rows.shape[1] // 2, comb.rows.shape[0] - WRAPPED
    spacings = angle * (PER_RAD * phases)
    whole = math.floor(spacings)
    column = whole_of(whole) % whole_of(phases)
    return unsigned(column), four((spacings - whole) * apart)


@inlined
def lanes_of(comb: Comb, value: float, angle: float, out: Array) -> None:
    """Fill `out` (P,) with a zone's deviation at every FS phase, mm of arc: the FS term of `comb` at an `angle` (rad)
    beside the `value` of all else."""
    phases = comb.rows.shape[1] // 2
    column, at = _on_comb(comb, angle)
    end = column + unsigned(phases)
    row_a, row_b = comb.rows[at.first, column:end], comb.rows[at.first + unsigned(1), column:end]
    row_c, row_d = comb.rows[at.first + unsigned(2), column:end], comb.rows[at.first + unsigned(3), column:end]
    for p in range(phases):
        out[p] = value + (at.w_a * row_a[p] + at.w_b * row_b[p] + at.w_c * row_c[p] + at.w_d * row_d[p])


@inlined
def one_lane(comb: Comb, angle: float, phase: int) -> float:
    """The FS term of `comb` at one `phase` of an `angle` (rad), mm of arc."""
    column, at = _on_comb(comb, angle)
    i, on = at.first, column + unsigned(phase)
    low = at.w_a * comb.rows[i, on] + at.w_b * comb.rows[i + unsigned(1), on]
    return float(low + at.w_c * comb.rows[i + unsigned(2), on] + at.w_d * comb.rows[i + unsigned(3), on])
