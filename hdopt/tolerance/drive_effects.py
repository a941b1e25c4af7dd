"""What a stack samples where a study has effects: each drive's peak-to-peak together with them."""

from __future__ import annotations

from dataclasses import dataclass

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.simulation.batch import AddedTable, matrix_peak_to_peak_arcmin
from hdopt.tolerance.drive_inputs import DriveResponse


@dataclass(frozen=True)
class ExtendedResponse:
    """Peak-to-peak (arcmin) of the drive that each row of inputs describes, with the effects of `added`, which are the
    same in every drive."""

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

    def __call__(self, inputs: Array) -> Array:
        base = self.base
        return matrix_peak_to_peak_arcmin(base.drive, base.matrix(inputs), self.added, base.homogenization)
