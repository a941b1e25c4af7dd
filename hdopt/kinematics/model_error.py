"""How far the compiled closed form is from the exact geometry: a pilot of drives that a study is about."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin

PILOT = 16
"""Drives that are compared; half of them are those of the largest peak-to-peak, where limits are met."""
WORTH_A_WORD_ARCMIN = 2e-3
"""What the compiled closed form is right to for the shipped tolerances, twice over."""


@dataclass(frozen=True)
class ModelError:
    """Difference of the compiled closed form from the exact geometry, arcmin (k_e = 1), over `drives` drives: its
    largest size, its root mean square, and its mean with the sign (above 0: the closed form gives too much)."""

    largest_arcmin: float
    rms_arcmin: float
    mean_arcmin: float
    drives: int

    @property
    def says(self) -> str | None:
        """A sentence where the difference is worth one."""
        if self.largest_arcmin <= WORTH_A_WORD_ARCMIN:
            return None
        return (
            f"the closed form that many drives are computed with differs by up to {self.largest_arcmin:.2g} arcmin "
            f"(rms {self.rms_arcmin:.2g}) from the exact geometry over {self.drives} drives of these tolerances: such "
            "large errors leave its range"
        )

    def to_dict(self) -> dict[str, float]:
        """The fields by name."""
        return asdict(self)


def model_error(drive: Drive, matrix: Array, pilot: int = PILOT) -> ModelError:
    """Compare both methods on `pilot` of the drives with errors as rows of `matrix` (n, 12), as in
    `DriveErrors.to_matrix`: the largest ones, and the first of the others. `drive` needs a smooth-tipped profile."""
    values = matrix_peak_to_peak_arcmin(drive, matrix)
    order = np.argsort(-values)
    largest, others = order[: pilot // 2], np.sort(order[pilot // 2 :])[: pilot - pilot // 2]
    chosen = np.concatenate([largest, others])
    exact = np.array([converged_peak_to_peak_arcmin(drive, DriveErrors.from_matrix(matrix[i])) for i in chosen])
    off = values[chosen] - exact
    return ModelError(float(np.abs(off).max()), float(np.sqrt(np.mean(off**2))), float(off.mean()), drives=len(chosen))
