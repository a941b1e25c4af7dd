"""Effects over a full relative turn as the lanes take them: what bounds a cell in every turn, and values to look up."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Singles
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.single import single, singles
from hdopt.simulation.beat.on_fs import OnFs, on_fs_of
from hdopt.simulation.turn.effects import (
    FARTHEST,
    LEFT_BY_CELL,
    LEFT_BY_PLACE,
    NO_PARTS,
    OVERLAP,
    Scan,
    Turn,
    largest,
    parts,
    scan_of,
    spectrum_of,
    table_of,
)
from hdopt.simulation.turn.waves import NO_WAVES

FEWEST_CELLS = 60
"""Wider cells than of effects that repeat, since each is taken in every turn, and places are looked at twice."""
PARTS_FROM, MOST_PARTED = 3 * FEWEST_CELLS, 2 * FEWEST_CELLS
"""So many cells and more are parts of cells, of which there are so many at most."""
LEFT_BY_CHORD = 2.5e-4
"""What the chord of a part leaves at most, arcmin, where the table's places allow it."""
MOST_BOUNDS = 2**18
"""Cells of all turns at most: 4 MiB of bounds."""
OFFSET = 0.1
"""Offsets o', rad, up to which an effect on the FS is bounded where it is met: three times the shipped tolerances
reach 0.07. Where a drive's are larger the effect's range is left open."""
KINDS = 4
"""Rows of an edge: of the effects the mean of both zones and half their difference, and how far a cell goes below and
above its chord, mm of arc."""


class Parts(NamedTuple):
    """Parts of the cells where effects are finer than these, `each` of every cell, or 1 and no more. `fixed`, flat: of
    what does not stand on the FS, turn by turn and cell by cell, so many rows (`kinds`) of the edges of the parts: the
    mean of both zones and half their difference, or the mean alone where zones do not differ, or none where there is
    nothing; then a row of zeros, which begins at `zeros`. How far a part goes `beyond` its chord, mm of arc."""

    each: int
    fixed: Singles
    kinds: int
    zeros: int
    beyond: float


class Beat(NamedTuple):
    """Effects of one direction over B input turns of c cells, mm of arc.

    `turn`: the cells, bounded over all turns, with what stands on the CS; its `fixed` (places of all turns, 6) is the
    rest. `circle`, flat: cosine and sine of the edges, and of these times Z_CS/Z_FS, group by group. `bounds`, flat:
    cosine and sine of the FS phase in every turn, then for each edge the rows of KINDS; rows are padded to whole
    groups, with turns that nothing is expected of. `phases` (B,), rad; `per_turn` places of `fixed` a turn; `fs` (m, 6)
    or (0, 6), what stands on the FS, with its range, and bounded in every turn, `on_fs`; the `parts` of a cell.
    """

    turn: Turn
    circle: Singles
    bounds: Singles
    phases: Singles
    per_turn: int
    fs: Singles
    fs_range: float
    on_fs: OnFs
    parts: Parts


def beat_of(zones: Array, cs: Array, fs: Array, turns: int, advance: float, per_mm: float) -> Beat | None:
    """What `zones` (2, m), mm of arc on even places of so many `turns`, and `cs` and `fs` (2, k), over a turn of either
    spline or on no places, add; `advance` is Z_CS/Z_FS, `per_mm` arcmin per mm of arc. None where cells would be too
    many or no whole number of places."""
    if zones.shape[1] % turns:
        return None
    places = zones.shape[1] // turns
    of_cs, of_fs = (spectrum_of(table if table.size else np.zeros((2, 2))) for table in (cs, fs))
    rows = _derivatives(zones, 2 * math.pi / places)
    bend = float(np.abs(np.diff(rows[:, 2])).max()) * places / (2 * math.pi)
    bend = per_mm * (bend + largest(of_cs, 3) + largest(of_fs, 3) * advance**3)
    bow = per_mm * (float(np.abs(rows[:, 2]).max()) + largest(of_fs, 2) * advance**2)
    chords = math.pi * math.sqrt(bow / (2 * LEFT_BY_CHORD))
    cells, each = _cells(places, MOST_BOUNDS // turns, parts(bend, LEFT_BY_CELL), chords)
    if not cells or cells * each * turns > MOST_BOUNDS:
        return None
    # Four a cell at least: where a function jumps between the last turn and the first, half a place is not told.
    told = max(cells, parts(bend, LEFT_BY_CELL))
    fewest = max(4 * told, parts(bend, LEFT_BY_PLACE))
    every = next(n for n in range(places, 0, -1) if n == 1 or (places % n == 0 and places // n >= fewest))
    on_cs, on_fs = (table_of(spectrum, parts(bend, LEFT_BY_PLACE)) for spectrum in (of_cs, of_fs))
    phases = np.arange(turns, dtype=np.float64) * (advance % 1.0) % 1.0 * 2 * math.pi
    bounds, scan = _bounds(zones, of_cs, (turns, cells), smooth=each > 1)
    met = on_fs_of(of_fs if fs.size else None, (turns, cells, each), advance)
    # Between places of the table nothing is seen of what goes beyond a chord.
    beyond = met.beyond + float(np.abs(rows[:, 2]).max()) * (2 * math.pi / places) ** 2 / 8
    scan = scan._replace(below=scan.below - met.lowest, above=scan.above + met.highest)
    turn = Turn(
        scan,
        NO_PARTS,
        NO_WAVES,
        singles(rows.transpose(2, 0, 1).reshape(-1, 6)[::every]),
        on_cs if cs.size else on_cs[:0],
        cs_bend=single(largest(of_cs, 2)),
        cs_slope=single(largest(of_cs, 1)),
        cs_range=single(float(np.ptp(on_cs[:, [0, 3]]))),
        reach=single(min(FARTHEST, OVERLAP * math.pi / (cells * each))),
    )
    padded: Array = np.zeros(-(-turns // GROUP) * GROUP)
    padded[:turns] = phases
    flat: Array = np.concatenate([np.cos(padded), np.sin(padded), bounds.ravel()])
    edges = np.arange(-(-(cells + 1) // GROUP) * GROUP) * (2 * math.pi / cells)
    circle = np.array([f(by * edges) for by in (1.0, advance) for f in (np.cos, np.sin)], dtype=np.float64)
    return Beat(
        turn,
        singles(circle.reshape(4, -1, GROUP).transpose(1, 0, 2).ravel()),
        singles(flat),
        singles(phases),
        places // every,
        on_fs if fs.size else on_fs[:0],
        single(float(np.ptp(on_fs[:, [0, 3]]))),
        met,
        _parts(zones, scan_of(np.zeros((2, 2), complex), of_cs, cells), (turns, cells, each), beyond),
    )


def _cells(places: int, most: int, fewest: int, chords: float) -> tuple[int, int]:
    """How many cells a turn of so many `places` has, and how many parts each: the `fewest` that parabolas ask for, as
    parts also what `chords` do, where that is not more than there are places or bounds for (`most`). (0, 1) where no
    whole number of places does."""
    if fewest >= PARTS_FROM:
        for wanted in (math.ceil(chords), fewest):
            for n in range(max(fewest, min(wanted, places, most)), min(places, most) + 1):
                if places % n == 0:
                    for cells in range(MOST_PARTED, FEWEST_CELLS - 1, -1):
                        if n % cells == 0:
                            return cells, n // cells
    whole = (n for n in range(FEWEST_CELLS, places + 1) if places % n == 0 and n >= fewest)
    return next(whole, 0), 1


def _derivatives(values: Array, step: float) -> Array:
    """Value, slope and curvature (per rad) of `values` (2, m) on even places, (2, 3, m): of the fourth order; beyond
    either end a cubic goes on, since what fits no whole number of waves jumps there."""
    first, last = values[:, :4], values[:, :-5:-1]
    on = np.array([[4.0, -6.0, 4.0, -1.0], [10.0, -20.0, 15.0, -4.0]])
    e = np.concatenate([(first @ on.T)[:, ::-1], values, last @ on.T], axis=1)
    m = values.shape[1]
    a, b, c, d, f = (e[:, k : k + m] for k in range(5))
    slope = (a - 8 * b + 8 * d - f) / (12 * step)
    bend = (-a + 16 * b - 30 * c + 16 * d - f) / (12 * step**2)
    return np.stack([values, slope, bend], axis=1)


def _beyond(zones: Array, edges: Array, inside: int) -> tuple[Array, Array]:
    """How far `zones` (2, m) go below and above the chords between `edges` (2, m / inside) over so many places each
    (`inside`), both ends counted, in either zone, (m / inside,) each."""
    share = np.arange(inside + 1) / inside
    after = np.roll(edges, -1, axis=1)
    chords = edges[:, :, None] * (1 - share) + after[:, :, None] * share
    own = zones.reshape(2, -1, inside)
    beyond = np.concatenate([own, np.roll(own[:, :, :1], -1, axis=1)], axis=2) - chords
    return np.maximum(-beyond.min(axis=(0, 2)), 0), np.maximum(beyond.max(axis=(0, 2)), 0)


def _midway(zones: Array, inside: int) -> Array:
    """Midway between the least and the greatest of `zones` (2, m) within half a cell of so many places (`inside`) of
    each edge, (2, m / inside): where waves are shorter than a cell, what they are laid upon."""
    before = inside // 2
    near = np.roll(zones, before, axis=1).reshape(2, -1, inside)
    found: Array = (near.min(axis=2) + near.max(axis=2)) / 2
    return found


def _bounds(zones: Array, of_cs: Array, size: tuple[int, int], smooth: bool) -> tuple[Array, Scan]:
    """The rows of KINDS, (c + 1, KINDS, padded turns), and the scan of the cells over all turns, of so many turns and
    cells (`size`), without what stands on the FS; `smooth` where waves are shorter than a cell."""
    turns, cells = size
    inside = zones.shape[1] // (turns * cells)
    edges = _midway(zones, inside) if smooth else zones[:, ::inside]
    below, above = _beyond(zones, edges, inside)
    if not smooth:
        below = above = np.maximum(below, above)
    after = np.roll(edges, -1, axis=1)
    lowest, highest = np.minimum(edges, after).min(axis=0) - below, np.maximum(edges, after).max(axis=0) + above
    scan = scan_of(np.zeros((2, 2), complex), of_cs, cells)
    below_cs, above_cs = np.tile(scan.below, turns), np.tile(scan.above, turns)
    of_cells = [found.reshape(turns, cells) for found in (lowest, highest)]
    scan = scan._replace(
        below=singles(scan.below - of_cells[0].min(axis=0)), above=singles(scan.above + of_cells[1].max(axis=0))
    )
    padded = np.zeros((cells + 1, KINDS, -(-turns // GROUP) * GROUP))
    padded[:, 2:, turns:] = -1e9
    kinds = [(edges[0] + edges[1]) / 2, (edges[0] - edges[1]) / 2, below + below_cs, above + above_cs]
    for row, found in enumerate(kinds):
        padded[:-1, row, :turns] = found.reshape(turns, cells).T
        padded[-1, row, :turns] = np.roll(found.reshape(turns, cells)[:, 0], -1)
    return padded, scan


def _parts(zones: Array, of_cs: Scan, size: tuple[int, int, int], unseen: float) -> Parts:
    """The parts of so many turns, cells, and parts of each (`size`); the cells' chords leave out what stands on the CS
    as its scan says, `of_cs`, and those of the parts what is `unseen` here."""
    turns, cells, each = size
    if each == 1:
        return Parts(1, singles(np.zeros(0)), 0, 0, single(0.0))
    inside = zones.shape[1] // (turns * cells * each)
    edges = zones[:, ::inside]
    beyond = max(float(x.max()) for x in _beyond(zones, edges, inside))
    beyond += max(float(x.max()) for x in (of_cs.below, of_cs.above)) + unseen
    own = edges.reshape(2, turns * cells, each)
    own = np.concatenate([own, np.roll(own[:, :, :1], -1, axis=1)], axis=2)
    rows = (own[0] + own[1]) / 2, (own[0] - own[1]) / 2
    kinds = 2 if rows[1].any() else (1 if rows[0].any() else 0)
    fixed = np.stack([rows[0], rows[1]][:kinds], axis=1).ravel() if kinds else np.zeros(0)
    # Lanes beyond a cell's parts read on.
    return Parts(each, singles(np.append(fixed, np.zeros(each + 2 * GROUP))), kinds, len(fixed), single(beyond))
