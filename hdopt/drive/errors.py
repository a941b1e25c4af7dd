"""The errors of one drive, or of many drives at once.

Symbols and directions are those of Jia 2021, Sec. 2: directions are measured clockwise from +y, the axis of the
circular spline along which the wave generator's major axis lies at input angle 0; the wave generator turns clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.errors import HdoptError, unknown_name
from hdopt.keywords import names_keywords

Values = float | Array
"""One value, or an array of them."""


@names_keywords
@dataclass(frozen=True)
class DriveErrors:
    """Machining and assembly errors, each a number or an array; all arrays broadcast against each other.

    Lengths in mm, angles in rad. In brackets the paper's symbol.
    """

    axis_eccentricity: Values = 0.0
    """[e1] Offset of the input axis from the CS axis; fixed to ground."""
    axis_eccentricity_direction: Values = 0.0
    """[beta1] Its direction."""
    axis_tilt_y: Values = 0.0
    """[beta2] Tilt of the input axis that lifts the rim along y."""
    axis_tilt_x: Values = 0.0
    """[beta3] Tilt of the input axis that lifts the rim along x."""
    wg_eccentricity: Values = 0.0
    """[e2] Offset of the wave generator's centre from the input axis; turns with the wave generator."""
    wg_eccentricity_direction: Values = 0.0
    """[alpha1] Its direction, from the major axis."""
    wg_tilt_major: Values = 0.0
    """[alpha2] Tilt of the wave generator along its major axis."""
    wg_tilt_minor: Values = 0.0
    """[alpha3] Tilt of the wave generator along its minor axis."""
    cs_tooth_amplitude: Values = 0.0
    """[a_CS] Amplitude of the long-wave tangential composite deviation of the CS teeth, mm of arc."""
    cs_tooth_phase: Values = 0.0
    """[phi_CS] Its phase."""
    fs_tooth_amplitude: Values = 0.0
    """[a_FS] The same of the FS teeth."""
    fs_tooth_phase: Values = 0.0
    """[phi_FS] Its phase."""

    def __post_init__(self) -> None:
        for name, value in self.by_name().items():
            if not np.all(np.isfinite(value)):
                raise ValueError(f"{name} holds a value that is not finite; give finite numbers only")
            if name in AMPLITUDE_NAMES and np.any(np.asarray(value) < 0):
                raise ValueError(
                    f"{name} holds a negative value; give its magnitude, 0 or above, and turn its direction by 180 deg"
                )

    def by_name(self) -> dict[str, Values]:
        """Error name -> its value, in the order of `ERROR_NAMES`."""
        return {name: vars(self)[name] for name in ERROR_NAMES}

    @property
    def shape(self) -> tuple[int, ...]:
        """The common shape of all fields; () for one drive."""
        return np.broadcast_shapes(*(np.shape(value) for value in self.by_name().values()))

    def to_matrix(self) -> Array:
        """One row a drive, one column an error in the order of `ERROR_NAMES`: shape (n, 12)."""
        columns = np.broadcast_arrays(*(np.asarray(value, float) for value in self.by_name().values()))
        return np.stack([column.ravel() for column in columns], axis=1)

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> DriveErrors:
        """The inverse of `to_matrix`: `matrix` of shape (..., 12), each field of shape (...)."""
        matrix = np.asarray(matrix, float)
        if matrix.shape[-1:] != (len(ERROR_NAMES),):
            raise ValueError(f"the matrix has shape {matrix.shape}; its last axis must hold {len(ERROR_NAMES)} errors")
        return cls(*np.moveaxis(matrix, -1, 0))

    def with_(self, **changes: Values) -> DriveErrors:
        """A copy with the named errors replaced, in mm and rad. Raises `HdoptError` for a name that is none."""
        for name in changes:
            if name not in ERROR_NAMES:
                raise HdoptError(unknown_name("error", name, ERROR_NAMES))
        return replace(self, **changes)


ERROR_NAMES: tuple[str, ...] = tuple(f.name for f in fields(DriveErrors))
"""The errors in the order of the columns of `DriveErrors.to_matrix`."""

AMPLITUDE_NAMES = ("axis_eccentricity", "wg_eccentricity", "cs_tooth_amplitude", "fs_tooth_amplitude")
"""Errors that are magnitudes: never negative."""

PHASE_OF = {
    "axis_eccentricity": "axis_eccentricity_direction",
    "wg_eccentricity": "wg_eccentricity_direction",
    "cs_tooth_amplitude": "cs_tooth_phase",
    "fs_tooth_amplitude": "fs_tooth_phase",
}
"""The direction or phase that belongs to each magnitude."""

ERROR_GROUPS = {
    "E1": ("axis_eccentricity", "axis_eccentricity_direction", "axis_tilt_y", "axis_tilt_x"),
    "E2": ("wg_eccentricity", "wg_eccentricity_direction", "wg_tilt_major", "wg_tilt_minor"),
    "CS teeth": ("cs_tooth_amplitude", "cs_tooth_phase"),
    "FS teeth": ("fs_tooth_amplitude", "fs_tooth_phase"),
}
"""Errors by where they come from: input axis, wave generator, teeth of either spline."""


def study_key(name: str) -> str:
    """The study-file key of an error: its name with the unit it is written in (`_mm` or `_deg`)."""
    return f"{name}_mm" if name in AMPLITUDE_NAMES else f"{name}_deg"


STUDY_KEYS: dict[str, str] = {study_key(name): name for name in ERROR_NAMES}
"""Study-file key -> error name."""
