"""Converged peak-to-peak of many drives that all have the same effects: what stacks and searches evaluate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive, Structure
from hdopt.effects.met import Spline
from hdopt.errors import HdoptError
from hdopt.kinematics.waveform import full_turn
from hdopt.parallel.shared_memory import in_blocks
from hdopt.simulation.effect_values import EffectValues
from hdopt.simulation.gearing import Gearing, gearing_of
from hdopt.simulation.model import ExtendedModel
from hdopt.simulation.operation import Operation

if TYPE_CHECKING:
    from hdopt.simulation.beat.effects import Beat
    from hdopt.simulation.cell_kernel import CellTable, SplineTables
    from hdopt.simulation.turn.effects import Turn
    from hdopt.simulation.walk_kernel import Added

WALK_PER_TURN, TABLE_PER_TURN = 180, 1440
"""Cells, and places of the table, in an input turn at least."""
WALK_PER_PERIOD, TABLE_PER_PERIOD = 8, 32
"""The same in a period of the highest order."""
ON_SPLINE = 2
"""How many times finer the tables over a turn of a spline are: they are short."""
BLOCK, LANES_BLOCK = 64, 1024
"""Drives a thread takes at a time: turn by turn, and in lanes."""


NO_PLACES: Array = np.empty((2, 0))


@dataclass(frozen=True)
class AddedTable:
    """Effects over one full relative turn: `zones` (d, 2, m) mm of arc in both meshing zones, `beside` (d, m) arcmin at
    the output, for each of d directions of the motion, on m even places. A first walk takes every `stride`-th. `cs` and
    `fs` (2, places): what zones 1 and 2 meet of effects on the splines over a turn of each, mm of arc, counted from
    where the zone's end of the major axis stands at input angle 0; on no places where there are none. Where on it a
    zone stands is a matter of each drive's errors."""

    zones: Array
    beside: Array
    stride: int
    cs: Array = field(default_factory=lambda: NO_PLACES)
    fs: Array = field(default_factory=lambda: NO_PLACES)
    _in_lanes: dict[tuple[float, int, float, bool], tuple[list[Turn], list[Beat]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @cached_property
    def walked(self) -> Added:
        """The same as the compiled walk takes it, on the places of the first walk."""
        from hdopt.simulation.walk_kernel import Added

        every = slice(None, None, self.stride)
        zones, beside = self.zones[..., every], self.beside[:, every]
        return Added(np.ascontiguousarray(zones), np.ascontiguousarray(beside), self.cs, self.fs)

    @property
    def every_place(self) -> Added:
        """The same on all places."""
        from hdopt.simulation.walk_kernel import Added

        return Added(self.zones, self.beside, self.cs, self.fs)

    def in_lanes(self, per_mm: float, turns: int, advance: float, fold: bool = True) -> tuple[list[Turn], list[Beat]]:
        """The same for the lanes, direction by direction: where all repeat in each of so many input `turns` as one turn
        of each, else as all turns; neither where they are too fine for either. `per_mm` is arcmin per mm of arc times
        k_e, `advance` Z_CS/Z_FS; without `fold` turns count one by one though they repeat. Made once."""
        key = (per_mm, turns, advance, fold)
        if key not in self._in_lanes:
            from hdopt.simulation.beat.effects import beat_of
            from hdopt.simulation.turn.effects import turn_of

            zones = [zones + beside / per_mm for zones, beside in zip(self.zones, self.beside, strict=True)]
            each = [None if self.fs.size or not fold else turn_of(table, self.cs, turns, per_mm) for table in zones]
            repeating, every = [turn for turn in each if turn is not None], []
            if len(repeating) < len(zones):
                found = [beat_of(table, self.cs, self.fs, turns, advance, per_mm) for table in zones]
                repeating, every = [], [beat for beat in found if beat is not None]
                every = every if len(every) == len(zones) else []
            self._in_lanes[key] = repeating, every
        return self._in_lanes[key]

    @property
    def widest_arcmin(self) -> float:
        """Range of what is beside the zones, arcmin."""
        return float(np.ptp(self.beside))

    @property
    def widest_mm(self) -> float:
        """Range of what is in the zones, mm of arc."""
        return float(np.ptp(self.zones)) + sum(float(np.ptp(t)) for t in (self.cs, self.fs) if t.size)


def tabulate(drive: Drive, effects: Sequence[EffectValues], operation: Operation) -> AddedTable:
    """The table of these `effects` for the ratio of `drive` at the condition `operation`; its measured teeth are left
    out (`own_teeth` adds them).

    Raises `HdoptError` for effects that are no function of the angle alone, or too fine for the table.
    """
    drive = replace(drive, cs_teeth=None, fs_teeth=None, cs_roundness=None)
    model = ExtendedModel(drive, DriveErrors(), tuple(effects), operation)
    if following := [effect.id for effect in effects if effect.follows_base]:
        raise HdoptError(
            f"{', '.join(following)} follows each drive's own waveform and speed, which only ke computes; "
            "leave the bench out with operation.include=drive, or remove the effect"
        )
    if model.too_fine:
        raise HdoptError(
            f"{', '.join(effect.id for effect in model.too_fine)} is a ripple too fine for tolerances and searches; "
            "leave the bench out with operation.include=drive, or remove the effect"
        )
    if not drive.wave_generator.profile.tip_is_smooth:
        raise HdoptError(
            f"effects need a profile with smooth tips here, which {drive.wave_generator.profile.name!r} has not; "
            "leave them out with operation.include=none"
        )
    order = max((effect.highest_order(model.ratio) for effect in effects), default=0.0)
    walk = max(WALK_PER_TURN, math.ceil(WALK_PER_PERIOD * order))
    stride = math.ceil(max(TABLE_PER_TURN, TABLE_PER_PERIOD * order) / walk)
    theta = full_turn(drive, walk * stride)
    directions = operation.directions
    return AddedTable(
        np.stack([model.fixed_in_zones(theta, direction) for direction in directions]),
        np.stack([model.beside(theta, direction) for direction in directions]),
        stride,
        *(_on_spline(model, spline, ON_SPLINE * walk * stride) for spline in Spline),
    )


def _on_spline(model: ExtendedModel, spline: Spline, places: int) -> Array:
    """What both zones meet of the effects of `model` on a `spline` over a turn of it, mm of arc, (2, so many places at
    least); (2, 0) where nothing stands on it. Places are a multiple of the turns after which the teeth meet again."""
    found = [(met, c) for met, c in model.on_splines() if met.spline is spline]
    if not found:
        return NO_PLACES
    turns = model.drive.geometry.beat_phases
    places = math.ceil(places / turns) * turns
    angle = np.arange(places, dtype=np.float64) * (2 * math.pi / places)
    table = np.zeros((2, places))
    for met, c in found:
        for zone in (0, 1):
            table[zone] += met.added(angle + math.pi * zone, zone, c)[0]
    return table


def matrix_peak_to_peak_arcmin(drive: Drive, matrix: Array, added: AddedTable, homogenization: float = 1.0) -> Array:
    """Peak-to-peak (arcmin) of drives with errors as rows of `matrix` (`DriveErrors.to_matrix`), (n, 12) -> (n,), and
    the effects of the table `added`.

    `homogenization` is k_e, which evens out what the zones drive. Within 1e-3 arcmin of `simulation.extremes` in the
    closed form (a test measures it).
    """
    matrix = np.ascontiguousarray(matrix, dtype=np.float64)
    out, cells = np.empty(len(matrix)), CellsOfTurn.of(drive, added, homogenization)

    def fill(rows: slice) -> None:
        cells.fill(matrix[rows], out[rows])

    in_blocks(len(matrix), BLOCK, fill)
    return out


@dataclass(frozen=True)
class CellsOfTurn:
    """What the compiled kernel knows of drives with effects besides their errors: their `gearing`, and the `table` of
    the effects cell by cell."""

    gearing: Gearing
    table: CellTable

    @classmethod
    def of(cls, drive: Drive, added: AddedTable, homogenization: float = 1.0) -> CellsOfTurn:
        """Of the effects of the table `added` in drives that are built as `drive`; `homogenization` is k_e."""
        from hdopt.simulation.cell_kernel import cell_table

        gearing = gearing_of(drive, homogenization)
        cells = added.zones.shape[2] // (added.stride * gearing.turns)
        splines = _spline_tables(added, gearing.advance, cells)
        table = cell_table(added.zones, added.beside, cells, gearing.turns, gearing.scale, splines)
        return cls(gearing, table)

    def on_splines(self, added: AddedTable) -> CellsOfTurn:
        """The same with what `added` has on the splines."""
        cells = self.table.least.shape[2]
        return replace(self, table=self.table._replace(splines=_spline_tables(added, self.gearing.advance, cells)))

    def fill(self, rows: Array, out: Array) -> None:
        """Fill `out` (n,) with the peak-to-peak, arcmin, of drives with errors as `rows` (n, 12)."""
        from hdopt.simulation.cell_kernel import extended_block

        extended_block(self.gearing, rows, self.table, out)


def stacked_peak_to_peak_arcmin(drive: Drive, matrix: Array, added: AddedTable, homogenization: float = 1.0) -> Array:
    """The same as `matrix_peak_to_peak_arcmin` of `drive`, `matrix` (n, 12), `added` and `homogenization`, (n,), for as
    many drives as a stack has: some twelve times as fast.

    In single precision, within 1e-3 arcmin of it for 99 % of drives at up to three times the shipped tolerances; the
    same figures where effects are so fine that neither one turn nor all of them fit into tables.
    """
    from hdopt.kinematics.kernel import design_of

    gear = drive.geometry
    scale = homogenization * gear.arcmin_per_mm
    matrix, design = np.ascontiguousarray(matrix, dtype=np.float64), design_of(drive)
    lowered = np.full((len(matrix), 2), np.inf)
    # Held along the minor axis both zones' rims change almost together, which one turn for all tells less well.
    fold = drive.wave_generator.structure is not Structure.ONE_WAY_MINOR
    turns, beats = added.in_lanes(scale, gear.beat_phases, gear.flexspline_advance, fold)
    if not (turns or beats):
        return matrix_peak_to_peak_arcmin(drive, matrix, added, homogenization)

    def fill(rows: slice) -> None:
        if turns:
            from hdopt.simulation.turn.kernel import extremes_block

            for turn in turns:
                extremes_block(design, matrix[rows], turn, lowered[rows])
        else:
            from hdopt.simulation.beat.kernel import beat_block

            for beat in beats:
                beat_block(design, matrix[rows], beat, lowered[rows])

    in_blocks(len(matrix), LANES_BLOCK, fill)
    return np.asarray(-scale * lowered.sum(axis=1))


WIDER = 1.2
"""How much more of a spline a zone may pass than the wave generator turns: offsets as shipped change by 0.04 a rad."""


def _spline_tables(added: AddedTable, advance: float, cells: int) -> SplineTables:
    """The effects on the splines as the kernel takes them, for so many `cells` a turn."""
    from hdopt.simulation.cell_kernel import SplineTables

    fs, window = added.fs, advance * WIDER / cells
    least = fs.min(axis=1) if fs.size else np.zeros(2)
    largest = fs.max(axis=1) if fs.size else np.zeros(2)
    cs_sag = float(_sags(added.cs, window).max(initial=0.0))
    return SplineTables(
        added.cs,
        fs,
        round((advance - 1) * fs.shape[1]),
        least,
        largest,
        np.ascontiguousarray(_sags(fs, window)),
        cs_sag,
    )


def _sags(table: Array, window: float) -> Array:
    """How far `table` (2, places) goes beyond its chord over so much of a turn (`window`) that begins at a place or
    just beside it, mm of arc, (2, places)."""
    if not table.size:
        return table
    from hdopt.simulation.cell_kernel import sags

    length = math.ceil(window * table.shape[1]) + 1
    return np.asarray(sags(np.ascontiguousarray(table), length, math.ceil((1 - 1 / WIDER) * length) + 1))


CLOSEST = math.radians(8)
"""Local extremes that lie nearer than this in the input turn count as one, which the best turn stands for."""
RIVALS = 12
"""Turns of the grid that are followed for each of them."""
LOCAL_STEPS = 45
"""Golden-section steps that leave rounding only: slopes are differences of such values."""
NEAR = 1e-3
"""How far a local extreme may move, in rad, when a drive changes a little."""


@dataclass(frozen=True)
class LocalExtremes:
    """Where local extremes of one drive's kinematic error lie: input angles (rad) and directions by index, (k,) each;
    `sign` +1 for minima, -1 for maxima."""

    theta: Array
    way: Index
    sign: float

    def values(self, drive: Drive, row: Array, added: AddedTable) -> Array:
        """The extremes (arcmin) of a drive that differs a little from the one they were found for; shape (k,)."""
        lowest: Array = _near(drive, row, added, self, NEAR)[0]
        return self.sign * lowest


def local_extremes(drive: Drive, row: Array, added: AddedTable, most: int) -> tuple[LocalExtremes, LocalExtremes]:
    """The lowest minima and the highest maxima of one drive, each at another place of the input turn, `most` of each.

    `row` (12) holds its errors as in ERROR_NAMES, `added` the table of its effects.
    """
    from hdopt.simulation.walk_kernel import extended_walk

    values = extended_walk(gearing_of(drive), np.ascontiguousarray(row), added.walked)
    step = 2 * math.pi * drive.geometry.beat_phases / values.shape[1]
    found = []
    for sign in (1.0, -1.0):
        signed = sign * values
        local = (signed <= np.roll(signed, 1, axis=1)) & (signed <= np.roll(signed, -1, axis=1))
        ways, places = np.nonzero(local)
        order = np.argsort(signed[ways, places])
        ways, theta = ways[order], places[order] * step
        best: list[tuple[float, int]] = []
        while len(theta) and len(best) < most:
            turned = np.mod(theta - theta[0] + np.pi, 2 * np.pi) - np.pi
            alike = np.abs(turned) < CLOSEST
            rivals = LocalExtremes(theta[alike][:RIVALS], ways[alike][:RIVALS], sign)
            lowest, where = _near(drive, row, added, rivals, step)
            winner = int(np.argmin(lowest))
            best.append((where[winner], rivals.way[winner]))
            ways, theta = ways[~alike], theta[~alike]
        found.append(LocalExtremes(np.array([t for t, _ in best]), np.array([way for _, way in best]), sign))
    return found[0], found[1]


def _near(drive: Drive, row: Array, added: AddedTable, at: LocalExtremes, half: float) -> Array:
    from hdopt.simulation.walk_kernel import Places, extended_near

    places = Places(at.way, at.theta, half, at.sign, LOCAL_STEPS)
    return extended_near(gearing_of(drive), np.ascontiguousarray(row), added.every_place, places)
