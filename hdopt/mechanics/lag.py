"""Lag: what the output loses when the input reverses (Jia 2021, Eqs. (33)-(35))."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any  # Any: values of JSON

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import ARCMIN, Drive
from hdopt.errors import MissingValue


@dataclass(frozen=True)
class Lag:
    """Lag over the input angle, arcmin, shape (n,): the cross-slide's part, the tooth backlash's, and their sum.

    Where the teeth's own deviation exceeds the backlash, `backlash_arcmin` is negative: the flanks interfere. It is
    left so, and `interference` is the share of the angles where it happens.
    """

    cross_slide_arcmin: Array
    backlash_arcmin: Array

    @property
    def total_arcmin(self) -> Array:
        return self.cross_slide_arcmin + self.backlash_arcmin

    @property
    def interference(self) -> float:
        return float(np.mean(self.backlash_arcmin < 0))

    def to_dict(self) -> dict[str, Any]:
        """Mean, least and greatest lag, arcmin, and the same of each part."""
        parts = {"cross_slide": self.cross_slide_arcmin, "backlash": self.backlash_arcmin}
        return {
            **_range(self.total_arcmin),
            "parts": {name: _range(values) for name, values in parts.items()},
            "interference_share": self.interference,
        }


def _range(values: Array) -> dict[str, float]:
    return {"mean": float(np.mean(values)), "min": float(np.min(values)), "max": float(np.max(values))}


def cross_slide_lag_arcmin(drive: Drive, errors: DriveErrors, theta: ArrayLike) -> Array:
    """Output lag from the clearance e_b in the slots of the cross-slide, arcmin, at input angles `theta` (rad).

    Jia 2021, Eq. (33): e_b/(N r_i) for each slot i, with
    r_1 = sqrt((sqrt(R_w^2 - b1^2/4) + |e3 cos(beta - theta)|)^2 + b1^2/4), r_2 with b2 and the sine. The offset e3
    between input axis and wave generator is the vector sum of both eccentricities of `errors` (one drive's). e_b, b1,
    b2 and R_w are the `drive`'s clearances; `MissingValue` where its structure needs one that is not given. A one-way
    structure has the lag of its one slot (r_1 for the major type, r_2 for the minor: assumed, the paper does not say);
    an integral one none.
    """
    theta = np.asarray(theta, float)
    lag = np.zeros_like(theta)
    slots = _cross_slide(drive)
    if slots is None:
        return lag
    turned = errors.axis_eccentricity_direction - theta
    along = {
        1: errors.axis_eccentricity * np.cos(turned)
        + errors.wg_eccentricity * np.cos(errors.wg_eccentricity_direction),
        2: errors.axis_eccentricity * np.sin(turned)
        + errors.wg_eccentricity * np.sin(errors.wg_eccentricity_direction),
    }
    for slot, width in slots.widths.items():
        half_width = width / 2
        reach = np.sqrt(slots.disc_radius**2 - half_width**2) + np.abs(along[slot])
        lag = lag + slots.clearance / (drive.geometry.ratio * np.hypot(reach, half_width))
    return lag / ARCMIN


@dataclass(frozen=True)
class _CrossSlide:
    """The slots that have play, all given: clearance e_b, disc radius R_w and width of each slot by its number, mm."""

    clearance: float
    disc_radius: float
    widths: dict[int, float]


def _cross_slide(drive: Drive) -> _CrossSlide | None:
    """The cross-slide of the drive's structure; None where that has no slots with play."""
    structure, clear = drive.wave_generator.structure, drive.clearances
    if not structure.slots:
        return None
    widths = {1: clear.slot_1_width, 2: clear.slot_2_width}
    given = {
        "clearances.cross_slide_clearance_mm": clear.cross_slide,
        "clearances.disc_radius_mm": clear.disc_radius,
        **{f"clearances.slot_{slot}_width_mm": widths[slot] for slot in structure.slots},
    }
    values = [value for value in given.values() if value is not None]
    if len(values) < len(given):
        missing = (key for key, value in given.items() if value is None)
        raise MissingValue(f"the lag of the {structure.value} structure", *missing)
    clearance, disc_radius, *slot_widths = values
    return _CrossSlide(clearance, disc_radius, dict(zip(structure.slots, slot_widths, strict=True)))


def backlash_lag_arcmin(drive: Drive, kinematic_error: ArrayLike) -> Array:
    """Output lag from the backlash e_t less the driving zone's deviation tau, arcmin (Jia 2021, Eqs. (34), (35)).

    2 pi (e_t - tau)/l_FS, where 2 pi tau/l_FS is the `kinematic_error` of a single tooth pair (arcmin, k_e = 1); e_t
    and l_FS are the `drive`'s. Negative where tau exceeds e_t: interference, not clipped. Raises `MissingValue` where
    the drive has no backlash.
    """
    if drive.clearances.backlash is None:
        raise MissingValue("the lag", "clearances.backlash_mm")
    return drive.geometry.arcmin_per_mm * drive.clearances.backlash - np.asarray(kinematic_error)


def lag(drive: Drive, errors: DriveErrors, theta: ArrayLike, kinematic_error: ArrayLike) -> Lag:
    """Lag of one `drive` with its `errors` at reversal over input angles `theta`, rad, shape (n,).

    Its `kinematic_error` there (arcmin, k_e = 1, same shape) is known. The lag is the sum of the cross-slide's part and
    the tooth backlash's; both raise `MissingValue` for a clearance that they need.
    """
    return Lag(cross_slide_lag_arcmin(drive, errors, theta), backlash_lag_arcmin(drive, kinematic_error))
