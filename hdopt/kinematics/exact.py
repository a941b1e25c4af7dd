"""The exact geometry of Jia 2021, Eqs. (16)-(23): where the wave generator reaches deepest. The reference, to be read.

The wave generator's two rim curves are carried through its own tilt and offset, then through those of the input axis,
and projected on the plane of the circular spline. In each meshing zone the projected point that lies farthest out, over
both rims, is the deepest point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors, Values
from hdopt.drive.geometry import Drive
from hdopt.kinematics import closed_form
from hdopt.kinematics.branches import Branches, DeepestPoints, deepest

ZONE_HALF_WIDTH = np.pi / 3
"""How far from either end of the major axis the deepest point is sought, rad."""
GRID_POINTS = 121
"""Contour points of that search where the profile's tip is not smooth."""
NEWTON_STEPS = 6
LONGEST_STEP = ZONE_HALF_WIDTH / (GRID_POINTS - 1) * 2
"""Newton steps are cut to the spacing of that grid, rad."""


def tilt_frame(tilt_y: Values, tilt_x: Values) -> Array:
    """Columns x, y, z of a frame tilted by (t2, t3) = (`tilt_y`, `tilt_x`), rad: shape (..., 3, 3).

    Jia 2021, Eq. (16).
    """
    tilt_y, tilt_x = np.broadcast_arrays(np.asarray(tilt_y, float), np.asarray(tilt_x, float))
    z = np.stack([np.tan(tilt_x), np.tan(tilt_y), np.ones_like(tilt_y)], -1)
    z = z / np.linalg.norm(z, axis=-1, keepdims=True)
    y = np.stack([np.zeros_like(tilt_y), np.cos(tilt_y), -np.sin(tilt_y)], -1)
    return np.stack([np.cross(y, z), y, z], axis=-1)


def turned_clockwise(theta: Array) -> Array:
    """Matrices that turn a vector clockwise by theta about z; shape (..., 3, 3)."""
    cos, sin, zero = np.cos(theta), np.sin(theta), np.zeros_like(theta)
    rows = [(cos, sin, zero), (-sin, cos, zero), (zero, zero, zero + 1)]
    return np.stack([np.stack(row, -1) for row in rows], axis=-2)


class _Rims:
    """Both rims of the wave generator as they appear on the plane of the circular spline, for every input angle."""

    def __init__(self, drive: Drive, errors: DriveErrors, theta: Array) -> None:
        self.profile, self.half_width = drive.wave_generator.profile, drive.wave_generator.width / 2
        structure = drive.wave_generator.structure
        e = DriveErrors(**{name: np.asarray(value, float)[..., None] for name, value in errors.by_name().items()})
        axis = tilt_frame(e.axis_tilt_y, e.axis_tilt_x)
        matrix = axis @ (turned_clockwise(theta) @ tilt_frame(e.wg_tilt_major, e.wg_tilt_minor))
        self.row_x, self.row_y = (tuple(matrix[..., i, j] for j in range(3)) for i in range(2))
        self.sin, self.cos = np.sin(theta), np.cos(theta)
        direction, beta = e.wg_eccentricity_direction + theta, e.axis_eccentricity_direction
        x, y = e.wg_eccentricity * np.sin(direction), e.wg_eccentricity * np.cos(direction)
        centre_x = axis[..., 0, 0] * x + axis[..., 0, 1] * y + e.axis_eccentricity * np.sin(beta)
        centre_y = axis[..., 1, 0] * x + axis[..., 1, 1] * y + e.axis_eccentricity * np.cos(beta)
        # The structure removes what it aligns: the total eccentricity along the major axis, the minor one, or both.
        major = structure.passes_major * (centre_x * self.sin + centre_y * self.cos)
        minor = structure.passes_minor * (centre_x * self.cos - centre_y * self.sin)
        self.centre_x, self.centre_y = major * self.sin + minor * self.cos, major * self.cos - minor * self.sin

    def projected(self, phi: Array, edge: float, derivative: int) -> tuple[Array, Array]:
        """x and y (mm) of the contour point at `phi` (rad) on the edge z = `edge` b/2, or of a derivative by phi."""
        r = [self.profile.radius(phi, order) for order in range(derivative + 1)]
        sin, cos = np.sin(phi), np.cos(phi)
        if derivative == 0:
            px, py = r[0] * sin, r[0] * cos
        elif derivative == 1:
            px, py = r[1] * sin + r[0] * cos, r[1] * cos - r[0] * sin
        else:
            bent = r[2] - r[0]
            px, py = bent * sin + 2 * r[1] * cos, bent * cos - 2 * r[1] * sin
        x = self.row_x[0] * px + self.row_x[1] * py
        y = self.row_y[0] * px + self.row_y[1] * py
        if derivative == 0:
            height = edge * self.half_width
            return x + self.row_x[2] * height + self.centre_x, y + self.row_y[2] * height + self.centre_y
        return x, y

    def searched(self, start: float, edge: float) -> Array:
        """The contour angle that lies farthest out on a grid around `start`, rad."""
        best, farthest = np.full(np.shape(self.centre_x), start), np.full(np.shape(self.centre_x), -np.inf)
        for phi in start + np.linspace(-ZONE_HALF_WIDTH, ZONE_HALF_WIDTH, GRID_POINTS):
            x, y = self.projected(np.asarray(phi), edge, 0)
            square = x * x + y * y
            best, farthest = np.where(square > farthest, phi, best), np.maximum(square, farthest)
        return best

    def polished(self, phi: Array, edge: float) -> Array:
        """The contour angle near `phi` where the distance from the CS centre is largest, by Newton steps, rad."""
        for _ in range(NEWTON_STEPS):
            x, y = self.projected(phi, edge, 0)
            x1, y1 = self.projected(phi, edge, 1)
            x2, y2 = self.projected(phi, edge, 2)
            slope = x * x1 + y * y1
            bend = x1 * x1 + y1 * y1 + x * x2 + y * y2
            # Away from a maximum (bend >= 0) a Newton step would leave it: stay there then.
            step = np.where(bend < 0, slope / np.where(bend < 0, bend, -1.0), 0.0)
            phi = phi - np.clip(step, -LONGEST_STEP, LONGEST_STEP)
            if np.abs(step).max(initial=0.0) < 1e-13:
                break
        return phi


def branches(drive: Drive, errors: DriveErrors, theta: ArrayLike) -> Branches:
    """Every rim's outermost point in both zones of `drive` at input angles `theta`, rad, shape (n,): results
    (2, 2, ..., n), where `errors` have the shape (...).

    Jia 2021, Eqs. (16)-(23). Valid for any profile with a second derivative, and for errors that keep the deepest point
    within 60 deg of its end of the major axis. Newton steps start from the closed form's place where the tips are
    smooth, else from a search along the contour.
    """
    theta = np.asarray(theta, float).ravel()
    rims = _Rims(drive, errors, theta)
    profile = drive.wave_generator.profile
    near = None
    if profile.tip_is_smooth:
        wide = DriveErrors(**{name: np.asarray(value, float)[..., None] for name, value in errors.by_name().items()})
        near = np.clip(closed_form.branches(drive, wide, theta).offset_fs, -ZONE_HALF_WIDTH, ZONE_HALF_WIDTH)
    found: list[list[list[Array]]] = []
    for zone, (start, side) in enumerate(((0.0, 1.0), (np.pi, -1.0))):
        zone_found = []
        for rim, rim_sign in enumerate((1.0, -1.0)):
            # Rims are counted along the zone's own direction, as in the closed form: s k names one edge of the cam.
            edge = side * rim_sign
            phi = rims.searched(start, edge) if near is None else start + side * near[zone, rim]
            phi = rims.polished(phi, edge)
            x, y = rims.projected(phi, edge, 0)
            along, across = x * rims.sin + y * rims.cos, x * rims.cos - y * rims.sin
            zone_found.append(
                [np.hypot(x, y) - profile.semi_major, np.arctan2(across, side * along), side * (phi - start)]
            )
        found.append(zone_found)
    return Branches(*(np.stack([np.stack([rim[i] for rim in zone]) for zone in found]) for i in range(3)))


def deepest_points(drive: Drive, errors: DriveErrors, theta: ArrayLike) -> DeepestPoints:
    """Deepest points of `drive` at input angles `theta`, rad, shape (n,); results have shape (2, ..., n) for `errors`
    of shape (...). The geometry is that of `branches`."""
    return deepest(branches(drive, errors, theta))
