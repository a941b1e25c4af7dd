"""One drive at all edges of the cells, lanes along the angle: what each zone and rim drives by there."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Singles
from hdopt.kinematics.closed_form import RigidMotion
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.compiled import rim_depth, tooth_deviation
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import Design, Place, Teeth, motion_of, place_at, rim_gap, teeth_of
from hdopt.kinematics.lanes.single import HALF, ONE, narrowed, rotated, sine_cosine
from hdopt.simulation.turn.rows import PER_TURN, folded

V, SINE, COSINE, OFF = (GROUP * row for row in (0, 4, 8, 12))
"""Rows of the edges, from the first of four on, one for each branch (zone 1 with its rims, then zone 2): deviation
without FS teeth, the FS teeth's sine and cosine part (mm of arc), and o' as the FS counts it (rad)."""
GAP = GROUP * 16
"""How much deeper the upper rim lies in either zone, half of it, mm."""
MET = GROUP * 18
"""Where each branch meets the CS, in turns."""
ROWS = 22
STEP = GROUP * ROWS
"""Edges are laid out in groups, so that rows lie a constant apart."""
ON_CIRCLE = 4


@compiled
def _put(edges: Singles, at: int, place: Place, design: Design, teeth: Teeth, s: float, k: float) -> None:
    """Put the branch of zone s and rim k at `at`."""
    depth, o, on_fs = rim_depth(design.rim, place.e_a, place.e_l, place.t_a, place.t_l, s, k)
    value = design.tan_alpha * depth
    value += tooth_deviation(teeth.cs_cos, teeth.cs_sin, place.cos, place.sin, s, ONE - HALF * o * o, o)
    edges[at + V], edges[at + OFF], edges[at + MET] = value, s * on_fs, s * PER_TURN * o


@compiled
def _turn_fs(edges: Singles, at: int, sine: float, cosine: float) -> None:
    """Put the FS teeth of a branch, of this sine and cosine part where o' is 0, at `at`."""
    cos, sin = rotated(cosine, sine, edges[at + OFF])
    edges[at + SINE], edges[at + COSINE] = sin, cos


@compiled
def _fill_branches(edges: Singles, motion: RigidMotion[float], teeth: Teeth, design: Design, circle: Singles) -> None:
    sin, cos = sine_cosine(folded(teeth.fs_phase * PER_TURN))
    sin, cos = teeth.fs * sin, teeth.fs * cos
    for group in range(len(circle) // (ON_CIRCLE * GROUP)):
        for lane in range(GROUP):
            on, at = group * (ON_CIRCLE * GROUP) + lane, group * STEP + lane
            place = place_at(motion, circle[on], circle[on + GROUP])
            _put(edges, at, place, design, teeth, ONE, ONE)
            _put(edges, at + GROUP, place, design, teeth, ONE, -ONE)
            _put(edges, at + 2 * GROUP, place, design, teeth, -ONE, ONE)
            _put(edges, at + 3 * GROUP, place, design, teeth, -ONE, -ONE)
            edges[at + GAP], _ = rim_gap(place, design, ONE)
            edges[at + GAP + GROUP], _ = rim_gap(place, design, -ONE)
        for lane in range(GROUP):
            on, at = group * (ON_CIRCLE * GROUP) + lane, group * STEP + lane
            c, s = circle[on + 2 * GROUP], circle[on + 3 * GROUP]
            sine, cosine = s * cos + c * sin, c * cos - s * sin
            _turn_fs(edges, at, sine, cosine)
            _turn_fs(edges, at + GROUP, sine, cosine)
            _turn_fs(edges, at + 2 * GROUP, -sine, -cosine)
            _turn_fs(edges, at + 3 * GROUP, -sine, -cosine)


@compiled
def _add_cs(edges: Singles, cs: Singles, cells: int) -> None:
    """Add what stands on the CS where each branch meets it."""
    n = len(cs)
    for branch in range(4):
        for g in range(cells + 1):
            at = (g // GROUP) * STEP + g % GROUP + branch * GROUP
            met = narrowed(g) / narrowed(cells) + edges[at + MET]
            place = (met - np.floor(met)) * narrowed(n)
            j, column = int(place), (0 if branch < 2 else 3)
            x = place - narrowed(j)
            j = j if j < n else j - n
            after = cs[j + 1 if j + 1 < n else 0, column]
            edges[at + V] += cs[j, column] + x * (after - cs[j, column])


@compiled
def fill_edges(edges: Singles, work: Singles, i: int, design: Design, circle: Singles, cs: Singles, cells: int) -> None:
    """Fill `edges` with lane `i` of `work` under a `design`, at the edges of so many `cells` of a turn on a `circle`
    and with what stands on the CS, `cs`."""
    motion, teeth = motion_of(work, i, design), teeth_of(work, i)
    _fill_branches(edges, motion, teeth, design, circle)
    if len(cs):
        _add_cs(edges, cs, cells)
