"""The cam as a table: angle, radius, direction of the normal and curvature, for grinding and for inspection."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.files import JsonReady
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.contour import Circle, Contour, ParallelCurve

if TYPE_CHECKING:
    from hdopt.geometry.job import Job


COLUMNS = ("angle_deg", "radius_mm", "normal_deg", "curvature_per_mm")
ROUNDING = 1e-6
"""What the digits of the file may differ by from the curve, mm."""

FEWEST_POINTS, MOST_POINTS = 16, 360_000


def cam_table(contour: Contour, resolution_deg: float) -> Array:
    """The cam's `contour` as rows of angle, radius (mm), normal's direction (all angles in rad, clockwise from the
    major axis) and curvature, 1/mm.

    Shape (n, 4), n = 360/`resolution_deg` rounded up; the angles are those of the points themselves, evenly spaced from
    0. Raises `HdoptError` for a resolution that gives fewer than 16 or more than 360,000 points.
    """
    if not 360 / MOST_POINTS <= resolution_deg <= 360 / FEWEST_POINTS:
        raise HdoptError(
            f"the resolution is {resolution_deg:g} deg; it must lie between {360 / MOST_POINTS:g} and "
            f"{360 / FEWEST_POINTS:g} deg (export.cam_resolution_deg)"
        )
    count = math.ceil(360 / resolution_deg - 1e-9)
    angle = np.asarray(np.arange(count) * (2 * math.pi / count), float)
    if isinstance(contour, Circle):
        return _of_circle(contour, angle)
    assert isinstance(contour, ParallelCurve)
    phi = _parameter_at(contour, angle)
    x, y = contour.points(phi).T
    along_x, along_y = contour.tangents(phi).T
    # The tangent runs clockwise; the outward normal stands a quarter turn to its left.
    normal = np.mod(np.arctan2(-along_y, along_x), 2 * math.pi)
    return np.column_stack([angle, np.hypot(x, y), normal, contour.curvature(phi)])


def _of_circle(circle: Circle, angle: Array) -> Array:
    e, r = circle.offset, circle.radius
    radius = e * np.cos(angle) + np.sqrt(r**2 - (e * np.sin(angle)) ** 2)
    normal = np.mod(np.arctan2(radius * np.sin(angle), radius * np.cos(angle) - e), 2 * math.pi)
    return np.column_stack([angle, radius, normal, np.full(len(angle), 1 / r)])


def _parameter_at(curve: ParallelCurve, angle: Array) -> Array:
    """The profile's angle phi whose point on the parallel curve lies in the direction `angle`, by Newton's method."""
    phi = angle.copy()
    for _ in range(20):
        point, tangent = curve.points(phi), curve.tangents(phi)
        off = np.angle(np.exp(1j * (np.arctan2(point[:, 0], point[:, 1]) - angle)))
        turn = (tangent[:, 0] * point[:, 1] - tangent[:, 1] * point[:, 0]) / np.einsum("ij,ij->i", point, point)
        step = off / turn
        phi = phi - step
        if np.abs(step).max() < 1e-13:
            break
    return phi


def write_cam(path: Path, job: Job) -> None:
    """Write the table of the part of a `job` that carries the bearing (disc 1 of two) to `path`, as CSV with its origin
    in comments."""
    part = job.model.profiled[0]
    rows = cam_table(part.contour, job.model.cam_resolution_deg)
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(f"# {job.identity.title}: {part.name}; {job.identity.description}\n")
        file.write("# angles clockwise from the major axis about the axis of rotation; normal outward; lengths in mm\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for angle, radius, normal, curvature in rows.tolist():
            writer.writerow(
                [f"{math.degrees(angle):.9g}", f"{radius:.7f}", f"{math.degrees(normal):.7f}", f"{curvature:.10f}"]
            )


def check_cam(path: Path, job: Job, name: str) -> JsonReady:
    """Read the table at `path` back: every point against the analytic curve of the `job`, every normal against the
    chord of its neighbours. Raises `CheckFailed`, which calls the file `name`, with all that is wrong."""
    with open(path, encoding="utf-8") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    values = np.array(rows[1:], float)
    angle, radius, normal = np.radians(values[:, 0]), values[:, 1], np.radians(values[:, 2])
    points = np.column_stack([radius * np.sin(angle), radius * np.cos(angle)])
    contour = job.model.profiled[0].contour
    deviation = float(np.abs(contour.deviation(points)).max())
    failures = []
    if tuple(rows[0]) != COLUMNS:
        failures.append(f"its columns are {', '.join(rows[0])}, not {', '.join(COLUMNS)}")
    if not deviation <= ROUNDING:
        failures.append(f"it is {deviation * 1e3:.4g} um off the analytic curve")
    chord = np.roll(points, -1, 0) - np.roll(points, 1, 0)
    across = np.abs(np.sin(normal) * chord[:, 0] + np.cos(normal) * chord[:, 1]) / np.hypot(*chord.T)
    if not across.max() <= math.radians(job.model.cam_resolution_deg):
        failures.append("a normal is not square to the curve")
    if failures:
        raise CheckFailed(name, failures)
    return {"points": len(values), "max_profile_deviation_um": deviation * 1e3}
