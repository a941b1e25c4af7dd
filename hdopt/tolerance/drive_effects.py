"""What a stack samples where a study has effects: each drive's peak-to-peak together with them."""

from __future__ import annotations

from dataclasses import dataclass

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.load_sharing import mesh_tables
from hdopt.simulation.batch import AddedTable, stacked_peak_to_peak_arcmin
from hdopt.simulation.own_teeth import SharedByTeeth, own_teeth_peak_to_peak_arcmin, same_teeth_peak_to_peak_arcmin
from hdopt.tolerance.drawn_teeth import tables_of_teeth
from hdopt.tolerance.drive_inputs import DriveResponse


@dataclass(frozen=True)
class ExtendedResponse:
    """Peak-to-peak (arcmin) of the drive that each row of inputs describes, with the effects of `added`, which are the
    same in every drive.

    Teeth that are known one by one, measured or drawn, are an effect on their spline, drive by drive: `added` is that
    of the drive without them.
    """

    base: DriveResponse
    added: AddedTable

    def errors(self, inputs: Array) -> DriveErrors:
        """The errors of all rows at once."""
        return self.base.errors(inputs)

    def upper_bound(self, lower: Array, upper: Array) -> float | None:
        """A proven bound over the box, None where there is no proof: that of the base, and the range of the effects.

        sup max(tau_i + x_i) <= sup max(tau_i) + sup x_i, and the infimum in the same way.
        """
        bound = self.base.upper_bound(lower, upper)
        if bound is None:
            return None
        scale = self.base.homogenization * self.base.drive.geometry.arcmin_per_mm
        return bound + scale * self.added.widest_mm + self.added.widest_arcmin

    @property
    def has_own_teeth(self) -> bool:
        """Whether teeth are known one by one, which makes a drive some hundred times dearer."""
        return bool(self.base.teeth) or self.base.drive.has_measured_teeth

    def __call__(self, inputs: Array) -> Array:
        base, matrix = self.base, self.base.matrix(inputs)
        if not self.has_own_teeth:
            return stacked_peak_to_peak_arcmin(base.drive, matrix, self.added, base.homogenization)
        shared = SharedByTeeth(base.homogenization, *base.shares)
        if not base.teeth:
            return same_teeth_peak_to_peak_arcmin(base.drive, matrix, self.added, mesh_tables(base.drive), shared)
        tables = tables_of_teeth(base.drive, lambda rows: base.deviations(inputs[rows]))
        return own_teeth_peak_to_peak_arcmin(base.drive, matrix, self.added, tables, shared)
