"""What a stack samples where a study has effects: each drive's peak-to-peak together with them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import ERROR_NAMES, DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.kinematics.essential import on_table
from hdopt.parallel.shared_memory import in_blocks
from hdopt.simulation.batch import AddedTable, matrix_peak_to_peak_arcmin, stacked_peak_to_peak_arcmin
from hdopt.tolerance.drawn_teeth import SPLINES, tables_of_teeth
from hdopt.tolerance.drive_inputs import DriveResponse

SINES = [ERROR_NAMES.index(name) for name in ("cs_tooth_amplitude", "fs_tooth_amplitude")]
"""Their columns in `DriveErrors.to_matrix`."""
DRIVES = 32
"""Drives with teeth of their own that a thread takes at a time."""


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
        base = self.base
        if not self.has_own_teeth:
            return stacked_peak_to_peak_arcmin(base.drive, base.matrix(inputs), self.added, base.homogenization)
        matrix, evened = base.matrix(inputs), _evened_out(self.added, base.homogenization)
        misalignment, sine_share = base.shares
        matrix[:, SINES] *= sine_share
        shared = _with_share(base.drive, misalignment)
        tables = tables_of_teeth(base.drive, lambda rows: base.deviations(inputs[rows]))
        out = np.empty(len(matrix))

        def fill(rows: slice) -> None:
            cs, fs = tables(rows)
            for i in range(rows.start, rows.stop):
                own = [table[min(i - rows.start, len(table) - 1)] for table in (cs, fs)]
                row = matrix[i : i + 1]
                out[i] = matrix_peak_to_peak_arcmin(shared, row, with_teeth(evened, base.drive, own[0], own[1]))[0]

        in_blocks(len(matrix), DRIVES, fill)
        return out


def _evened_out(added: AddedTable, k_e: float) -> AddedTable:
    """What the teeth in contact leave of the effects `added`."""
    return replace(added, zones=k_e * added.zones, cs=k_e * added.cs, fs=k_e * added.fs)


def _with_share(drive: Drive, misalignment: float) -> Drive:
    """`drive` whose misalignment makes the share `misalignment` of its arc: the pressure angle does that alone."""
    angle = math.atan(misalignment * math.tan(drive.geometry.pressure_angle))
    return replace(drive, geometry=replace(drive.geometry, pressure_angle=angle))


def with_teeth(added: AddedTable, drive: Drive, cs: Array, fs: Array) -> AddedTable:
    """`added` for the ratio of `drive` with teeth whose mean in mesh is `cs` and `fs` over one turn of the spline, mm
    of arc, (12 Z,) each: both zones meet them where they stand."""
    turns = drive.geometry.beat_phases
    found = {}
    for name, beside, table in zip(SPLINES, (added.cs, added.fs), (cs, fs), strict=True):
        places = beside.shape[1] or math.ceil(len(table) / turns) * turns
        angle = np.arange(places, dtype=np.float64) * (2 * math.pi / places)
        met = np.stack([on_table(table, angle), on_table(table, angle + math.pi)])
        found[name] = beside + met if beside.size else met
    return replace(added, cs=found[SPLINES[0]], fs=found[SPLINES[1]])
