"""Converged peak-to-peak of many drives in one call, for sweeps that need nothing else."""

from __future__ import annotations

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError
from hdopt.kinematics import peak_to_peak as kernel
from hdopt.study import AnyStudy, as_study
from hdopt.workflow.placed import numbers_named


@numbers_named
def peak_to_peak(drive: AnyStudy | Drive = None, errors: DriveErrors | None = None) -> Array:
    """Converged peak-to-peak kinematic error, arcmin, k_e = 1, by the closed form.

    `drive` is the record of one, or a study, its name or its path. The fields of `errors` are numbers or arrays (mm,
    rad) that broadcast against each other, and the result has their common shape; None takes the study's own, or no
    errors for a record. A sweep costs some microseconds a drive. Raises `HdoptError` for a study with effects, which
    this leaves out: `hdopt.kinematic_error` counts them.
    """
    if isinstance(drive, Drive):
        return kernel.peak_to_peak_arcmin(drive, DriveErrors() if errors is None else errors)
    study = as_study(drive)
    if study.effects:
        raise HdoptError(f"{study.name} has effects, which peak_to_peak leaves out; take hdopt.kinematic_error")
    return kernel.peak_to_peak_arcmin(study.drive, study.errors if errors is None else errors)
