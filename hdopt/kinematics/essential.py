"""Essential extremes of the driving deviation over one full relative turn, from sampled branches of any geometry.

Each rim of each zone is a smooth branch over the input angle (`hdopt.kinematics.branches`). Between the angles where a
deepest rim changes, each zone follows one branch, and the driving deviation is the larger of two smooth functions for
each FS phase of the beat. The supremum and infimum over these stretches, ends included as one-sided limits, are the
essential ones: angles where rims only tie have measure zero and never count, real slivers between two changes do.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.kinematics.branches import TIE_MM
from hdopt.kinematics.closed_form import tooth_deviation as closed_form_deviation
from hdopt.late import late

tooth_deviation = late()(closed_form_deviation)

ROOT_STEPS, ROOT_CELLS = 60, 1e-14
"""Most steps to a change of the deepest rim, and how close two of them end it, in cells."""
GOLDEN = (math.sqrt(5) - 1) / 2
GOLDEN_STEPS = 36
"""A cell of 1 deg shrinks to 3e-8 deg."""
SHORT = 0.5
"""Only stretches shorter than this many cells can be ties."""
SAFETY = 2.0
"""How many times the largest second difference met on the grid a cell is allowed to bend."""
ROUNDING_MM = 1e-13
"""Gain, 1e-11 arcmin, below which no cell is followed: an error that is nought but for rounding may gain in all."""


class Teeth(NamedTuple):
    """Tooth deviations as both splines carry them, mm of arc.

    Sines as `closed_form.tooth_deviation` takes them (a sin(phi), a cos(phi)), and tables over one turn of the spline
    on even grids of at least four places, or empty ones.
    """

    cs_cos: float
    cs_sin: float
    fs_cos: float
    fs_sin: float
    cs_table: Array
    fs_table: Array


class Sampled(NamedTuple):
    """Branches on an even grid of m places over one input turn, each (2, 2, m) for zone and rim: depth in mm, offsets
    in rad; tan of the pressure angle, Z_CS/Z_FS, the number of FS phases of the beat, and the teeth."""

    depth: Array
    offset_cs: Array
    offset_fs: Array
    tan_alpha: float
    advance: float
    phases: int
    teeth: Teeth


@late()
def between(values: Array, place: float) -> float:
    """Cubic through the four neighbours of a `place`, in cells, among `values` (n,) on an even periodic grid."""
    n = len(values)
    whole = math.floor(place)
    x = place - whole
    j = int(whole)
    if j < 0 or j >= n:
        j %= n
    next_one = j + 1 if j + 1 < n else 0
    a: float = values[j - 1]
    b: float = values[j]
    c: float = values[next_one]
    d: float = values[next_one + 1 if next_one + 1 < n else 0]
    if x == 0.0:
        return b
    return (
        -x * (x - 1) * (x - 2) / 6 * a
        + (x + 1) * (x - 1) * (x - 2) / 2 * b
        - (x + 1) * x * (x - 2) / 2 * c
        + (x + 1) * x * (x - 1) / 6 * d
    )


@late()
def _on_table(table: Array, angle: float) -> float:
    return between(table, angle / (2 * math.pi) * len(table)) if len(table) else 0.0


def on_table(table: Array, angles: Array) -> Array:
    """A `table` over one turn of a spline at `angles` (rad), by cubics; the shape of `angles`."""
    flat = np.ascontiguousarray(angles, dtype=float).ravel()
    return np.reshape(_all_on_table(table, flat), np.shape(angles))


@late(calls=0)
def _all_on_table(table: Array, angles: Array) -> Array:
    found = np.empty(len(angles))
    for i in range(len(angles)):
        found[i] = _on_table(table, angles[i])
    return found


@late()
def _root(gaps: Array, low: float, high: float) -> float:
    """Where the interpolated `gaps` change sign between two places, by the Illinois method: a secant that halves the
    value of an end which stays."""
    at_low, at_high = between(gaps, low), between(gaps, high)
    side = 0
    place = low
    for _ in range(ROOT_STEPS):
        before = place
        if at_high == at_low:
            break
        place = (low * at_high - high * at_low) / (at_high - at_low)
        value = between(gaps, place)
        if (value >= 0.0) == (at_low >= 0.0):
            low, at_low = place, value
            at_high = at_high / 2 if side == -1 else at_high
            side = -1
        else:
            high, at_high = place, value
            at_low = at_low / 2 if side == 1 else at_low
            side = 1
        if abs(place - before) < ROOT_CELLS or value == 0.0:
            break
    return place


@late()
def _rim_changes(gaps: Array, found: Array, count: int) -> int:
    """Append to `found` the places where `gaps` (m,) over one turn change sign; pairs within a cell too."""
    m = len(gaps)
    if np.abs(gaps).max() <= TIE_MM:
        return count
    for j in range(m):
        before, here, after = gaps[j - 1], gaps[j], gaps[j + 1 if j + 1 < m else 0]
        if (here >= 0.0) != (after >= 0.0):
            found[count] = _root(gaps, float(j), j + 1.0)
            count += 1
        elif (before >= 0.0) == (here >= 0.0) and abs(here) <= abs(before) and abs(here) <= abs(after):
            bend = before - 2 * here + after
            vertex = j + (0.5 * (before - after) / bend if bend != 0.0 else 0.0)
            if (between(gaps, vertex) >= 0.0) != (here >= 0.0):
                found[count] = _root(gaps, j - 1.0, vertex)
                found[count + 1] = _root(gaps, vertex, j + 1.0)
                count += 2
    return count


@late()
def _node(mesh: Sampled, rims: Index, place: float, out: Array) -> None:
    """Fill `out` (2, 4) for both zones at a `place`: deviation without FS teeth, FS sine's cosine and sine part over
    the phase, and the angle on the FS."""
    teeth = mesh.teeth
    theta = place * 2 * math.pi / mesh.depth.shape[2]
    cos, sin = math.cos(theta), math.sin(theta)
    for zone in range(2):
        s, k = 1.0 - 2.0 * zone, rims[zone]
        o, o_fs = between(mesh.offset_cs[zone, k], place), between(mesh.offset_fs[zone, k], place)
        away = math.pi * zone
        value = mesh.tan_alpha * between(mesh.depth[zone, k], place)
        value += tooth_deviation(teeth.cs_cos, teeth.cs_sin, cos, sin, s, math.cos(o), math.sin(o))
        out[zone, 0] = value + _on_table(teeth.cs_table, theta + s * o + away)
        angle = mesh.advance * theta + s * o_fs
        cos_fs, sin_fs = math.cos(angle), math.sin(angle)
        out[zone, 1] = s * (teeth.fs_cos * cos_fs + teeth.fs_sin * sin_fs)
        out[zone, 2] = s * (teeth.fs_sin * cos_fs - teeth.fs_cos * sin_fs)
        out[zone, 3] = angle + away


@late()
def _zone_value(node: Array, zone: int, phase: float, teeth: Teeth) -> float:
    """A zone's deviation at a node for the FS phase in rad, mm of arc."""
    value: float = node[zone, 0] + node[zone, 1] * math.cos(phase) + node[zone, 2] * math.sin(phase)
    return value + _on_table(teeth.fs_table, node[zone, 3] + phase)


@late()
def _extreme_in_cell(
    mesh: Sampled, rims: Index, phase: float, low: float, high: float, zone: int, node: Array
) -> float:
    """Least driving deviation in a cell (`zone` < 0), or the largest of one zone, by golden section."""
    x, y = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_x = at_y = best = 0.0
    for step in range(GOLDEN_STEPS + 2):
        place = y if step == 1 or (step > 1 and at_x > at_y) else x
        if step > 1:
            if at_x > at_y:
                low, x, at_x = x, y, at_y
                place = y = low + GOLDEN * (high - low)
            else:
                high, y, at_y = y, x, at_x
                place = x = high - GOLDEN * (high - low)
        _node(mesh, rims, place, node)
        if zone < 0:
            value = max(_zone_value(node, 0, phase, mesh.teeth), _zone_value(node, 1, phase, mesh.teeth))
        else:
            value = -_zone_value(node, zone, phase, mesh.teeth)
        if place == x:
            at_x = value
        else:
            at_y = value
        best = value if step == 0 else min(best, value)
    return best


@late()
def _least_of_lines(one_a: float, two_a: float, one_b: float, two_b: float) -> float:
    """Least of the larger of two lines between their ends."""
    least = min(max(one_a, two_a), max(one_b, two_b))
    apart_a, apart_b = one_a - two_a, one_b - two_b
    if apart_a * apart_b < 0.0:
        least = min(least, (one_a * apart_b - one_b * apart_a) / (apart_b - apart_a))
    return least


@late()
def _scan_piece(mesh: Sampled, rims: Index, places: Array, nodes: Array, values: Array, best: Array) -> float:
    """Walk one stretch, given by its `places`; `best` (2,) holds the least and the largest deviation so far."""
    n, phases, teeth = len(places), mesh.phases, mesh.teeth
    for i in range(n):
        _node(mesh, rims, places[i], nodes[i])
    bend = 0.0
    for p in range(phases):
        phase = 2 * math.pi * p / phases
        cos, sin = math.cos(phase), math.sin(phase)
        for zone in range(2):
            values[p, zone, :n] = nodes[:n, zone, 0] + nodes[:n, zone, 1] * cos + nodes[:n, zone, 2] * sin
            if len(teeth.fs_table):
                values[p, zone, :n] += _all_on_table(teeth.fs_table, nodes[:n, zone, 3] + phase)
            if n > 4:
                # Only between whole cells; those at the ends of the stretch are shorter.
                cells = values[p, zone, 1 : n - 1]
                bend = max(bend, np.abs(cells[:-2] - 2 * cells[1:-1] + cells[2:]).max())
        larger = np.maximum(values[p, 0, :n], values[p, 1, :n])
        best[0] = min(best[0], larger.min())
        best[1] = max(best[1], larger.max())
    return bend


@late()
def _refine_piece(
    mesh: Sampled, rims: Index, places: Array, values: Array, margin: float, best: Array, node: Array
) -> None:
    """Follow the cells whose extremes, within the `margin`, may pass the `best` found so far."""
    n = len(places)
    for p in range(mesh.phases):
        phase = 2 * math.pi * p / mesh.phases
        one, two = values[p, 0, :n], values[p, 1, :n]
        floor = np.maximum(np.minimum(one[:-1], one[1:]), np.minimum(two[:-1], two[1:]))
        for i in np.flatnonzero(floor - margin < best[0] - ROUNDING_MM):
            if _least_of_lines(one[i], two[i], one[i + 1], two[i + 1]) - margin < best[0] - ROUNDING_MM:
                found = _extreme_in_cell(mesh, rims, phase, places[i], places[i + 1], -1, node)
                best[0] = min(best[0], found)
        for zone in range(2):
            row = values[p, zone, :n]
            for i in np.flatnonzero(np.maximum(row[:-1], row[1:]) + margin > best[1] + ROUNDING_MM):
                if max(row[i], row[i + 1]) + margin > best[1] + ROUNDING_MM:
                    found = _extreme_in_cell(mesh, rims, phase, places[i], places[i + 1], zone, node)
                    best[1] = max(best[1], -found)


@late()
def _stretches(gaps: Array) -> Array:
    """Places of one turn, sorted, where a zone's deepest rim changes, the first again a turn later; `gaps` (2, m)."""
    m = gaps.shape[1]
    changes = np.empty(4 * m + 1)
    count = _rim_changes(gaps[0], changes, 0)
    count = _rim_changes(gaps[1], changes, count)
    if count == 0:
        changes[0], count = 0.0, 1
    marks = np.empty(count + 1)
    marks[:count] = np.sort(changes[:count])
    marks[count] = marks[0] + m
    return marks


@late()
def _rims_between(gaps: Array, low: float, high: float, rims: Index) -> bool:
    """Fill `rims` (2,) with the deepest rims between two neighbouring changes; False where they only tie."""
    real = high > low
    for zone in range(2):
        gap = between(gaps[zone], (low + high) / 2)
        rims[zone] = 0 if gap >= -TIE_MM else 1
        real = real and (high - low > SHORT or abs(gap) > TIE_MM)
    return real


@late()
def essential_extremes(mesh: Sampled) -> tuple[float, float]:
    """Essential infimum and supremum of max(tau_1, tau_2) over one full relative turn, mm of arc.

    Jia 2021, Eqs. (31), (32). Cubics join the places of `mesh`: 360 of them leave 1e-7 arcmin for smooth profiles.
    """
    m = mesh.depth.shape[2]
    gaps = mesh.depth[:, 0] - mesh.depth[:, 1]
    marks = _stretches(gaps)
    best = np.array([math.inf, -math.inf])
    nodes, node = np.empty((m + 3, 2, 4)), np.empty((2, 4))
    values, places = np.empty((mesh.phases, 2, m + 3)), np.empty(m + 3)
    rims = np.zeros(2, np.int64)
    bend = 0.0
    for refine in range(2):
        for i in range(len(marks) - 1):
            low, high = marks[i], marks[i + 1]
            if not _rims_between(gaps, low, high, rims):
                continue
            places[0] = low
            n = 1
            for j in range(math.floor(low) + 1, math.ceil(high)):
                places[n] = j
                n += 1
            places[n] = high
            n += 1
            bend = max(bend, _scan_piece(mesh, rims, places[:n], nodes, values, best))
            if refine == 1:
                _refine_piece(mesh, rims, places[:n], values, SAFETY * bend / 8, best, node)
    return best[0], best[1]
