"""Effects over one input turn as the lanes take them: cells for the scan, values with slopes and curvatures to look up.

What repeats every turn is a periodic function of the input angle, so that its Fourier series gives slopes and
curvatures; a parabola then holds it within half a cell. Cells are as many as that takes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Singles
from hdopt.kinematics.lanes.single import single, singles
from hdopt.simulation.turn.waves import NO_WAVES, Waves, waves_of

FEWEST_CELLS, MOST_CELLS = 96, 4096
LEFT_BY_CELL, LEFT_BY_PLACE = 1e-4, 2e-5
"""What a parabola of an effect may leave within half a cell, and within half a place of the table, arcmin."""
RIPPLE_FROM = 8 * FEWEST_CELLS
"""So many cells and more are first bounded by the envelope of what is fast."""
SLOW_CELLS, SLOWEST = 2 * FEWEST_CELLS, 12
"""Cells that what is slow may ask for, and the highest order that may count as slow."""
IN_CELL = 16
"""Places of a cell at which what goes beyond its chord is looked for."""
WIDER = 1.2
"""How much more of the CS a zone may pass than the wave generator turns: offsets as shipped change by 0.04 a rad."""
REPEATS = 1e-7
"""arcmin by which turns may differ and still repeat: rounding of the input angle in effects of a high order."""
OVERLAP, FARTHEST = 1.5, 0.12
"""How many cells a parabola is followed, and how far, rad, at most to either side."""


class Scan(NamedTuple):
    """The cells: cosine and sine of their edges (c + 1,) and middles (c,). `edges` (c + 1, 4), mm of arc and mm/rad: of
    the effects in both zones the mean, half the difference, and the same of how they change with the offset o, where
    they stand on the CS. How far they go below and above their chord in a cell, (c,); half their difference at the
    middles, (c,). w^2/8 and w/2 of the cells' width w, rad; how much half the difference changes in a cell at most."""

    cos: Singles
    sin: Singles
    mid_cos: Singles
    mid_sin: Singles
    edges: Singles
    below: Singles
    above: Singles
    mid: Singles
    sag: float
    half: float
    step: float


class Fine(NamedTuple):
    """Cells for effects that ripple, `parts` of each cell of the scan, which then bounds these by what is slow and the
    envelope of the rest; no parts where the scan tells all. Cosine and sine of the edges (n + 1,). `edges` (n + 1, 2),
    mm of arc: of the effects that do not stand on the CS the mean of both zones and half their difference. How far all
    go below and above their chord, (n,). The width of a part, rad."""

    parts: int
    cos: Singles
    sin: Singles
    edges: Singles
    below: Singles
    above: Singles
    width: float


class Turn(NamedTuple):
    """Effects of one direction over an input turn: the `scan`, with its `fine` parts, and `waves` that both zones
    share; value (mm of arc), slope and curvature (per rad) in zone 1, then in zone 2, on even places of the input
    angle, `fixed` (n, 6), and of the CS, `cs` (m, 6) or (0, 6); of the latter (where there are parts, of what is slow
    on it) the largest curvature and slope, and the range; how far a parabola is followed, rad."""

    scan: Scan
    fine: Fine
    waves: Waves
    fixed: Singles
    cs: Singles
    cs_bend: float
    cs_slope: float
    cs_range: float
    reach: float


def turn_of(zones: Array, cs: Array, turns: int, per_mm: float) -> Turn | None:
    """What `zones` (2, m), mm of arc on even places of `turns` input turns, and `cs` (2, k), over a turn of the CS or
    on no places, add; `per_mm` is arcmin per mm of arc. None where turns differ, or where no cell is fine enough."""
    if zones.shape[1] % turns:
        return None
    folded = zones.reshape(2, turns, -1)
    if float(np.ptp(folded, axis=1).max()) * per_mm > REPEATS:
        return None
    fixed, on_cs = spectrum_of(folded[:, 0]), spectrum_of(cs if cs.size else np.zeros((2, 2)))
    bend = max(largest(fixed, 3), largest(on_cs, 3)) * per_mm
    cells = max(FEWEST_CELLS, parts(bend, LEFT_BY_CELL))
    if cells > MOST_CELLS:
        return None
    places = max(folded.shape[2], parts(bend, LEFT_BY_PLACE))
    tables = [table_of(spectrum, places) for spectrum in (fixed, on_cs)]
    of_cs = tables[1] if cs.size else tables[1][:0]
    if cells >= RIPPLE_FROM:
        scan, fine, waves, slow_cs = _with_parts(fixed, on_cs, cells, per_mm)
        width = fine.width
    else:
        scan, fine, waves, slow_cs, width = scan_of(fixed, on_cs, cells), NO_PARTS, NO_WAVES, on_cs, 2 * math.pi / cells
    return Turn(
        scan,
        fine,
        waves,
        tables[0],
        of_cs,
        cs_bend=single(largest(slow_cs, 2)),
        cs_slope=single(largest(slow_cs, 1)),
        cs_range=single(float(np.ptp(derived(slow_cs, 0, len(tables[1]))))),
        reach=single(min(FARTHEST, OVERLAP / 2 * width)),
    )


def _with_parts(fixed: Array, on_cs: Array, cells: int, per_mm: float) -> tuple[Scan, Fine, Waves, Array]:
    """The scan of what is slow of two spectra, widened by the envelope of what is fast, its parts, so that they are
    `cells` at least, and what is slow on the CS."""

    def wanted(highest: int) -> int:
        bend = per_mm * sum(largest(_orders(x, 0, highest), 3) for x in (fixed, on_cs))
        return max(FEWEST_CELLS, parts(bend, LEFT_BY_CELL))

    highest = next((n for n in range(SLOWEST, 0, -1) if wanted(n) <= SLOW_CELLS), 0)
    coarse = wanted(highest)
    each = math.ceil(cells / coarse)
    (slow, fast), (slow_cs, fast_cs) = (
        (_orders(x, 0, highest), _orders(x, highest + 1, x.shape[1])) for x in (fixed, on_cs)
    )
    scan = scan_of(slow, slow_cs, coarse)
    inside = math.ceil(IN_CELL * max(fixed.shape[1], on_cs.shape[1]) / coarse)
    left = (2 * math.pi / (coarse * inside)) ** 2 / 8 * largest(fast, 2)
    waves = derived(fast, 0, coarse * inside).reshape(2, coarse, inside)
    first = np.roll(waves[:, :, 0], -1, axis=1)
    beside = derived(fast_cs, 0, IN_CELL * fast_cs.shape[1])
    lowest = np.minimum(waves.min(axis=(0, 2)), first.min(axis=0)) - left + float(beside.min())
    highest_of = np.maximum(waves.max(axis=(0, 2)), first.max(axis=0)) + left + float(beside.max())
    scan = scan._replace(below=singles(scan.below - lowest), above=singles(scan.above + highest_of))
    width = 2 * math.pi / (coarse * each)
    all_fixed = scan_of(fixed, np.zeros((2, 2), complex), coarse * each)
    sag = (WIDER * width) ** 2 / 8 * largest(on_cs, 2)
    fine = Fine(
        each,
        all_fixed.cos,
        all_fixed.sin,
        np.ascontiguousarray(all_fixed.edges[:, :2]),
        all_fixed.below + single(sag),
        all_fixed.above + single(sag),
        single(width),
    )
    return scan, fine, waves_of(fixed, on_cs, highest, per_mm), slow_cs


def _orders(spectrum: Array, first: int, last: int) -> Array:
    """Only the orders of a `spectrum` from `first` to `last`."""
    found: Array = np.zeros_like(spectrum)
    found[:, first : last + 1] = spectrum[:, first : last + 1]
    return found


def spectrum_of(values: Array) -> Array:
    """Fourier coefficients of `values` (2, n) over a turn, the highest order left out where its phase is unknown."""
    found: Array = np.fft.rfft(values) / values.shape[1]
    if values.shape[1] % 2 == 0:
        found[:, -1] = 0.0
    return found


def derived(spectrum: Array, times: int, places: int) -> Array:
    """The function of a `spectrum` (2, orders), or so many `times` its derivative, on so many even `places` of a turn,
    (2, places)."""
    orders = np.arange(spectrum.shape[1])
    return np.asarray(np.fft.irfft(spectrum * (1j * orders) ** times, places) * places)


def largest(spectrum: Array, times: int) -> float:
    """The largest value in either zone of the function of a `spectrum`, or of so many `times` its derivative."""
    return float(np.abs(derived(spectrum, times, 2 * spectrum.shape[1])).max())


def parts(bend: float, left: float) -> int:
    """Parts of a turn within half of which a parabola leaves at most `left`, by the third derivative's most, `bend`."""
    return math.ceil(math.pi * math.cbrt(bend / (6 * left)))


def table_of(spectrum: Array, places: int) -> Singles:
    """Value, slope and curvature of both zones' `spectrum` on so many `places` at least, (places, 6)."""
    places = max(places, 2 * spectrum.shape[1])
    rows = [derived(spectrum, times, places)[zone] for zone in range(2) for times in range(3)]
    return singles(np.stack(rows, axis=1))


def scan_of(fixed: Array, on_cs: Array, cells: int) -> Scan:
    """The `cells` of a turn for the effects of the spectra `fixed` and `on_cs`."""
    inside = max(IN_CELL, 2 * math.ceil(max(fixed.shape[1], on_cs.shape[1]) / cells))
    inner = (derived(fixed, 0, cells * inside) + derived(on_cs, 0, cells * inside)).reshape(2, cells, inside)
    slopes = derived(on_cs, 1, cells * inside)[:, ::inside]
    first, share = inner[:, :, 0], np.arange(inside) / inside
    after = np.roll(first, -1, axis=1)
    beyond = inner - (first[:, :, None] * (1 - share) + after[:, :, None] * share)
    below, above = np.maximum(-beyond.min(axis=(0, 2)), 0), np.maximum(beyond.max(axis=(0, 2)), 0)
    one, two, half = first[0], first[1], inner[0] - inner[1]
    # Zone 2 meets the CS at its end less o.
    edges = np.stack([one + two, one - two, slopes[0] - slopes[1], slopes[0] + slopes[1]], axis=1) / 2
    angle, width = np.arange(cells + 1) * (2 * math.pi / cells), 2 * math.pi / cells
    middle = angle[:-1] + width / 2
    return Scan(
        singles(np.cos(angle)),
        singles(np.sin(angle)),
        singles(np.cos(middle)),
        singles(np.sin(middle)),
        singles(np.concatenate([edges, edges[:1]])),
        singles(below),
        singles(above),
        singles(half[:, inside // 2] / 2),
        sag=single(width**2 / 8),
        half=single(width / 2),
        step=single(float(np.ptp(half, axis=1).max()) / 2),
    )


_NONE: Singles = np.zeros(0, np.float32)
NO_PARTS = Fine(0, _NONE, _NONE, np.zeros((0, 2), np.float32), _NONE, _NONE, single(0.0))
"""Where the scan tells all."""
