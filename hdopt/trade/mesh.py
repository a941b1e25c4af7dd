"""How far from the major axis the flanks can carry: what a small pressure angle costs.

A flexspline tooth leaves its space along a path that the deflection prescribes, not the flank: it withdraws by
d = w(0) - w(psi) while it shifts sideways by t = m psi - integral of w. (With w = kappa m cos 2 psi and
theta = 2 psi this is the rack approximation that strain-wave tooth forms are designed with, x = m (theta - kappa sin
theta)/2, y = kappa m cos theta: Musser, US patent 2,906,143, 1959; Ishikawa, US patent 4,823,638, 1989.) A straight
flank of pressure angle alpha follows only while t <= d tan(alpha) + half the backlash. Beyond that angle the tip must
be relieved, and a relieved tooth carries nothing. Where w0 exceeds m, the tooth first moves back, t < 0, and the
trailing flank needs room: that limits the deflection, the more the smaller the pressure angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hdopt.contact import tip_overlap
from hdopt.drive import DriveGeometry
from hdopt.errors import HdoptError
from hdopt.profiles import WaveGeneratorProfile

Array = NDArray[np.float64]

GRID = np.linspace(0.0, math.pi / 2, 181)
NEWTON_STEPS = 8
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
_UNIT_NODES, _UNIT_WEIGHTS = (1 + _NODES) / 2, _WEIGHTS / 2


@dataclass(frozen=True)
class Mesh:
    """The mesh of one flexspline on one profile; everything here is independent of pressure angle and width."""

    geometry: DriveGeometry
    profile: WaveGeneratorProfile

    def deflection(self, psi: Array) -> Array:
        """w(psi), mm."""
        return self.profile.radius(psi) - self.geometry.flexspline_inner_radius

    @cached_property
    def _sampled(self) -> tuple[Array, Array]:
        """Withdrawal d and shift t on `GRID`, mm. The corrected trapezoid rule keeps 1e-13 of the radius."""
        w, slope, step = self.deflection(GRID), self.profile.radius(GRID, 1), GRID[1]
        pieces = step / 2 * (w[1:] + w[:-1]) + step**2 / 12 * (slope[:-1] - slope[1:])
        return w[0] - w, self.geometry.module * GRID - np.concatenate([[0.0], np.cumsum(pieces)])

    def path(self, psi: float) -> tuple[float, float]:
        """Withdrawal d and sideways shift t of a flexspline tooth at `psi` rad from the major axis, mm."""
        w = self.deflection(psi * _UNIT_NODES)
        start, here = self.deflection(np.array([0.0, psi]))
        return float(start - here), float(self.geometry.module * psi - psi * (_UNIT_WEIGHTS @ w))

    @cached_property
    def contact_angle(self) -> float:
        """Half angle over which the tips overlap, rad; the same as `hdopt.contact.contact_angle`."""
        overlap = tip_overlap(self.geometry, self.profile, GRID)
        if overlap[0] <= 0 or overlap[-1] >= 0:
            from hdopt.contact import contact_angle

            return contact_angle(self.geometry, self.profile)
        first = int(np.argmax(overlap < 0))
        psi = GRID[first] - GRID[1] * overlap[first] / (overlap[first] - overlap[first - 1])
        for _ in range(NEWTON_STEPS):
            value = float(tip_overlap(self.geometry, self.profile, psi))
            change = value / float(self.profile.radius(psi, 1))
            psi -= change
            if abs(change) < 1e-14:
                break
        return float(psi)

    def free_flank_angle(self, pressure_angle: float, backlash: float) -> float:
        """Largest angle psi (rad) up to which the leading straight flank runs free: t <= d tan(alpha) + backlash/2.

        pi/2 where it always does. Rack approximation: the tooth's own rotation and the curvature of the pitch lines
        are left out, which is right to the order of the module over the radius.
        """
        tan_alpha = math.tan(pressure_angle)
        withdrawal, shift = self._sampled
        room = backlash / 2 + withdrawal * tan_alpha - shift
        blocked = np.flatnonzero(room < 0)
        if len(blocked) == 0:
            return math.pi / 2
        first = int(blocked[0])
        if first == 0:
            raise HdoptError(f"the backlash is {backlash:g} mm; it must not be negative")
        low, high = GRID[first - 1], GRID[first]
        psi = high - (high - low) * room[first] / (room[first] - room[first - 1])
        for _ in range(NEWTON_STEPS):
            d, t = self.path(psi)
            slope = -float(self.profile.radius(psi, 1)) * tan_alpha
            slope -= self.geometry.module - float(self.deflection(np.asarray(psi)))
            if slope == 0:
                break
            change = (backlash / 2 + d * tan_alpha - t) / slope
            psi = min(max(psi - change, low), high)
            if abs(change) < 1e-14:
                break
        return float(psi)

    def trailing_flank_room(self, pressure_angle: float, backlash: float) -> float:
        """Least room of the trailing flank on a tooth's way out, mm: the least of backlash/2 + d tan(alpha) + t.

        Below zero the flanks jam near the major axis. It is half the backlash where w0 does not exceed the module.
        """
        tan_alpha = math.tan(pressure_angle)
        withdrawal, shift = self._sampled
        room = withdrawal * tan_alpha + shift
        lowest = int(np.argmin(room))
        least = room[lowest]
        if 0 < lowest < len(room) - 1:
            before, after = room[lowest - 1], room[lowest + 1]
            least -= (after - before) ** 2 / (8 * (after - 2 * least + before))
        return float(backlash / 2 + least)

    def carrying_angle(self, pressure_angle: float, backlash: float) -> float:
        """Half angle over which flanks can carry, rad: overlapped tips whose flanks run free."""
        return min(self.contact_angle, self.free_flank_angle(pressure_angle, backlash))

    def summed_depth(self, angle: float) -> float:
        """Depth of engagement summed over the teeth up to `angle` on the approaching flank of both zones, mm."""
        overlap = tip_overlap(self.geometry, self.profile, angle * _UNIT_NODES)
        return 2 * self.geometry.circular_spline_teeth / (2 * math.pi) * angle * float(_UNIT_WEIGHTS @ overlap)

    def flank_pressure(self, torque: float, face_width: float, angle: float) -> float:
        """Mean pressure on the flanks up to `angle`, N/mm^2: p = 2 T/(d b h z), `hdopt.contact.mean_flank_pressure`
        (Shen and Ye 1985), with h z summed over the teeth that can carry instead of all whose tips overlap."""
        pitch_diameter = self.geometry.module * self.geometry.flexspline_teeth
        return 2 * torque / (pitch_diameter * face_width * self.summed_depth(angle))
