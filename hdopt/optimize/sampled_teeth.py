"""The teeth of the drives that make a search's quantile: drawn once, the same in every design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.drive.geometry import Drive
from hdopt.tolerance.drawn_teeth import DrawnTeeth, deviations_of, peak_to_peak_of_teeth_arcmin, tables_of_teeth

if TYPE_CHECKING:
    from hdopt.simulation.batch import AddedTable


@dataclass(frozen=True)
class SampledTeeth:
    """Cumulative pitch `deviations` (n, Z) of n drives by spline ('cs_teeth', 'fs_teeth'), mm of arc.

    Every design meets the same teeth (common random numbers), so that a quantile over them moves as smoothly as each
    drive's own peak-to-peak does. What evens them out is the design's own contact angle.
    """

    deviations: Mapping[str, Array]

    @classmethod
    def of(cls, teeth: Sequence[DrawnTeeth], inputs: Array) -> SampledTeeth:
        """Those of the `teeth` that a sample of `inputs` (n, d) picks."""
        return cls(deviations_of(teeth, inputs))

    def peak_to_peak_arcmin(
        self, drive: Drive, rows: Array, chosen: Index | None = None, added: AddedTable | None = None
    ) -> Array:
        """Converged peak-to-peak (arcmin, k_e = 1) of drives that are built as `drive` with errors as `rows` (n, 12) of
        `DriveErrors.to_matrix`, each with its own teeth; (n,). `rows` are those of all drives, or of the `chosen`;
        with the effects of `added`, if any."""
        own = {
            spline: np.ascontiguousarray(values if chosen is None else values[chosen])
            for spline, values in self.deviations.items()
        }

        def deviations(block: slice) -> Mapping[str, Array]:
            return {spline: values[block] for spline, values in own.items()}

        if added is None:
            return peak_to_peak_of_teeth_arcmin(drive, rows, deviations)
        from hdopt.simulation.own_teeth import own_teeth_peak_to_peak_arcmin

        return own_teeth_peak_to_peak_arcmin(drive, rows, added, tables_of_teeth(drive, deviations))
