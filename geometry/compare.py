"""A measured cam against the one that was designed: best fit, deviations along the normal, verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.polar_points import SAME_RADIUS, last_place, require_one_point_an_angle, without_closing_point
from hdopt.errors import HdoptError
from hdopt.files import cells_of, read_text
from hdopt.geometry.contour import Circle, Contour
from hdopt.words import counted

POLAR, CARTESIAN = ("angle_deg", "radius_mm"), ("x_mm", "y_mm")
FEWEST_POINTS = 16
MOST_PREAMBLE = 100
"""Lines of a measuring machine's own words in which the names of the columns are looked for."""

LARGEST_GAP = math.radians(30)
FitMethod = Literal["least_squares", "minimum_zone"]
MOST_PROGRAMMES, SETTLED = 20, 1e-9
"""Linear programmes of a minimum zone at most, and the gain, mm, below which no further one is worth its while."""

FARTHEST = 1.0
"""A point farther from the cam than this, mm, is not of it."""


@dataclass(frozen=True)
class CamFit:
    """A measured cam laid onto the nominal one.

    `rotation` rad clockwise and `shift` (x, y) mm are what the measured cam is turned and moved by against the nominal
    one; `angles` (rad, clockwise from the major axis) and `deviations` (mm along the normal, positive outside) are
    those of every point after both are taken away, in the order of the angles. `points` (n, 2), mm, are the surface
    itself, less the probe, turned back but not moved: as it lies about the axis that it was measured from.
    """

    rotation: float
    shift: tuple[float, float]
    angles: Array
    deviations: Array
    points: Array

    @property
    def largest(self) -> float:
        """Largest deviation, mm."""
        return float(np.abs(self.deviations).max())

    @property
    def rms(self) -> float:
        """Root mean square deviation, mm."""
        return float(np.sqrt(np.mean(self.deviations**2)))

    @property
    def noise(self) -> float:
        """Scatter of a single point, mm, from second differences (a smooth error of form has almost none)."""
        second = np.roll(self.deviations, 1) - 2 * self.deviations + np.roll(self.deviations, -1)
        return float(np.sqrt(np.mean(second**2) / 6))


def read_cam(path: Path) -> Array:
    """Points (n, 2), mm, of a CSV at `path` with columns angle_deg,radius_mm (clockwise from the major axis) or
    x_mm,y_mm.

    `#` starts a comment; further columns, and what a machine says above the line of names, are left alone. Cells are
    parted by commas, or by semicolons or tabs, between which numbers may have a decimal comma. A last point that closes
    the turn is left out, as a study's measured profile leaves it out. Raises `HdoptError` with the line of what cannot
    be used, and for an angle that comes twice.
    """
    lines = [
        (number, line)
        for number, line in enumerate(read_text(path, "a CSV of a measured cam", foreign=True).splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    first, header, kind = _header(path, lines)
    columns = [header.index(name) for name in kind]
    values, places = [], []
    for number, line in lines[first + 1 :]:
        cells = cells_of(line)
        if any(cell.strip() for cell in cells[len(header) :]):
            raise HdoptError(
                f"{path}, line {number}: holds {counted(len(cells), 'cell')} under {len(header)} names; does a "
                "decimal comma stand where a comma separates? part the cells by semicolons"
            )
        try:
            row = [float(cells[column]) for column in columns]
        except (ValueError, IndexError):
            raise HdoptError(f"{path}, line {number}: does not hold {' and '.join(kind)} as numbers") from None
        if not all(math.isfinite(value) for value in row):
            raise HdoptError(f"{path}, line {number}: holds a number that is not finite; leave the point out")
        values.append(row)
        places.append([last_place(cells[column]) for column in columns])
    if len(values) < FEWEST_POINTS:
        raise HdoptError(f"{path} has {counted(len(values), 'point')}; at least {FEWEST_POINTS} are needed")
    return _points_of(np.array(values), np.min(places, axis=0), kind, f"{path}:")


def _points_of(table: Array, places: Array, kind: tuple[str, str], where: str) -> Array:
    """Points (n, 2), mm, of the columns of `kind` in a `table` (n, 2), one an angle, without one that closes
    the turn; `where` names its file, and `places` are the units of the columns' last digits."""
    if kind is POLAR:
        angle, radius = without_closing_point(np.radians(table[:, 0]), table[:, 1], float(places[1]), where)
        require_one_point_an_angle(angle, where)
        return np.column_stack([radius * np.sin(angle), radius * np.cos(angle)])
    closes = np.abs(table[-1] - table[0]) <= np.maximum(places, SAME_RADIUS) * (1 + 1e-6)
    points = table[:-1] if closes.all() else table
    about = points - points.mean(0)  # the part may lie anywhere on the machine's table
    require_one_point_an_angle(np.arctan2(about[:, 0], about[:, 1]), where)
    return points


def _header(path: Path, lines: Sequence[tuple[int, str]]) -> tuple[int, list[str], tuple[str, str]]:
    """Which of the `lines`, (number, text), names the columns; all its names, and the two that are wanted."""
    for index, (_, line) in enumerate(lines[:MOST_PREAMBLE]):
        header = [cell.strip() for cell in cells_of(line)]
        for names in (POLAR, CARTESIAN):
            if set(names) <= set(header):
                return index, header, names
    raise HdoptError(f"{path}: a line must name the columns {','.join(POLAR)} or {','.join(CARTESIAN)}; add it")


def fit_cam(
    points: Array,
    contour: Contour,
    probe_radius: float = 0.0,
    method: FitMethod = "least_squares",
    source: str = "array",
) -> CamFit:
    """Turn and move measured points onto a contour: by `method` so that the sum of squared deviations is least, or the
    largest one (the minimum zone that ISO 1101 judges a form by).

    `points` of shape (n, 2), mm, are centres of a ball of `probe_radius` mm that touches the cam from outside (0: they
    are on the surface), and `source` the file that they came from, which `HdoptError` names where points are missing
    over more than 30 degrees or are not of this cam.
    """
    if not 0 <= probe_radius < math.inf:
        raise HdoptError(f"the probe radius is {probe_radius:g} mm; it must be a finite number, 0 or above")
    turns = not isinstance(contour, Circle)

    def residuals(x: Array) -> Array:
        return contour.deviation(_moved(points, x)) - probe_radius

    middle = np.array([0.0, contour.offset]) if isinstance(contour, Circle) else np.zeros(2)
    _require_all_round(points - points.mean(0), source)
    best = _least_squares(residuals, points.mean(0) - middle, turns)
    if method == "minimum_zone":
        best = _least_largest(residuals, best, turns)
    # Half a turn is no difference to a cam with two like lobes.
    best[2] = (best[2] + math.pi / 2) % math.pi - math.pi / 2 if turns else 0.0
    at = _moved(points, best)
    deviation = residuals(best)
    if np.abs(deviation).max() > FARTHEST:
        raise HdoptError(
            f"{source}: the points lie up to {np.abs(deviation).max():.4g} mm off the cam of this study; give its own "
            "measurement, the probe's radius (--probe-radius-mm), or --surface bearing"
        )
    angle = np.mod(np.arctan2(at[:, 0], at[:, 1]), 2 * math.pi)
    order = np.argsort(angle)
    surface = at - probe_radius * _normals(at, contour)
    sin, cos = math.sin(best[2]), math.cos(best[2])
    shift = np.array([best[0] * cos - best[1] * sin, best[0] * sin + best[1] * cos])
    return CamFit(
        float(best[2]), (float(shift[0]), float(shift[1])), angle[order], deviation[order], (surface + shift)[order]
    )


def _moved(points: Array, x: Array) -> Array:
    """The points less the shift x[:2], turned back counter-clockwise by x[2], for angles count clockwise."""
    sin, cos = math.sin(x[2]), math.cos(x[2])
    away = points - x[:2]
    return np.column_stack([away[:, 0] * cos - away[:, 1] * sin, away[:, 0] * sin + away[:, 1] * cos])


def _least_squares(residuals: Callable[[Array], Array], start: Array, turns: bool) -> Array:
    """Shift (mm) and rotation (rad) with the least sum of squares; the rotation stays 0 unless the contour `turns`."""
    from scipy.optimize import least_squares

    free = 3 if turns else 2

    def of_free(x: Array) -> Array:
        return residuals(np.append(x, [0.0] * (3 - free)))

    fits = [
        least_squares(of_free, [*start, turn][:free], x_scale=[0.01] * free, xtol=1e-14, ftol=1e-14)
        for turn in ([0.0, math.pi / 2] if turns else [0.0])
    ]
    return np.append(min(fits, key=lambda fit: fit.cost).x, [0.0] * (3 - free))


def _least_largest(residuals: Callable[[Array], Array], start: Array, turns: bool) -> Array:
    """Shift and rotation whose largest deviation is least, from the least squares' on.

    The deviations are linear in so small a move but for second order: a few linear programmes, each about the last
    one's answer, find it.
    """
    from scipy.optimize import linprog

    free, x, step = (3 if turns else 2), start.copy(), 1e-5
    for _ in range(MOST_PROGRAMMES):
        now = residuals(x)
        moves = step * np.eye(3)[:free]
        slope = np.column_stack([(residuals(x + move) - residuals(x - move)) / (2 * step) for move in moves])
        one = np.ones((len(now), 1))
        rows, sides = np.vstack([np.hstack([slope, -one]), np.hstack([-slope, -one])]), np.concatenate([-now, now])
        # Counted in um, or the solver's own tolerance would be as large as the answer.
        bounds = [(-100.0, 100.0)] * free + [(0.0, None)]
        found = linprog([0.0] * free + [1.0], rows, 1e3 * sides, bounds=bounds)
        if found.x is None:
            break
        tried = x + np.append(1e-3 * found.x[:free], [0.0] * (3 - free))
        if np.abs(residuals(tried)).max() >= np.abs(now).max() - SETTLED:
            break
        x = tried
    return x


def _normals(points: Array, contour: Contour) -> Array:
    """Outward unit normals (n, 2) of the contour's parallel through each point: the gradient of its deviation."""
    step = 1e-5
    gradient = [
        (contour.deviation(points + move) - contour.deviation(points - move)) / (2 * step)
        for move in (np.array([step, 0.0]), np.array([0.0, step]))
    ]
    normal = np.column_stack(gradient)
    return np.asarray(normal / np.hypot(*normal.T)[:, None])


def _require_all_round(points: Array, source: str) -> None:
    """Raise `HdoptError` that names their `source` where `points` (n, 2) leave a large part of a turn out."""
    angle = np.sort(np.mod(np.arctan2(points[:, 0], points[:, 1]), 2 * math.pi))
    gap = float(np.diff(np.append(angle, angle[0] + 2 * math.pi)).max())
    if gap > LARGEST_GAP:
        raise HdoptError(
            f"{source}: the points leave {math.degrees(gap):.3g} deg of the cam out; gaps of up to "
            f"{math.degrees(LARGEST_GAP):g} deg are allowed: measure all round"
        )


def table_of(fit: CamFit) -> list[dict[str, float]]:
    """One row a point of a `fit`: angle in degrees, clockwise from the major axis, and deviation in um."""
    rows = zip(np.degrees(fit.angles).tolist(), (1e3 * fit.deviations).tolist(), strict=True)
    return [{"angle_deg": angle, "deviation_um": deviation} for angle, deviation in rows]
