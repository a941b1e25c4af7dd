"""Effects beside teeth that are known one by one, measured or drawn: these are an effect on their spline."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import ERROR_NAMES
from hdopt.drive.geometry import Drive
from hdopt.kinematics.essential import on_table
from hdopt.parallel.shared_memory import in_blocks
from hdopt.simulation.batch import AddedTable, CellsOfTurn, matrix_peak_to_peak_arcmin

SINES = [ERROR_NAMES.index(name) for name in ("cs_tooth_amplitude", "fs_tooth_amplitude")]
"""Their columns in `DriveErrors.to_matrix`."""
DRIVES = 32
"""Drives with teeth of their own that a thread takes at a time."""


def with_teeth(added: AddedTable, drive: Drive, cs: Array, fs: Array) -> AddedTable:
    """`added` for the ratio of `drive` with teeth whose mean in mesh is `cs` and `fs` over one turn of the spline, mm
    of arc, (12 Z,) each, or empty: both zones meet them where they stand."""
    turns = drive.geometry.beat_phases
    found = []
    for beside, table in zip((added.cs, added.fs), (cs, fs), strict=True):
        if not len(table):
            found.append(beside)
            continue
        places = beside.shape[1] or math.ceil(len(table) / turns) * turns
        angle = np.arange(places, dtype=np.float64) * (2 * math.pi / places)
        met = np.stack([on_table(table, angle), on_table(table, angle + math.pi)])
        found.append(beside + met if beside.size else met)
    return replace(added, cs=found[0], fs=found[1])


@dataclass(frozen=True)
class SharedByTeeth:
    """What teeth in contact leave, term by term: `homogenization` of the effects between them, `misalignment` of the
    arc that misalignment makes, `sines` of the tooth sines beside a table."""

    homogenization: float = 1.0
    misalignment: float = 1.0
    sines: float = 1.0


WHOLE = SharedByTeeth()
"""Nothing is evened out."""


def same_teeth_peak_to_peak_arcmin(
    drive: Drive, matrix: Array, added: AddedTable, tables: tuple[Array, Array], shared: SharedByTeeth = WHOLE
) -> Array:
    """Peak-to-peak (arcmin) of drives that are built as `drive` with errors as rows of `matrix` (n, 12), (n,): all with
    the effects of `added`, the table of the drive without its teeth, and with the same teeth.

    `tables` of CS and FS are what the teeth in contact make of them over one turn, mm of arc, (12 Z,) each, or empty,
    as `mesh_tables` gives them; `shared` what they leave of the other terms.
    """
    evened, same = _evened_out(added, shared.homogenization), _with_share(drive, shared.misalignment)
    return matrix_peak_to_peak_arcmin(same, _with_sines(matrix, shared.sines), with_teeth(evened, drive, *tables))


def own_teeth_peak_to_peak_arcmin(
    drive: Drive,
    matrix: Array,
    added: AddedTable,
    tables: Callable[[slice], tuple[Array, Array]],
    shared: SharedByTeeth = WHOLE,
) -> Array:
    """The same of drives that each have teeth of their own, (n,), some seven times slower: `drive`, `matrix`, `added`
    and `shared` as there. `tables` gives those of CS and FS for a slice of rows, (k, 12 Z), or (1, 12 Z) for a spline
    whose teeth are the same in all drives."""
    rows = _with_sines(matrix, shared.sines)
    evened, same = _evened_out(added, shared.homogenization), _with_share(drive, shared.misalignment)
    out, cells = np.empty(len(rows)), CellsOfTurn.of(same, evened)

    def fill(block: slice) -> None:
        cs, fs = tables(block)
        for i in range(block.start, block.stop):
            own = [table[min(i - block.start, len(table) - 1)] for table in (cs, fs)]
            met = with_teeth(evened, drive, own[0], own[1])
            cells.on_splines(met).fill(rows[i : i + 1], out[i : i + 1])

    in_blocks(len(rows), DRIVES, fill)
    return out


def _with_sines(matrix: Array, share: float) -> Array:
    """`matrix` (n, 12) with the `share` of its tooth sines."""
    rows = np.array(matrix, dtype=np.float64)
    rows[:, SINES] *= share
    return rows


def _evened_out(added: AddedTable, k_e: float) -> AddedTable:
    """What the teeth in contact leave of the effects `added`."""
    return replace(added, zones=k_e * added.zones, cs=k_e * added.cs, fs=k_e * added.fs)


def _with_share(drive: Drive, misalignment: float) -> Drive:
    """`drive` whose misalignment makes the share `misalignment` of its arc: the pressure angle does that alone."""
    angle = math.atan(misalignment * math.tan(drive.geometry.pressure_angle))
    return replace(drive, geometry=replace(drive.geometry, pressure_angle=angle))
