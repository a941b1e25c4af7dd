"""Lag: what the output loses when the input reverses (Jia 2021, Eqs. (33)-(35))."""

from __future__ import annotations

from dataclasses import dataclass

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

    def to_dict(self) -> dict:
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
    """Output lag from the clearance e_b in the slots of the cross-slide, arcmin, at `theta` (rad).

    Jia 2021, Eq. (33): e_b/(N r_i) for each slot i, with
    r_1 = sqrt((sqrt(R_w^2 - b1^2/4) + |e3 cos(beta - theta)|)^2 + b1^2/4), r_2 with b2 and the sine. The offset e3
    between input axis and wave generator is the vector sum of both eccentricities. A one-way structure has the lag
    of its one slot (r_1 for the major type, r_2 for the minor: assumed, the paper does not say); an integral one none.
    """
    theta = np.asarray(theta, float)
    slots = drive.wave_generator.structure.slots
    lag = np.zeros_like(theta)
    if not slots:
        return lag
    clear = drive.clearances
    names = {
        "cross_slide": "clearances.cross_slide_clearance_mm",
        "disc_radius": "clearances.disc_radius_mm",
        **{f"slot_{slot}_width": f"clearances.slot_{slot}_width_mm" for slot in slots},
    }
    missing = [key for name, key in names.items() if getattr(clear, name) is None]
    if missing:
        raise MissingValue(f"the lag of the {drive.wave_generator.structure.value} structure", *missing)
    turned = errors.axis_eccentricity_direction - theta
    along = {
        1: errors.axis_eccentricity * np.cos(turned)
        + errors.wg_eccentricity * np.cos(errors.wg_eccentricity_direction),
        2: errors.axis_eccentricity * np.sin(turned)
        + errors.wg_eccentricity * np.sin(errors.wg_eccentricity_direction),
    }
    for slot in slots:
        half_width = getattr(clear, f"slot_{slot}_width") / 2
        reach = np.sqrt(clear.disc_radius**2 - half_width**2) + np.abs(along[slot])
        lag = lag + clear.cross_slide / (drive.geometry.ratio * np.hypot(reach, half_width))
    return lag / ARCMIN


def backlash_lag_arcmin(drive: Drive, kinematic_error: ArrayLike) -> Array:
    """Output lag from the backlash e_t less the driving zone's deviation tau, arcmin (Jia 2021, Eqs. (34), (35)).

    2 pi (e_t - tau)/l_FS, where 2 pi tau/l_FS is the `kinematic_error` of a single tooth pair (arcmin, k_e = 1).
    Negative where tau exceeds e_t: interference, not clipped.
    """
    if drive.clearances.backlash is None:
        raise MissingValue("the lag", "clearances.backlash_mm")
    return drive.geometry.arcmin_per_mm * drive.clearances.backlash - np.asarray(kinematic_error)


def lag(drive: Drive, errors: DriveErrors, theta: ArrayLike, kinematic_error: ArrayLike) -> Lag:
    """Lag of one drive at reversal over input angles `theta`, rad, shape (n,), where its `kinematic_error` (arcmin,
    k_e = 1, same shape) is known: the sum of the cross-slide's part and the tooth backlash's."""
    return Lag(cross_slide_lag_arcmin(drive, errors, theta), backlash_lag_arcmin(drive, kinematic_error))
