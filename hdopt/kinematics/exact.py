"""The exact geometry of Jia 2021, Eqs. (16)-(23): where the wave generator reaches deepest. The reference, to be read.

The wave generator's two rim curves are carried through its own tilt and offset, then through those of the input axis,
and projected on the plane of the circular spline. In each meshing zone the projected point that lies farthest out, over
both rims, is the deepest point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hdopt.deviations import DriveErrors
from hdopt.drive import Drive

Array = NDArray[np.float64]

ZONE_HALF_WIDTH = np.pi / 3
"""How far from either end of the major axis the deepest point is sought, rad."""
GRID_POINTS = 121
NEWTON_STEPS = 6


@dataclass(frozen=True)
class DeepestPoints:
    """The deepest points of both meshing zones; the first axis of every array is the zone (0: near the + major end).

    `depth` delta = |H| - L_W, mm; `offset_cs` and `offset_fs` are the angles o, o' off the major axis, rad, positive
    toward +v in both zones, seen from the CS centre and in the wave generator's own frame; `rim` is the deepest rim,
    +1 or -1: where it changes, the offsets step.
    """

    depth: Array
    offset_cs: Array
    offset_fs: Array
    rim: Array


def tilt_frame(tilt_y: float, tilt_x: float) -> Array:
    """Columns x, y, z of a frame tilted by (t2, t3) = (`tilt_y`, `tilt_x`) rad; shape (3, 3) (Jia 2021, Eq. (16))."""
    z = np.array([np.tan(tilt_x), np.tan(tilt_y), 1.0])
    z /= np.linalg.norm(z)
    y = np.array([0.0, np.cos(tilt_y), -np.sin(tilt_y)])
    return np.stack([np.cross(y, z), y, z], axis=1)


def turned_clockwise(theta: Array) -> Array:
    """Matrices that turn a vector clockwise by theta about z; shape (n, 3, 3)."""
    cos, sin, zero = np.cos(theta), np.sin(theta), np.zeros_like(theta)
    return np.stack(
        [
            np.stack([cos, sin, zero], -1),
            np.stack([-sin, cos, zero], -1),
            np.stack([zero, zero, zero + 1], -1),
        ],
        axis=-2,
    )


def deepest_points(drive: Drive, errors: DriveErrors, theta: ArrayLike) -> DeepestPoints:
    """Deepest points of one drive at input angles `theta`, rad, shape (n,); results have shape (2, n).

    Jia 2021, Eqs. (16)-(23). `errors` must be scalars. The contour is searched within 60 deg of either end of the major
    axis on a grid, then polished by Newton steps; valid for any profile with a second derivative, and for errors
    that keep the deepest point in that range. The structure removes what it aligns: the total in-plane
    eccentricity along the major axis, the minor axis, or both.
    """
    theta = np.asarray(theta, float).ravel()
    profile, half_width = drive.wave_generator.profile, drive.wave_generator.width / 2
    structure = drive.wave_generator.structure
    e = errors

    axis = tilt_frame(e.axis_tilt_y, e.axis_tilt_x)
    wave_generator = turned_clockwise(theta) @ tilt_frame(e.wg_tilt_major, e.wg_tilt_minor)
    to_plane = (axis @ wave_generator)[:, :2, :]

    direction = e.wg_eccentricity_direction + theta
    wg_offset = e.wg_eccentricity * np.stack([np.sin(direction), np.cos(direction), 0 * theta], -1)
    beta = e.axis_eccentricity_direction
    centre = (wg_offset @ axis.T)[:, :2] + e.axis_eccentricity * np.array([np.sin(beta), np.cos(beta)])
    major = np.stack([np.sin(theta), np.cos(theta)], -1)
    minor = np.stack([np.cos(theta), -np.sin(theta)], -1)
    centre = structure.passes_major * np.sum(centre * major, -1, keepdims=True) * major + (
        structure.passes_minor * np.sum(centre * minor, -1, keepdims=True) * minor
    )

    def rim_point(phi: Array, rim: float, derivative: int) -> Array:
        """A rim point in the wave generator's frame, or its derivative by the contour angle; (...) -> (..., 3)."""
        r = [profile.radius(phi, order) for order in range(derivative + 1)]
        sin, cos = np.sin(phi), np.cos(phi)
        if derivative == 0:
            return np.stack([r[0] * sin, r[0] * cos, np.full_like(phi, rim * half_width)], -1)
        if derivative == 1:
            return np.stack([r[1] * sin + r[0] * cos, r[1] * cos - r[0] * sin, np.zeros_like(phi)], -1)
        bent = r[2] - r[0]
        return np.stack([bent * sin + 2 * r[1] * cos, bent * cos - 2 * r[1] * sin, np.zeros_like(phi)], -1)

    def projected(phi: Array, rim: float, derivative: int) -> Array:
        """One rim point for each input angle, on the plane of the circular spline; (n,) -> (n, 2)."""
        return (to_plane @ rim_point(phi, rim, derivative)[:, :, None])[:, :, 0]

    grid = np.linspace(-ZONE_HALF_WIDTH, ZONE_HALF_WIDTH, GRID_POINTS)
    spacing = grid[1] - grid[0]
    zones = []
    for start, side in ((0.0, 1.0), (np.pi, -1.0)):
        found = []
        for rim in (1.0, -1.0):
            on_grid = to_plane @ rim_point(start + grid, rim, 0).T + centre[:, :, None]
            phi = phi0 = start + grid[np.argmax(np.sum(on_grid**2, axis=1), axis=1)]
            for _ in range(NEWTON_STEPS):
                h = projected(phi, rim, 0) + centre
                h1, h2 = projected(phi, rim, 1), projected(phi, rim, 2)
                slope = np.sum(h * h1, -1)
                bend = np.sum(h1 * h1 + h * h2, -1)
                # Away from a maximum (bend >= 0) a Newton step would leave it: stay on the grid point then.
                step = np.where(bend < 0, slope / np.where(bend < 0, bend, -1.0), 0.0)
                phi = phi0 + np.clip(phi - step - phi0, -spacing, spacing)
            point = projected(phi, rim, 0) + centre
            seen_cs = np.arctan2(np.sum(point * minor, -1), side * np.sum(point * major, -1))
            found.append([np.hypot(*point.T) - profile.semi_major, seen_cs, side * (phi - start)])
        deeper = found[0][0] >= found[1][0]
        chosen = [np.where(deeper, upper, lower) for upper, lower in zip(*found, strict=True)]
        # Rims are counted along the zone's own direction, as in the closed form: s k names one edge of the cam.
        zones.append([*chosen, side * np.where(deeper, 1.0, -1.0)])
    return DeepestPoints(*(np.stack(pair) for pair in zip(*zones, strict=True)))
