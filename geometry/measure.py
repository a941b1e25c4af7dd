"""From an exported file back to the model: the profile that the made parts give the flexspline's inner wall."""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.profiles import MeasuredProfile, TwoDisk
from hdopt.errors import HdoptError
from hdopt.geometry.step import StepFile
from hdopt.geometry.surface import walls

SHARES = tuple((k + 0.5) / 8 for k in range(8))
"""Where each span of the wall is measured: close enough to follow a tip whose curvature has a corner (Resal)."""


def measured_profile(file: StepFile, bearing_thickness: float, wrap: TwoDisk | None = None) -> MeasuredProfile:
    """The profile as the cam of a `file`, or its two discs, would give it: the outer wall, outward by
    `bearing_thickness`, mm.

    The wall is walked at one height, so its points and their neighbours alone give the normals. Two discs carry the
    flexspline over the wrap angle only; `wrap` then says how the free part runs in between (Eq. (38), moved out to
    meet the discs' edge).
    """
    names = [part.name for part in file.parts]
    if "cam" in names:
        return _as_profile(_offset_wall(file, "cam", bearing_thickness), file)
    if wrap is None or not {"disc_1", "disc_2"} <= set(names):
        raise HdoptError(
            f"{file.path.name} holds {', '.join(names)}; a profile needs a cam, or two discs and the two-disk profile"
        )
    gamma = wrap.wrap_angle
    points = []
    for name, axis in (("disc_1", 0.0), ("disc_2", math.pi)):
        wall = _offset_wall(file, name, bearing_thickness)
        away = np.angle(np.exp(1j * (np.arctan2(wall[:, 0], wall[:, 1]) - axis)))
        points.append(wall[np.abs(away) <= gamma])
    on_discs = np.concatenate(points)
    radii = np.hypot(*on_discs.T)
    edge = np.argsort(np.abs(np.abs(np.sin(np.arctan2(on_discs[:, 0], on_discs[:, 1]))) - math.sin(gamma)))[:4]
    step = float(np.mean(radii[edge] - wrap.radius(np.arctan2(on_discs[edge, 0], on_discs[edge, 1]))))
    free = np.concatenate([axis + np.linspace(gamma, math.pi - gamma, 91)[1:-1] for axis in (0.0, math.pi)])
    radius = wrap.radius(free) + step
    free_points = np.stack([radius * np.sin(free), radius * np.cos(free)], 1)
    return _as_profile(np.concatenate([on_discs, free_points]), file)


def _offset_wall(file: StepFile, name: str, distance: float) -> Array:
    """The outer wall of a part at its lowest sampled height, moved outward along its normals; shape (n, 2), mm."""
    from scipy.interpolate import CubicSpline

    part = next(part for part in file.parts if part.name == name)
    points = walls(part.solids[0], SHARES)[0].points
    level = points[np.abs(points[:, 2] - points[:, 2].min()) < 1e-6][:, :2]
    centre = (level.max(0) + level.min(0)) / 2
    angle = np.arctan2(*(level - centre).T)
    order = np.argsort(angle)
    angle, level = angle[order], level[order]
    closed = np.append(angle, angle[0] + 2 * math.pi)
    curve = CubicSpline(closed, np.concatenate([level, level[:1]]), bc_type="periodic")
    tangent = curve(angle, 1)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], 1) / np.hypot(*tangent.T)[:, None]
    return np.asarray(level + distance * normal)


def _as_profile(points: Array, file: StepFile) -> MeasuredProfile:
    angle = np.mod(np.arctan2(points[:, 0], points[:, 1]), 2 * math.pi)
    order = np.argsort(angle)
    return MeasuredProfile(angle[order], np.hypot(*points[order].T), source=str(file.path))
