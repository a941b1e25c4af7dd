"""Effects over a full relative turn as the lanes take them: what bounds a cell in every turn, and values to look up."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Singles
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.single import single
from hdopt.simulation.turn.effects import (
    FARTHEST,
    LEFT_BY_CELL,
    LEFT_BY_PLACE,
    NO_PARTS,
    OVERLAP,
    Scan,
    Turn,
    derived,
    largest,
    parts,
    scan_of,
    singles,
    spectrum_of,
    table_of,
)

FEWEST_CELLS = 60
"""Wider cells than of effects that repeat, since each is taken in every turn, and places are looked at twice."""
MOST_BOUNDS = 2**18
"""Cells of all turns at most: 4 MiB of bounds."""
OFFSET = 0.1
"""Offsets o', rad, up to which the bend of an effect on the FS is looked at: three times the shipped tolerances reach
0.07. Where a drive's are larger the effect's range is left open."""
KINDS = 6
"""Rows of an edge: of the effects the mean of both zones and half their difference; how far a cell goes beyond its
chord, mm of arc; of those on the FS the slope in either zone, mm of arc per rad, and half the largest curvature near
the cell."""


class Beat(NamedTuple):
    """Effects of one direction over B input turns of c cells, mm of arc.

    `turn`: the cells, bounded over all turns, with what stands on the CS; its `fixed` (places of all turns, 6) is the
    rest. `circle`, flat: cosine and sine of the edges, and of these times Z_CS/Z_FS, group by group. `bounds`, flat:
    cosine and sine of the FS phase in every turn, then for each edge the rows of KINDS; rows are padded to whole
    groups, with turns that nothing is expected of. `phases` (B,), rad; `per_turn` places of `fixed` a turn; `fs` (m, 6)
    or (0, 6), what stands on the FS, with its largest slope and its range.
    """

    turn: Turn
    circle: Singles
    bounds: Singles
    phases: Singles
    per_turn: int
    fs: Singles
    fs_slope: float
    fs_range: float


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
    cells = next((n for n in range(FEWEST_CELLS, places + 1) if places % n == 0 and n >= parts(bend, LEFT_BY_CELL)), 0)
    if not cells or cells * turns > MOST_BOUNDS:
        return None
    # Four a cell at least: where a function jumps between the last turn and the first, half a place is not told.
    fewest = max(4 * cells, parts(bend, LEFT_BY_PLACE))
    every = next(n for n in range(places, 0, -1) if n == 1 or (places % n == 0 and places // n >= fewest))
    on_cs, on_fs = (table_of(spectrum, parts(bend, LEFT_BY_PLACE)) for spectrum in (of_cs, of_fs))
    phases = np.arange(turns, dtype=np.float64) * (advance % 1.0) % 1.0 * 2 * math.pi
    bounds, scan = _bounds(zones, of_fs if fs.size else None, of_cs, (turns, cells), advance)
    turn = Turn(
        scan,
        NO_PARTS,
        singles(rows.transpose(2, 0, 1).reshape(-1, 6)[::every]),
        on_cs if cs.size else on_cs[:0],
        cs_bend=single(largest(of_cs, 2)),
        cs_slope=single(largest(of_cs, 1)),
        cs_range=single(float(np.ptp(on_cs[:, [0, 3]]))),
        reach=single(min(FARTHEST, OVERLAP * math.pi / cells)),
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
        single(largest(of_fs, 1)),
        single(float(np.ptp(on_fs[:, [0, 3]]))),
    )


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


def _bounds(
    zones: Array, of_fs: Array | None, of_cs: Array, size: tuple[int, int], advance: float
) -> tuple[Array, Scan]:
    """The rows of KINDS, (c + 1, KINDS, padded turns), and the scan of the cells over all turns, of so many turns and
    cells (`size`); effects on the FS are met there as if o' were 0."""
    turns, cells = size
    m, inside = zones.shape[1], zones.shape[1] // (turns * cells)
    slopes, bent = np.zeros((2, m)), np.zeros(m)
    if of_fs is not None:
        # Places of the FS that the input's places meet.
        at = np.arange(m) * (advance * turns / m) % 1.0
        fine = 8 * of_fs.shape[1]
        grid = np.arange(fine + 1) / fine
        met = [
            np.array([np.interp(at, grid, np.append(row, row[0])) for row in derived(of_fs, k, fine)]) for k in range(3)
        ]
        zones, slopes, bent = zones + met[0], met[1], np.abs(met[2]).max(axis=0) / 2
    edges, after = zones[:, ::inside], np.roll(zones[:, ::inside], -1, axis=1)
    share = np.arange(inside) / inside
    chords = edges[:, :, None] * (1 - share) + after[:, :, None] * share
    sag, bent = np.abs(zones.reshape(2, -1, inside) - chords).max(axis=(0, 2)), bent.reshape(-1, inside).max(axis=1)
    if of_fs is not None:
        near = math.ceil(OFFSET * cells / (2 * math.pi))
        sag, bent = (np.max([np.roll(x, k) for k in range(-near, near + 1)], axis=0) for x in (sag, bent))
    lowest, highest = np.minimum(edges, after).min(axis=0) - sag, np.maximum(edges, after).max(axis=0) + sag
    scan = scan_of(np.zeros((2, 2), complex), of_cs, cells)
    on_cs = np.maximum(scan.below, scan.above)
    of_cells = [found.reshape(turns, cells) for found in (lowest, highest)]
    scan = scan._replace(
        below=singles(scan.below - of_cells[0].min(axis=0)), above=singles(scan.above + of_cells[1].max(axis=0))
    )
    padded = np.zeros((cells + 1, KINDS, -(-turns // GROUP) * GROUP))
    padded[:, 2, turns:] = -1e9
    kinds = [
        edges[0] + edges[1],
        edges[0] - edges[1],
        2 * (sag + np.tile(on_cs, turns)),
        *(2 * slopes[:, ::inside]),
        2 * bent,
    ]
    for row, found in enumerate(kinds):
        found = found / 2
        padded[:-1, row, :turns] = found.reshape(turns, cells).T
        padded[-1, row, :turns] = np.roll(found.reshape(turns, cells)[:, 0], -1)
    return padded, scan
