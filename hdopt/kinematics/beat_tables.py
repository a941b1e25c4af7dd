"""Tables of teeth as the walk of a beat reads them: wrapped around, and the FS table at all phases at once.

Over a beat every input angle meets the FS teeth in P phases, which lie whole table places apart: with the FS table
written as a comb of P columns, one angle's P deviations of a zone are four rows of it, weighed and added, which the
processor does in lanes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias, TypeVar, cast  # Any: numba's options are of several kinds

import numpy as np
from numpy.typing import NDArray

from hdopt.arrays import Array, Singles
from hdopt.kinematics.compiled_closed_form import entry
from hdopt.kinematics.inner import inner
from hdopt.kinematics.lanes.single import narrowed, unsigned

Function = TypeVar("Function", bound=Callable[..., object])

# Least and largest do not depend on the order in which lanes are taken; sums keep theirs.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "nsz", "nnan", "arcp"}}
# Without counts of arrays' users, which take longer than what is done with them; Numba's own types do not know of it.
_UNCOUNTED: dict[str, Any] = _OPTIONS | {"_nrt": False}


def allocating(function: Function) -> Function:
    """`function` compiled for kernels of the beat; it makes arrays, or gives such back as it was given."""
    return inner(**_OPTIONS)(function)


def compiled(function: Function) -> Function:
    """`function` compiled for kernels of the beat; it does neither."""
    return inner(**_UNCOUNTED)(function)


def inlined(function: Function) -> Function:
    """The same of a `function` that is compiled into each of its callers."""
    return inner(forceinline=True, **_UNCOUNTED)(function)


whole_of = cast("Callable[[float], int]", np.int32)
"""A number without its fraction, which the processor takes off lane by lane."""

widened = cast("Callable[[float], float]", np.float64)
"""A number in double precision, inside kernels."""

wide = cast("Callable[[int], int]", np.int64)
"""A whole number of 64 bits, inside kernels."""

Bits: TypeAlias = NDArray[np.int32]
"""Numbers in single precision as the whole numbers that their bits are."""
BUT_SIGN, PLACE_BITS, LAST = 0x7FFFFFFF, 16, 2**63 - 1
"""All bits but the sign of a number in single precision; bits of a place in a row; more than any number of 64 bits."""

PER_RAD = 1 / (2 * math.pi)
"""Turns in a radian."""
BEFORE, WRAPPED = 1, 4
"""Places that a wrapped row repeats before its first, and in all: those that a cubic reads across its ends."""
TINY = 1e-12
"""mm: what keeps the differences of a table of zeros apart."""
FLOORS = 256
"""Differences of both zones, of either sign, for which the floor of the driving deviation is tabulated."""


class Comb(NamedTuple):
    """The FS `table` over one turn, wrapped around (n + 4,), and in single precision as `rows` (n/P + 4, 2 P): place i
    of the table stands in row i mod n/P + 1, column i // (n/P), the columns twice and the rows wrapped around; `flat`
    are these row after row. Its least and largest value, its steepest slope (1/rad), its largest second difference over
    a grid angle and third over half a one, and how far cubics through its places are off lines between them; mm of arc.
    `floor` (K,) is the least over all x, with lines between places, of max(F(x) + D/2, F(x + pi) - D/2), for
    differences D of both zones from 0 to `reach` mm, which are those for -D too: below it, less the `ripple`, the
    driving deviation cannot fall."""

    table: Array
    rows: Singles
    flat: Singles
    floor: Array
    reach: float
    least: float
    largest: float
    slope: float
    bend: float
    bow: float
    ripple: float


class Teeth(NamedTuple):
    """Room for a `Comb`: the wrapped `table`, its `rows`, and the `floor`."""

    table: Array
    rows: Singles
    floor: Array


@allocating
def new_teeth(places: int, phases: int) -> Teeth:
    """Room for the FS table of so many `places` that is met in so many `phases`."""
    rows = np.empty((places // phases + WRAPPED, 2 * phases), np.float32)
    return Teeth(np.empty(places + WRAPPED), rows, np.empty(FLOORS))


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
def rising(place: float) -> Four:
    """The same with the weights of the cubic's slope, per place."""
    whole = whole_of(place)
    x = place - whole
    square, twice = 3 * x * x, 2 * x
    w_a, w_d = -(square - 3 * twice + 2) / 6, (square - 1) / 6
    return Four(unsigned(whole), w_a, (square - 2 * twice - 1) / 2, -(square - twice - 2) / 2, w_d)


@inlined
def by_four(values: Array, at: Four) -> float:
    """The cubic of a wrapped row of `values` (n + 4,) where `at` says."""
    i = at.first
    low = at.w_a * values[i] + at.w_b * values[i + unsigned(1)]
    return float(low + at.w_c * values[i + unsigned(2)] + at.w_d * values[i + unsigned(3)])


@compiled
def least_of(values: Array | Singles, n: int) -> float:
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
def first_least(bits: Bits) -> int:
    """The place of the first of the least of some numbers in single precision, of which `bits` (n,) are those: whole
    numbers, unlike others, the compiler compares in lanes."""
    least = LAST
    for i in range(len(bits)):
        of = wide(bits[i])
        # Below nought all but the sign turns round; the place stands behind the number.
        ordered = ((of ^ ((of >> wide(31)) & BUT_SIGN)) << PLACE_BITS) | i
        least = ordered if ordered < least else least
    return least & ((1 << PLACE_BITS) - 1)


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


@entry
def second_difference(table: Array, stride: int) -> float:
    """Largest second difference of a periodic `table` over so many of its places (`stride`), in its unit."""
    return differences(table, stride)[0]


@allocating
def differences(table: Array, stride: int) -> tuple[float, float]:
    """Largest second difference of a periodic `table` (n,) over so many of its places (`stride`), and its largest third
    one over half as many, in its unit."""
    n, half = len(table), (stride + 1) // 2
    reach = max(2 * stride, 3 * half)
    longer, seconds, thirds = np.empty(n + reach), np.empty(n), np.empty(n)
    for i in range(n):
        longer[i] = table[i]
    for i in range(reach):
        longer[n + i] = longer[i]
    b, c = longer[stride:], longer[2 * stride :]
    for i in range(n):
        seconds[i] = -abs(longer[i] - 2 * b[i] + c[i])
    b, c, d = longer[half:], longer[2 * half :], longer[3 * half :]
    for i in range(n):
        thirds[i] = -abs(longer[i] - d[i] + 3 * (c[i] - b[i]))
    return -least_of(seconds, n), -least_of(thirds, n)


@allocating
def _range_of(table: Array) -> tuple[float, float, float, float]:
    """Least and largest value of a periodic `table` (n,), its largest step from one place to the next, and how far
    cubics through its places are off lines between them at most."""
    n = len(table)
    values, opposite, steps = np.empty(n), np.empty(n), np.empty(n)
    after = table[1:]
    for i in range(n):
        values[i], opposite[i] = table[i], -table[i]
    for i in range(n - 1):
        steps[i] = -abs(after[i] - table[i])
    steps[n - 1] = -abs(table[0] - table[n - 1])
    least, largest, step = least_of(values, n), -least_of(opposite, n), -least_of(steps, n)
    # A cubic is off by x (1 - x) / 2 times a mean of two second differences.
    after, last = table[2:], table[1:]
    for i in range(n - 2):
        steps[i] = -abs(table[i] - 2 * last[i] + after[i])
    steps[n - 2] = -abs(table[n - 2] - 2 * table[n - 1] + table[0])
    steps[n - 1] = -abs(table[n - 1] - 2 * table[0] + table[1])
    return least, largest, step, -least_of(steps, n) / 8


@compiled
def _fill_floor(table: Array, reach: float, floor: Array) -> None:
    """Fill `floor` (K,) of `Comb` from a `table` of an even number of places: every one makes a V over D with its
    lowest point where both zones are equal. Up to half way to its neighbours either zone falls by half a step at
    most."""
    half, last, n = len(table) // 2, len(floor) - 1, len(table)
    step = reach / last
    for k in range(last + 1):
        floor[k] = math.inf
    for i in range(half):
        one, two = table[i], table[i + half]
        before, after = one - table[i - 1 if i > 0 else n - 1], table[i + 1] - one
        before_two, after_two = two - table[i + half - 1], table[i + half + 1 if i + 1 < half else 0] - two
        falls = max(max(abs(before), abs(after)), max(abs(before_two), abs(after_two))) / 2
        apart, mean = abs(two - one), (one + two) / 2 - falls
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


@allocating
def fill_comb(table: Array, phases: int, stride: int, work: Teeth) -> Comb:
    """`Comb` of a periodic `table` (n,), n even and a multiple of `phases`, into the room of `work`; `stride` is a grid
    angle in places of the table."""
    wrapped, rows, floor = work
    wrap(table, wrapped)
    n = len(table)
    apart = n // phases
    least, largest, step, ripple = _range_of(table)
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
    return Comb(
        wrapped, rows, rows.reshape(rows.size), floor, reach, least, largest, step * n * PER_RAD, bend, bow, ripple
    )


@inlined
def _on_comb(comb: Comb, angle: float) -> tuple[int, float]:
    """The column of `comb` at an `angle` (rad) on the FS, and the place in its rows."""
    phases, apart = comb.rows.shape[1] // 2, comb.rows.shape[0] - WRAPPED
    turns = angle * PER_RAD
    # One past the last column, where rounding has it there, is the first again.
    spacings = (turns - math.floor(turns)) * phases
    column = whole_of(spacings)
    return unsigned(column), (spacings - column) * apart


@inlined
def lanes_of(comb: Comb, value: float, angle: float, out: Singles) -> None:
    """Fill `out` (P,) with a zone's deviation at every FS phase, mm of arc: the FS term of `comb` at an `angle` (rad)
    beside the `value` of all else."""
    phases = comb.rows.shape[1] // 2
    column, place = _on_comb(comb, angle)
    at = four(place)
    beside, width = narrowed(value), unsigned(comb.rows.shape[1])
    a = at.first * width + column
    b, c, d = a + width, a + width + width, a + width + width + width
    w_a, w_b, w_c, w_d = narrowed(at.w_a), narrowed(at.w_b), narrowed(at.w_c), narrowed(at.w_d)
    flat = comb.flat
    for p in range(phases):
        on = unsigned(p)
        out[p] = beside + (w_a * flat[a + on] + w_b * flat[b + on] + w_c * flat[c + on] + w_d * flat[d + on])


@inlined
def _on_lane(comb: Comb, angle: float, phase: int) -> tuple[int, float]:
    """Where the tooth spacing of one `phase` of an `angle` (rad) begins in the table of `comb`, and the place in it."""
    phases, apart = comb.rows.shape[1] // 2, comb.rows.shape[0] - WRAPPED
    column, place = _on_comb(comb, angle)
    on = column + unsigned(phase)
    on = on if on < unsigned(phases) else on - unsigned(phases)
    return on * unsigned(apart), place


@inlined
def one_lane(comb: Comb, angle: float, phase: int) -> float:
    """The FS term of `comb` at one `phase` of an `angle` (rad), mm of arc."""
    first, place = _on_lane(comb, angle, phase)
    at = four(place)
    return by_four(comb.table, Four(first + at.first, at.w_a, at.w_b, at.w_c, at.w_d))


@inlined
def along_lane(comb: Comb, angle: float, phase: int) -> tuple[float, float]:
    """The FS term of `comb` at one `phase` of an `angle` (rad), mm of arc, and its slope over the angle, mm per rad."""
    first, place = _on_lane(comb, angle, phase)
    at, up = four(place), rising(place)
    value = by_four(comb.table, Four(first + at.first, at.w_a, at.w_b, at.w_c, at.w_d))
    slope = by_four(comb.table, Four(first + up.first, up.w_a, up.w_b, up.w_c, up.w_d))
    return value, slope * ((len(comb.table) - WRAPPED) * PER_RAD)
