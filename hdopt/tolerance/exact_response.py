"""What a small stack samples where the closed form is too far off: each drive by the exact geometry."""

from __future__ import annotations

from dataclasses import dataclass

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.extremes import peak_to_peak_by_search_arcmin
from hdopt.tolerance.drive_inputs import DriveResponse

MOST_DRIVES = 4096
"""Drives that are computed by the exact geometry at most: one takes some hundredths of a second."""


@dataclass(frozen=True)
class ExactResponse:
    """Peak-to-peak (arcmin, times k_e) of the drive that each row of inputs describes, by the exact geometry of Jia
    2021, Eqs. (16)-(23), drive by drive; `base` says which drives those are."""

    base: DriveResponse

    def errors(self, inputs: Array) -> DriveErrors:
        """The errors of all rows at once."""
        return self.base.errors(inputs)

    def upper_bound(self, lower: Array, upper: Array) -> float | None:
        """A proven bound over the box, None where there is no proof: that of the base, which is of this geometry."""
        return self.base.upper_bound(lower, upper)

    def __call__(self, inputs: Array) -> Array:
        errors = DriveErrors.from_matrix(self.base.matrix(inputs))
        return self.base.homogenization * peak_to_peak_by_search_arcmin(self.base.drive, errors, "exact")
