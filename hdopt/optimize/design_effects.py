"""Effects in a design search: what of them stays and what follows the design."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive
from hdopt.kinematics.load_sharing import mesh_tables
from hdopt.simulation import EffectValues, Operation
from hdopt.simulation.batch import AddedTable, local_extremes, matrix_peak_to_peak_arcmin, tabulate
from hdopt.simulation.own_teeth import WHOLE, SharedByTeeth, same_teeth_peak_to_peak_arcmin, with_teeth


@dataclass(frozen=True)
class DesignEffects:
    """Effects found on one drive, carried over to designs of the same ratio.

    What is an arc in the meshing zones or an angle at the output stays as it is. A radial deviation of the circular
    spline stays a radius: its arc follows the tangent of the pressure angle. `fixed` is the table of the former,
    `radial` that of the latter for the pressure angle of tangent `tan_alpha`, None where there is none. Measured teeth
    of a design stand beside both.
    """

    effects: tuple[EffectValues, ...]
    operation: Operation
    tan_alpha: float
    fixed: AddedTable
    radial: AddedTable | None

    @classmethod
    def of(cls, drive: Drive, effects: tuple[EffectValues, ...], operation: Operation) -> DesignEffects:
        """The effects of a study's own drive."""
        whole = tabulate(drive, effects, operation)
        radial = None
        if any(effect.effect.radial for effect in effects):
            # On the places of the whole: the others at zero.
            silent = [
                e if e.effect.radial else replace(e, coefficients=tuple(0.0 * c for c in e.coefficients))
                for e in effects
            ]
            radial = tabulate(drive, silent, operation)
        fixed = whole if radial is None else _sum(whole, radial, -1.0)
        return cls(effects, operation, math.tan(drive.geometry.pressure_angle), fixed, radial)

    def at(self, drive: Drive) -> tuple[EffectValues, ...]:
        """The effects of a design."""
        factor = self._factor(drive)
        return tuple(
            replace(e, coefficients=tuple(factor * c for c in e.coefficients)) if e.effect.radial else e
            for e in self.effects
        )

    def table(self, drive: Drive) -> AddedTable:
        """Their table."""
        if self.radial is None:
            return self.fixed
        return _sum(self.fixed, self.radial, self._factor(drive))

    def peak_to_peak_arcmin(self, drive: Drive, row: Array, shared: SharedByTeeth = WHOLE) -> float:
        """Converged peak-to-peak of a design with errors `row` (12) and the effects, arcmin; `shared` is what its teeth
        in contact leave of each term."""
        return float(self.peaks_to_peaks_arcmin(drive, row[None, :], shared)[0])

    def peaks_to_peaks_arcmin(self, drive: Drive, rows: Array, shared: SharedByTeeth = WHOLE) -> Array:
        """The same of drives with errors as `rows` (n, 12), the same effects and the same measured teeth in each,
        (n,)."""
        if drive.has_measured_teeth:
            return same_teeth_peak_to_peak_arcmin(drive, rows, self.table(drive), mesh_tables(drive), shared)
        return matrix_peak_to_peak_arcmin(drive, rows, self.table(drive), shared.homogenization)

    def spans_near(self, drive: Drive, row: Array, most: int) -> Callable[[Drive, Array], Array]:
        """A function of designs near `drive` and of their errors near `row` (12): every one of its highest maxima less
        every one of its `most` lowest minima, as they move with the design, arcmin, shape (k,)."""
        lows, highs = local_extremes(drive, row, self._met(drive), most)

        def spans(design: Drive, own: Array) -> Array:
            table = self._met(design)
            return (highs.values(design, own, table)[:, None] - lows.values(design, own, table)[None, :]).ravel()

        return spans

    def _met(self, drive: Drive) -> AddedTable:
        """The table with the measured teeth of a design."""
        return with_teeth(self.table(drive), drive, *mesh_tables(drive))

    def _factor(self, drive: Drive) -> float:
        return math.tan(drive.geometry.pressure_angle) / self.tan_alpha


def _sum(table: AddedTable, other: AddedTable, factor: float) -> AddedTable:
    """`table` with so many times (`factor`) what the `other` adds in the zones."""
    return replace(
        table,
        zones=table.zones + factor * other.zones,
        cs=table.cs + factor * other.cs,
        fs=table.fs + factor * other.fs,
    )
