"""Curves as tangent circular arcs: what a wire-cutting machine drives (G2/G3), and how far the arcs are from the curve.

A closed outline is an array of rows (x, y, bulge): from each point an arc runs to the next one, with bulge =
tan(angle/4), positive counter-clockwise, as DXF polylines have it.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.geometry.contour import Circle, Contour, ParallelCurve
from hdopt.geometry.features import Bore, DBore, KeywayBore
from hdopt.geometry.slide_features import Slot

ARC_TOLERANCE = 2e-5
"""Largest distance between a curve and its arcs, mm."""

MOST_ARCS = 20000


def outline_of(contour: Contour) -> Array:
    """A contour as tangent arcs, counter-clockwise."""
    if isinstance(contour, Circle):
        moved = _arc(contour.radius, 0.0, 2 * math.pi)[:-1] + np.array([0.0, contour.offset, 0.0])
        return np.asarray(moved, float)
    if not isinstance(contour, ParallelCurve):
        raise TypeError(f"no arcs are known for a {type(contour).__name__}")
    return _biarcs(contour)


def _biarcs(curve: ParallelCurve) -> Array:
    """Pairs of arcs that share end points and end tangents with the curve and meet tangentially."""
    count = 16
    while 2 * count <= MOST_ARCS:
        pieces = [
            np.linspace(start, end, max(2, math.ceil(count * (end - start) / (2 * math.pi))) + 1)[:-1]
            for start, end in zip(curve.breaks[:-1], curve.breaks[1:], strict=True)
        ]
        # phi counts clockwise; the outline runs the other way.
        phi = np.concatenate(pieces)[::-1]
        rows = _join(curve.points(phi), -curve.tangents(phi))
        if np.abs(curve.deviation(sample(rows))).max() <= ARC_TOLERANCE:
            return rows
        count *= 2
    raise HdoptError(
        f"the {curve.profile.name} profile is too rough for wire cutting: {MOST_ARCS} arcs do not follow it within "
        f"{ARC_TOLERANCE * 1e3:g} um; give the points' scatter as wave_generator.noise_um, so that the profile is "
        "smoothed"
    )


def _join(points: Array, tangents: Array) -> Array:
    """Biarcs with equal tangent lengths between each point and the next, all the way round."""
    tangents = tangents / np.hypot(*tangents.T)[:, None]
    ends, end_tangents = np.roll(points, -1, 0), np.roll(tangents, -1, 0)
    chord, both = ends - points, tangents + end_tangents
    along, squared = _dot(chord, both), _dot(chord, chord)
    length = squared / (along + np.sqrt(along**2 + 2 * (1 - _dot(tangents, end_tangents)) * squared))
    middle = (points + ends + length[:, None] * (tangents - end_tangents)) / 2
    first = np.tan(_turn(tangents, middle - points) / 2)
    second = np.tan(_turn(ends - middle, end_tangents) / 2)
    rows = np.empty((2 * len(points), 3))
    rows[0::2], rows[1::2] = np.column_stack([points, first]), np.column_stack([middle, second])
    return rows


def _arc(radius: float, start: float, end: float) -> Array:
    """A circular arc about the origin as short arcs, its end point with bulge 0 last; angles counter-clockwise from x.

    Many readers turn arcs into Bezier curves, which miss a quarter circle by 3e-4 of its radius and these by 1e-9.
    """
    count = max(1, math.ceil(abs(end - start) / (math.pi / 16)))
    angles = np.linspace(start, end, count + 1)
    bulge = np.append(np.full(count, math.tan((end - start) / count / 4)), 0.0)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), bulge])


def sample(outline: Array, shares: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75)) -> Array:
    """Points (n, 2) on the arcs of an outline, at these shares of every arc."""
    start, end, bulge = outline[:, :2], np.roll(outline[:, :2], -1, 0), outline[:, 2]
    chord = end - start
    normal = np.stack([chord[:, 1], -chord[:, 0]], 1)
    half = 2 * np.arctan(bulge)
    points = []
    for share in shares:
        # Chord coordinates of a point at this share of the arc; a straight piece is the limit of a flat one.
        angle = half * (2 * share - 1)
        with np.errstate(invalid="ignore", divide="ignore"):
            along = np.where(bulge == 0, share, 0.5 + np.sin(angle) / (2 * np.sin(half)))
            beside = np.where(bulge == 0, 0.0, (np.cos(angle) - np.cos(half)) / (2 * np.sin(half)))
        points.append(start + along[:, None] * chord + beside[:, None] * normal)
    return np.stack(points, 1).reshape(-1, 2)


def enclosed_area(outline: Array) -> float:
    """Area inside an outline, mm^2, exact: the polygon of its points and the segments of its arcs."""
    x, y, bulge = outline.T
    nx, ny = np.roll(x, -1), np.roll(y, -1)
    angle = 4 * np.arctan(bulge)
    chord = np.hypot(nx - x, ny - y)
    flat = np.abs(bulge) < 1e-12
    radius = np.where(flat, 0.0, chord / (2 * np.sin(np.where(flat, 1.0, np.abs(angle)) / 2)))
    segments = np.sign(bulge) * radius**2 * (np.abs(angle) - np.sin(np.abs(angle))) / 2
    return abs(float(np.sum(x * ny - nx * y) / 2 + np.sum(segments)))


def outline_of_bore(bore: Bore) -> Array:
    """A bore with its keyway or flat, counter-clockwise."""
    if isinstance(bore, KeywayBore):
        half, reach = bore.key.width / 2, bore.bottom
        angle = math.asin(half / bore.radius)
        round_part = _arc(bore.radius, math.pi / 2 + angle, 5 * math.pi / 2 - angle)
        r, quarter = bore.key.corner, math.tan(math.pi / 8)
        bottom = [
            (half, reach - r, quarter),
            (half - r, reach, 0.0),
            (r - half, reach, quarter),
            (-half, reach - r, 0.0),
        ]
        return _turned(np.vstack([round_part, bottom]), bore.direction)
    if isinstance(bore, DBore):
        angle = math.acos(bore.flat / bore.radius)
        return _turned(_arc(bore.radius, math.pi / 2 + angle, 5 * math.pi / 2 - angle), bore.direction)
    return outline_of(Circle(bore.radius))


def outline_of_slot(slot: Slot) -> Array:
    """A closed slot, counter-clockwise."""
    end = np.array([0.0, slot.half_length, 0.0])
    ends = _arc(slot.width / 2, 0.0, math.pi) + end, _arc(slot.width / 2, math.pi, 2 * math.pi) - end
    return _turned(np.vstack(ends), slot.direction)


def outline_of_strip(width: float, radius: float, direction: float) -> Array:
    """The part of a disc of `radius` mm in a strip of `width` mm along `direction`, counter-clockwise; the direction in
    rad, clockwise from the major axis."""
    angle = math.asin(min(1.0, width / 2 / radius))
    top = _arc(radius, math.pi / 2 - angle, math.pi / 2 + angle)
    bottom = _arc(radius, 3 * math.pi / 2 - angle, 3 * math.pi / 2 + angle)
    return _turned(np.vstack([top, bottom]), direction)


def _turned(outline: Array, direction: float) -> Array:
    """Turned clockwise from the major axis."""
    x, y, bulge = outline.T
    cos, sin = math.cos(direction), math.sin(direction)
    return np.column_stack([x * cos + y * sin, y * cos - x * sin, bulge])


def _turn(first: Array, second: Array) -> Array:
    """Angle from one direction to another, rad, positive counter-clockwise."""
    cross = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return np.arctan2(cross, _dot(first, second))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", a, b))
