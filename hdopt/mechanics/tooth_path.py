"""How far from the major axis the flanks can carry, and whether they jam: what a small pressure angle costs.

A flexspline tooth leaves its space along a path that the deflection prescribes, not the flank: it withdraws by
d = w(0) - w(psi) while it shifts sideways by t = m psi - integral of w. (With w = kappa m cos 2 psi and
theta = 2 psi this is the rack approximation that strain-wave tooth forms are designed with, x = m (theta - kappa sin
theta)/2, y = kappa m cos theta: Musser, US patent 2,906,143, 1959; Ishikawa, US patent 4,823,638, 1989.) A flank of
pressure angle alpha follows only while t <= d tan(alpha) + half the backlash. Beyond that angle the tip must be
relieved, and a relieved tooth carries nothing.

The rack leaves the tooth's lean out (`tooth_gap`). A straight flank would touch with its tip long before; tooth forms
are corrected for it, by what `tip_relief` says. The trailing flank is not relieved: its room is that of the exact
motion, gap by gap. Where w0 exceeds m, the tooth first moves back, and that room shrinks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.drive.profiles import WaveGeneratorProfile, perimeter_error, polar_curvature
from hdopt.errors import HdoptError, MissingValue
from hdopt.late import late
from hdopt.mechanics.bending import ring_wall
from hdopt.mechanics.contact import TIPS, Contact, contact_angle
from hdopt.mechanics.tooth_gap import (
    CELL,
    LEADING,
    NODES,
    TRAILING,
    Flanks,
    Ring,
    deflection_at,
    gap_at,
    largest_overlap,
    least_trailing_gap,
    ring_of,
    straight_flanks,
)
from hdopt.mechanics.zone_sides import mean_of_sides, zone_sides

GRID = np.linspace(0.0, math.pi / 2, NODES)
"""Where a profile is sampled with two derivatives: quintics between 1 deg steps keep 1e-13 mm of smooth profiles, and
3e-9 mm where the two-disk profile's third derivative jumps."""
NEWTON_STEPS = 12
NO_STRETCH = 1e-10
"""A stretch up to this is rounding of an ellipse of equal perimeter (1e-13 mm of its minor axis); steel: 2e-5 MPa."""


@dataclass(frozen=True)
class Mesh:
    """The mesh of one flexspline on one profile; everything here is independent of the wave generator's width.

    Path, ring and gaps are those of the quarter turn behind the first tip. The quantities of the whole mesh are the
    mean over all four `sides` of its two zones, or the worst of them, where a measured profile makes them differ.
    """

    geometry: DriveGeometry
    profile: WaveGeneratorProfile

    @cached_property
    def sides(self) -> tuple[Mesh, ...]:
        """The mesh on every side of both zones: itself alone where the profile makes them all alike (`zone_sides`)."""
        sides = zone_sides(self.profile)
        return (self,) if len(sides) == 1 else tuple(Mesh(self.geometry, side) for side in sides)

    @cached_property
    def _sampled(self) -> Array:
        """Deflection w, w', w'' and the integral of w from the major axis on `GRID`, shape (4, 91)."""
        rows = np.empty((4, len(GRID)))
        for derivative in range(3):
            rows[derivative] = self.profile.radius(GRID, derivative)
        rows[0] -= self.geometry.flexspline_inner_radius
        _integrate(rows)
        return rows

    def path(self, psi: float) -> tuple[float, float]:
        """Withdrawal d and sideways shift t of a flexspline tooth at `psi` rad from the major axis, mm."""
        w, _, integral = deflection_at(self._sampled, psi)
        return self._sampled[0, 0] - w, self.geometry.module * psi - integral

    @cached_property
    def ring(self) -> Ring:
        """The deformed ring, half a wall outside the profile. Raises `MissingValue` where the geometry has no wall."""
        gear = self.geometry
        neutral = gear.flexspline_inner_radius + ring_wall(gear) / 2
        return ring_of(self._sampled, neutral, gear.flexspline_teeth / gear.circular_spline_teeth)

    def flanks(self, pressure_angle: float, backlash: float) -> Flanks:
        """Straight flanks of `pressure_angle` (rad) with half of the `backlash` (mm) on either side of a tooth on the
        major axis; tooth and space are half a pitch wide at the pitch line."""
        gear = self.geometry
        if gear.flexspline_addendum is None or gear.circular_spline_addendum is None:
            raise MissingValue("the flanks", "drive.flexspline_addendum_mm", "drive.circular_spline_addendum_mm")
        pitch_radius = gear.module * gear.flexspline_teeth / 2
        heights = (
            pitch_radius - self.ring.neutral,
            gear.flexspline_addendum,
            pitch_radius + self._sampled[0, 0],
            gear.module * gear.circular_spline_teeth / 2 - gear.circular_spline_addendum,
        )
        half = math.pi * gear.module / 4
        return straight_flanks(heights, (half, half + backlash / 2), math.tan(pressure_angle))

    def gaps(self, phi: Array, pressure_angle: float, backlash: float) -> tuple[Array, Array]:
        """Gaps (mm) of the leading and of the trailing flanks of teeth at `phi` (rad from the major axis, up to pi/2),
        same shape each; infinite where tooth and space share no height. `pressure_angle` and `backlash` as in
        `flanks`."""
        ring, flanks = self.ring, self.flanks(pressure_angle, backlash)
        leading, trailing = (np.array([gap_at(ring, flanks, at, side) for at in phi]) for side in (LEADING, TRAILING))
        return leading, trailing

    @cached_property
    def _clearance(self) -> float:
        """By how much tips would miss each other without deflection, mm: overlap is w less this."""
        gear = self.geometry
        if gear.flexspline_addendum is None or gear.circular_spline_addendum is None:
            raise MissingValue("the contact angle", "drive.flexspline_addendum_mm", "drive.circular_spline_addendum_mm")
        pitch_lines = gear.module * (gear.circular_spline_teeth - gear.flexspline_teeth) / 2
        return pitch_lines - gear.circular_spline_addendum - gear.flexspline_addendum

    @cached_property
    def contact_angle(self) -> float:
        """Half angle over which the tips overlap, rad; the same as `hdopt.mechanics.contact.contact_angle`."""
        if len(self.sides) > 1:
            return mean_of_sides([side.contact_angle for side in self.sides])
        psi = _falls_to(self._sampled, self._clearance)
        return contact_angle(self.geometry, self.profile) if math.isnan(psi) else psi

    def free_flank_angle(self, pressure_angle: float, backlash: float) -> float:
        """Largest angle psi (rad) up to which the leading straight flank runs free: t <= d tan(alpha) + backlash/2.

        pi/2 where it always does. Rack approximation: a flank that is corrected for the tooth's lean, see `tip_relief`.
        The mean over the sides of both zones.
        """
        if backlash < 0:
            raise HdoptError(f"the backlash is {backlash:g} mm; it must not be negative")
        if len(self.sides) > 1:
            return mean_of_sides([side.free_flank_angle(pressure_angle, backlash) for side in self.sides])
        return _free_angle(self._sampled, self.geometry.module, math.tan(pressure_angle), backlash / 2)

    def tip_relief(self, pressure_angle: float, backlash: float) -> float:
        """By how much (mm) a straight flank of `pressure_angle` (rad) overlaps its space at most on the way to the
        carrying angle, by the exact motion: what the tooth form must be corrected by, on the worst side of a zone.
        `backlash` in mm."""
        if len(self.sides) > 1:
            return max(side.tip_relief(pressure_angle, backlash) for side in self.sides)
        to = self.carrying_angle(pressure_angle, backlash)
        return float(largest_overlap(self.ring, self.flanks(pressure_angle, backlash), to))

    def trailing_flank_room(self, pressure_angle: float, backlash: float) -> float:
        """Least gap (mm) of the trailing straight flank of `pressure_angle` (rad) on a tooth's way out, with the
        `backlash` in mm; on the worst side of a zone. Below zero the flanks jam near the major axis. It is at most half
        the backlash."""
        if len(self.sides) > 1:
            return min(side.trailing_flank_room(pressure_angle, backlash) for side in self.sides)
        return float(least_trailing_gap(self.ring, self.flanks(pressure_angle, backlash)))

    def carrying_angle(self, pressure_angle: float, backlash: float) -> float:
        """Half angle over which flanks can carry, rad: overlapped tips whose flanks run free. `pressure_angle` in rad,
        `backlash` in mm; the mean over the sides of both zones."""
        if len(self.sides) > 1:
            return mean_of_sides([side.carrying_angle(pressure_angle, backlash) for side in self.sides])
        return min(self.contact_angle, self.free_flank_angle(pressure_angle, backlash))

    def summed_depth(self, angle: float) -> float:
        """Depth of engagement summed over the teeth up to `angle` (rad) on the approaching flank of both zones, mm; the
        mean over the sides that may be the approaching one."""
        if len(self.sides) > 1:
            return mean_of_sides([side.summed_depth(angle) for side in self.sides])
        overlap = deflection_at(self._sampled, angle)[2] - angle * self._clearance
        return 2 * self.geometry.circular_spline_teeth / (2 * math.pi) * overlap

    def contact(self, counts: str, pressure_angle: float, backlash: float | None) -> Contact:
        """The teeth in contact: all whose tips overlap, or where `counts` is `FLANKS`, those whose flanks carry at this
        `pressure_angle` (rad) and `backlash` (mm). Each side of a zone counts up to its own angle, and the contact is
        the mean of the sides. Raises `MissingValue` where flanks count without a backlash."""
        if len(self.sides) > 1:
            found = [side.contact(counts, pressure_angle, backlash) for side in self.sides]
            angle, depth = (
                mean_of_sides([one.angle for one in found]),
                mean_of_sides([one.summed_depth for one in found]),
            )
            return Contact(self.geometry, angle, depth, counts)
        if counts == TIPS:
            angle = self.contact_angle
        elif backlash is None:
            raise MissingValue("contact of the flanks", "clearances.backlash_mm")
        else:
            angle = self.carrying_angle(pressure_angle, backlash)
        return Contact(self.geometry, angle, self.summed_depth(angle), counts)

    @cached_property
    def stretch(self) -> float:
        """By which share the profile stretches the ring's inner wall (`hdopt.mechanics.bending.hoop_stress`); not below
        0."""
        radius = self.geometry.flexspline_inner_radius
        stretch = perimeter_error(self.profile, radius) / (2 * math.pi * radius)
        return stretch if stretch > NO_STRETCH else 0.0

    @cached_property
    def largest_curvature_change(self) -> float:
        """As `hdopt.mechanics.bending.max_curvature_change`, from `GRID` and the end of the wrap, where its kink is."""
        if len(self.sides) > 1:
            return max(side.largest_curvature_change for side in self.sides)
        gear = self.geometry
        half_wall = ring_wall(gear) / 2
        neutral = gear.flexspline_inner_radius + half_wall
        w, slope, bend = self._sampled[:3]
        change = np.abs(polar_curvature(neutral + w, slope, bend) - 1 / neutral)
        wrap = getattr(self.profile, "wrap_angle", 0.0)
        radius, first, second = (self.profile.radius(wrap, derivative) for derivative in range(3))
        kink = abs(float(polar_curvature(radius + half_wall, first, second)) - 1 / neutral)
        return max(_peak(change), kink)


@late()
def _integrate(rows: Array) -> None:
    """Fill row 3 with the integral of the quintics through rows 0 to 2."""
    h = CELL
    rows[3, 0] = 0.0
    for i in range(rows.shape[1] - 1):
        values = (rows[0, i] + rows[0, i + 1]) / 2
        slopes = (rows[1, i] - rows[1, i + 1]) * h / 10
        bends = (rows[2, i] + rows[2, i + 1]) * h * h / 120
        rows[3, i + 1] = rows[3, i] + h * (values + slopes + bends)


@late()
def _falls_to(rows: Array, level: float) -> float:
    """Angle at which w first falls to `level`; NaN where it starts below, or never gets there."""
    if rows[0, 0] <= level:
        return math.nan
    for i in range(1, rows.shape[1]):
        if rows[0, i] < level:
            low, high = (i - 1) * CELL, i * CELL
            psi = (low + high) / 2
            for _ in range(NEWTON_STEPS):
                w, slope, _integral = deflection_at(rows, psi)
                if slope == 0.0:
                    break
                psi = min(max(psi - (w - level) / slope, low), high)
            return psi
    return math.nan


@late()
def _free_angle(rows: Array, module: float, tan_alpha: float, play: float) -> float:
    """The angle of `Mesh.free_flank_angle`; `play` is half the backlash, mm."""
    for i in range(1, rows.shape[1]):
        shift = module * i * CELL - rows[3, i]
        if play + (rows[0, 0] - rows[0, i]) * tan_alpha - shift < 0:
            low, high = (i - 1) * CELL, i * CELL
            psi = (low + high) / 2
            for _ in range(NEWTON_STEPS):
                w, slope, integral = deflection_at(rows, psi)
                room = play + (rows[0, 0] - w) * tan_alpha - (module * psi - integral)
                change = -slope * tan_alpha - (module - w)
                if change == 0.0:
                    break
                psi = min(max(psi - room / change, low), high)
            return psi
    return math.pi / 2


@late()
def _peak(values: Array) -> float:
    """Largest of equally spaced values, and of the parabola through it and its neighbours."""
    at = int(np.argmax(values))
    best: float = values[at]
    if 0 < at < len(values) - 1:
        before, after = values[at - 1], values[at + 1]
        bend = before - 2 * best + after
        if bend < 0:
            best -= (after - before) ** 2 / (8 * bend)
    return best
