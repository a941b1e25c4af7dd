"""Drives whose teeth are drawn at random, each with a table of its own: their peak-to-peak over the full beat."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive
from hdopt.drive.pitch_tolerances import PitchTolerances
from hdopt.errors import HdoptError
from hdopt.kinematics.load_sharing import LoadSharing, mesh_tables
from hdopt.kinematics.peak_to_peak import beat_extremes_arcmin
from hdopt.parallel.shared_memory import in_blocks
from hdopt.tolerance.distributions import Uniform
from hdopt.tolerance.space import Tolerance
from hdopt.tolerance.tooth_field import FAMILIES, ToothField, tooth_field

SPLINES = ("cs_teeth", "fs_teeth")
"""The inputs that stand for all teeth of a spline."""
DRIVES = 256
"""Drives whose tables a thread holds at a time: 4 MB a spline of 160 teeth."""
WHICH_SPLINE = Tolerance(Uniform(lower=0.0, upper=1.0), None)
"""A number that picks one of all splines; none is larger than another."""


@dataclass(frozen=True)
class GradedTeeth:
    """The teeth of a spline under `tolerances`, each kept by the `share` of splines; `family` of the spectrum as in
    `tooth_field.FAMILIES`; with `sine`, the spline's tooth sine stands beside them."""

    tolerances: PitchTolerances
    share: float = 0.9973
    family: str = "power_law"
    sine: bool = False

    def field(self, teeth: int) -> ToothField:
        """The random field of a spline of so many `teeth`."""
        return tooth_field(teeth, self.tolerances, self.share, self.family)

    def says(self, spline: str, teeth: int) -> list[str]:
        """What the numbers of `spline` ('cs_teeth' or 'fs_teeth') with so many `teeth` rest on, a sentence each."""
        given, found = self.tolerances, self.field(teeth)
        alone = 1000 * found.spread[0]
        said = [
            f"{spline}: single pitch {1000 * given.single:.3g} um and cumulative pitch {1000 * given.cumulative:.3g} "
            f"um ({given.source}), each kept by {self.share:.6g} of the splines; drawn as a random field, phases free, "
            f"of which one wave a turn has {alone:.2g} um rms (spectrum {self.family}, shape {found.shape:.3g}, "
            "assumed: two tolerances do not fix a spectrum)"
        ]
        if given.beyond:
            said.append(f"{spline}: extrapolated, the source serves only {'; '.join(given.beyond)}")
        return said

    def to_dict(self, teeth: int) -> dict[str, object]:
        """The figures of a spline with so many `teeth`, lengths in um."""
        found = self.field(teeth)
        return {
            "single_pitch_um": 1000 * self.tolerances.single,
            "cumulative_pitch_um": 1000 * self.tolerances.cumulative,
            "source": self.tolerances.source,
            "extrapolated": list(self.tolerances.beyond),
            "share": self.share,
            "spectrum": self.family,
            "shape": found.shape,
            "one_wave_rms_um": 1000 * found.spread[0],
        }


@dataclass(frozen=True)
class DrawnTeeth:
    """The `column` of a sample picks the teeth of `spline` ('cs_teeth' or 'fs_teeth') from `field`."""

    column: int
    spline: str
    field: ToothField


def check_graded(drive: Drive, graded: Mapping[str, GradedTeeth]) -> None:
    """Raise `HdoptError` where teeth of `drive` cannot be drawn as `graded` says, by spline."""
    measured = {"cs_teeth": drive.cs_teeth, "fs_teeth": drive.fs_teeth}
    for spline, given in graded.items():
        if given.family not in FAMILIES:
            raise HdoptError(f"{spline}: the spectrum is {given.family!r}; it must be one of {', '.join(FAMILIES)}")
        if measured[spline] is not None:
            raise HdoptError(
                f"{spline} are measured one by one in [{spline}] and toleranced in [tolerances]; leave either out"
            )


def drawn_peak_to_peak_arcmin(
    drive: Drive, matrix: Array, inputs: Array, teeth: Sequence[DrawnTeeth], misalignment: float, sine_share: float
) -> Array:
    """Peak-to-peak (arcmin) of drives with errors as rows of `matrix` (n, 12), each with teeth of its own, (n,).

    `inputs` (n, d) hold the numbers that pick the `teeth`; what is measured of `drive` stays beside them.
    `misalignment` and `sine_share` as in `beat_extremes_arcmin`.
    """
    return peak_to_peak_of_teeth_arcmin(
        drive, matrix, lambda rows: deviations_of(teeth, inputs[rows]), misalignment, sine_share
    )


def deviations_of(teeth: Sequence[DrawnTeeth], inputs: Array) -> dict[str, Array]:
    """Cumulative pitch deviations (mm, (n, Z)) of the `teeth` that `inputs` (n, d) pick, by spline."""
    return {one.spline: one.field.drawn(inputs[:, one.column]) for one in teeth}


def peak_to_peak_of_teeth_arcmin(
    drive: Drive,
    matrix: Array,
    deviations: Callable[[slice], Mapping[str, Array]],
    misalignment: float = 1.0,
    sine_share: float = 1.0,
) -> Array:
    """The same of drives whose teeth have the cumulative pitch `deviations` of a slice of rows, by spline, (k, Z), mm
    of arc. `drive`, `matrix`, `misalignment` and `sine_share` as in `drawn_peak_to_peak_arcmin`."""
    tables = tables_of_teeth(drive, deviations)
    out = np.empty(len(matrix))

    def fill(rows: slice) -> None:
        low, high = beat_extremes_arcmin(drive, matrix[rows], tables(rows), misalignment, sine_share).T
        out[rows] = high - low

    in_blocks(len(matrix), DRIVES, fill)
    return out


def tables_of_teeth(
    drive: Drive, deviations: Callable[[slice], Mapping[str, Array]]
) -> Callable[[slice], tuple[Array, Array]]:
    """What teeth in contact make of `deviations` (as in `peak_to_peak_of_teeth_arcmin`) and of the measured teeth of
    `drive`, for a slice of rows: tables of CS and FS over one turn, mm of arc, (k, 12 Z), or (1, 12 Z) where all drives
    have the same."""
    from hdopt.kinematics.teeth_kernel import whole_tables

    sharing = LoadSharing.of(drive)
    whole = whole_tables(drive, mesh_tables(drive))

    def tables(rows: slice) -> tuple[Array, Array]:
        found = dict(zip(SPLINES, whole, strict=True))
        for spline, values in deviations(rows).items():
            found[spline] = found[spline] + sharing.tables(values)
        return found[SPLINES[0]], found[SPLINES[1]]

    return tables
