"""The motion of a flexspline tooth in its space, and the gaps of both flanks.

A tooth stands on the neutral line of the ring, which keeps its length, and turns with the line's normal. With the
deflection w(phi) the neutral line is rho = R_n + w at the angle phi from the major axis, its normal leans forward by
arctan(-w'/rho), and the tooth that stands there is the one whose undeformed angle psi holds the same share of the
line's length. The space that it meshes with lies at psi Z_FS/Z_CS. So a tooth is a rigid body of known place and lean
in the frame of its space, and a gap is the least distance between both flanks along the pitch line at any common
height. Nothing is linearised.

The rack approximation that strain-wave tooth forms are designed with, x = m (theta - kappa sin theta)/2 and
y = kappa m cos theta (Musser, US patent 2,906,143, 1959; Ishikawa, EP 0 266 972, 1993), is the limit of many teeth. It
leaves the lean out, which moves the tip of a CSF-25-80's tooth forward by up to 28 um: more than half its backlash.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array
from hdopt.late import late

NODES = 91
"""Places from the major to the minor axis where the motion is sampled, a degree apart."""
CELL = math.pi / 2 / (NODES - 1)
GOLDEN = (math.sqrt(5) - 1) / 2
GOLDEN_STEPS = 60

LEADING, TRAILING = 1.0, -1.0
"""The flank on the side that a tooth moves to on its way out, and the other."""


class Ring(NamedTuple):
    """The deformed ring: rows (5, 91) of w, w', w'', the integral of w, and the length of the neutral line from the
    major axis (mm) on even angles; `neutral` radius R_n (mm), what turns length into an undeformed angle (rad/mm), and
    Z_FS/Z_CS."""

    rows: Array
    neutral: float
    per_length: float
    ratio: float


class Flanks(NamedTuple):
    """Leading flanks of a tooth, (n, 2), and of its space, (k, 2), as points joined by straight lines, mm: distance
    from the middle of the tooth or space, and height, above the neutral line or from the drive's centre; trailing
    flanks mirror them."""

    tooth: Array
    space: Array


def ring_of(rows: Array, neutral: float, ratio: float) -> Ring:
    """The ring of `rows` (4, 91): w, w', w'' and the integral of w (mm) on even angles, with the `neutral` radius (mm)
    and Z_FS/Z_CS as `ratio`."""
    rho, slope, bend = neutral + rows[0], rows[1], rows[2]
    speed = np.hypot(rho, slope)
    change = slope * (rho + bend) / speed
    steps = CELL * (speed[1:] + speed[:-1]) / 2 + CELL**2 * (change[:-1] - change[1:]) / 12
    length = np.concatenate([[0.0], np.cumsum(steps)])
    return Ring(np.ascontiguousarray(np.vstack([rows, length])), neutral, math.pi / 2 / float(length[-1]), ratio)


@late()
def deflection_at(rows: Array, phi: float) -> tuple[float, float, float]:
    """w, w' and the integral of w at an angle `phi` (rad): the quintic that takes w, w', w'' of `rows` at both ends of
    the cell."""
    h = CELL
    i = min(max(int(phi / h), 0), rows.shape[1] - 2)
    x = phi / h - i
    a0, a1, a2 = rows[0, i], rows[1, i] * h, rows[2, i] * h * h / 2
    value = rows[0, i + 1] - (a0 + a1 + a2)
    slope = rows[1, i + 1] * h - (a1 + 2 * a2)
    bend = rows[2, i + 1] * h * h / 2 - a2
    a3, a4, a5 = 10 * value - 4 * slope + bend, -15 * value + 7 * slope - 2 * bend, 6 * value - 3 * slope + bend
    w = a0 + x * (a1 + x * (a2 + x * (a3 + x * (a4 + x * a5))))
    w1 = (a1 + x * (2 * a2 + x * (3 * a3 + x * (4 * a4 + x * 5 * a5)))) / h
    integral = x * (a0 + x * (a1 / 2 + x * (a2 / 3 + x * (a3 / 4 + x * (a4 / 5 + x * a5 / 6)))))
    return w, w1, rows[3, i] + h * integral


@late()
def tooth_place(ring: Ring, phi: float) -> tuple[float, float, float]:
    """Foot of the tooth of a `ring` at `phi` (rad from the major axis) in its space's frame: sideways and height (mm),
    and its lean (rad)."""
    w, slope, _ = deflection_at(ring.rows, phi)
    rho = ring.neutral + w
    i = min(max(int(phi / CELL), 0), ring.rows.shape[1] - 2)
    x = phi / CELL - i
    # The cubic that takes the length and its slope at both ends of the cell.
    before = math.hypot(ring.neutral + ring.rows[0, i], ring.rows[1, i]) * CELL
    after = math.hypot(ring.neutral + ring.rows[0, i + 1], ring.rows[1, i + 1]) * CELL
    rise = ring.rows[4, i + 1] - ring.rows[4, i]
    length = ring.rows[4, i] + x * (before + x * (3 * rise - 2 * before - after + x * (before + after - 2 * rise)))
    space = ring.ratio * ring.per_length * length
    return rho * math.sin(phi - space), rho * math.cos(phi - space), phi - math.atan2(slope, rho) - space


@late()
def gap_at(ring: Ring, flanks: Flanks, phi: float, side: float) -> float:
    """Least distance (mm) of the `flanks` of a `side` of the tooth of a `ring` at `phi` (rad); below 0 they overlap,
    infinite where they share no height."""
    x0, y0, lean = tooth_place(ring, phi)
    cos, sin = math.cos(lean), math.sin(lean)
    n = len(flanks.tooth)
    points = np.empty((n, 2))
    for i in range(n):
        x, y = side * flanks.tooth[i, 0], flanks.tooth[i, 1]
        points[i, 0], points[i, 1] = side * (x0 + x * cos + y * sin), y0 + y * cos - x * sin
    return min(_least_between(points, flanks.space, 1.0), _least_between(flanks.space, points, -1.0))


@late()
def _least_between(points: Array, line: Array, sign: float) -> float:
    """Least of `sign` times the distance from each of `points` to the `line` at its height."""
    least = math.inf
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        for j in range(len(line) - 1):
            low, high = line[j, 1], line[j + 1, 1]
            if min(low, high) <= y <= max(low, high) and low != high:
                on_line = line[j, 0] + (y - low) / (high - low) * (line[j + 1, 0] - line[j, 0])
                least = min(least, sign * (on_line - x))
    return least


@late()
def largest_overlap(ring: Ring, flanks: Flanks, to: float) -> float:
    """By how much (mm) the leading `flanks` overlap at most on a `ring`, from the major axis to the angle `to` (rad);
    0 where they never do."""
    most = max(0.0, -gap_at(ring, flanks, to, LEADING))
    for i in range(1, NODES):
        if i * CELL < to:
            most = max(most, -gap_at(ring, flanks, i * CELL, LEADING))
    return most


@late()
def least_trailing_gap(ring: Ring, flanks: Flanks) -> float:
    """Least gap (mm) of the trailing `flanks` on a tooth's way out, on a `ring`."""
    at = 0
    least = gap_at(ring, flanks, 0.0, TRAILING)
    for i in range(1, NODES):
        gap = gap_at(ring, flanks, i * CELL, TRAILING)
        if gap < least:
            least, at = gap, i
    # The least may still lie within the first cell, where the tooth moves back before its depth opens.
    low, high = max(at - 1, 0) * CELL, min(at + 1, NODES - 1) * CELL
    one, two = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_one, at_two = gap_at(ring, flanks, one, TRAILING), gap_at(ring, flanks, two, TRAILING)
    for _ in range(GOLDEN_STEPS):
        if at_one < at_two:
            high, two, at_two = two, one, at_one
            one = high - GOLDEN * (high - low)
            at_one = gap_at(ring, flanks, one, TRAILING)
        else:
            low, one, at_one = one, two, at_two
            two = low + GOLDEN * (high - low)
            at_two = gap_at(ring, flanks, two, TRAILING)
    return min(least, at_one, at_two)


def straight_flanks(heights: tuple[float, float, float, float], half: tuple[float, float], tan_alpha: float) -> Flanks:
    """Straight flanks that lean by the pressure angle's tangent `tan_alpha` on both parts.

    `heights`: the pitch line of the tooth above the neutral line, its tip above that; the pitch line that the space
    shares with the tooth on the major axis, and the space's tip, from the centre; `half` the half widths of tooth and
    space at those pitch lines; mm.
    """
    pitch, tip, shared, space_tip = heights
    reach = 2 * (shared - space_tip) + 2 * tip
    tooth = [(half[0] - y * tan_alpha, pitch + y) for y in (-reach, tip)]
    space = [(half[1] - (y - shared) * tan_alpha, y) for y in (space_tip, shared + reach)]
    return Flanks(np.array(tooth), np.array(space))
