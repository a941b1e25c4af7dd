"""The two round discs on an eccentric hub that carry the flexible bearing of a two-disk wave generator."""

from __future__ import annotations

import math

import numpy as np

from hdopt.drive.geometry import Drive
from hdopt.drive.profiles import TwoDisk, tip_radius_of_curvature
from hdopt.errors import HdoptError
from hdopt.geometry.carrier import MAJOR, Carrier
from hdopt.geometry.choices import Choices
from hdopt.geometry.colours import DARK_STEEL, LIGHT_STEEL, STEEL
from hdopt.geometry.contour import Circle
from hdopt.geometry.din471 import ring_of, smallest_ring
from hdopt.geometry.features import Bore, BrokenEdge
from hdopt.geometry.part import SHARP, Part, Prism, ProfiledPart
from hdopt.geometry.slide_features import Slot
from hdopt.geometry.undercut import AT_SHOULDER, IN_CORNER, SMALL, RingGroove, Undercut


class TwoDiscs(Carrier):
    """Two round discs side by side on an eccentric hub.

    Over the wrap angle Eq. (38) is a circular arc to first order in the deflection; the disc made here is the circle
    that shares the tip and the radius of curvature there, so the tip that decides kinematic error is met exactly.
    """

    def __init__(self, drive: Drive, choices: Choices, profile: TwoDisk) -> None:
        super().__init__(drive, choices)
        tip_radius = tip_radius_of_curvature(profile)
        self.offset = profile.semi_major - tip_radius
        wall_circle = Circle(tip_radius, self.offset)
        self.disc = wall_circle.inward(self.bearing_thickness)
        self.gap = self.take("disc_gap_mm", lambda: 0.2)
        self.disc_height = (self.width - self.gap) / 2
        self.require_room_for_edges(self.disc_height)
        self.clear_of_profile = arc_departure(profile)
        self.profiled_part = "disc_1"
        self.notes = (
            f"two discs of radius {self.disc.radius:.4f} mm, {self.offset:.4f} mm off the axis: the circle through the "
            "tip with the profile's curvature there; it lies up to "
            f"{self.clear_of_profile * 1e3:.2f} um outside Eq. (38), which is of first order in the deflection",
        )

    @property
    def room(self) -> float:
        return self.disc.least_radius

    def _journal(self, bore: Bore) -> float:
        inside = bore.reach + self.offset

        def rule() -> float:
            ring = smallest_ring(2 * (inside + 2 * self.wall), 2 * (inside + self.wall))
            return ring.shaft / 2 if ring is not None else math.ceil(2 * (inside + 2 * self.wall)) / 2

        radius = self.take("journal_radius_mm", rule)
        ring = ring_of(2 * radius)
        depth = IN_CORNER.depth if ring is None else ring.depth
        low, high = inside + self.wall + depth, self.disc.radius - self.wall
        if not low <= radius <= high:
            raise HdoptError(
                f"the eccentric hub's journals have a radius of {radius:.4g} mm; between bore and disc there is room "
                f"for {low:.4g} to {high:.4g} mm; change export.journal_radius_mm or give a smaller export.bore_mm"
            )
        return radius

    def parts(self, bore: Bore, shoulder: float, thickness: float, slot: Slot | None = None) -> tuple[Part, ...]:
        """The eccentric hub, with a `bore`, a flange of radius `shoulder` and `thickness` mm and a `slot` in its back
        where it slides; and the two discs on it."""
        journal = self._journal(bore)
        half, step = self.width / 2, -self.width / 2 - self.gap
        # Turned to a round size, to the next tenth of a mm.
        flange = Circle(math.ceil(10 * max(shoulder, journal + self.offset) - 1e-9) / 10)
        body = (Prism(flange, step - thickness, step, bottom_edge=self.chamfer()), *self._journals(journal, step))
        top = body[-1].top
        faces = ((top, 1),) if slot else ((step - thickness, -1), (top, 1))
        sliding = slot is not None
        hub = Part("eccentric_hub", DARK_STEEL, body, bore, self.countersink(bore), faces, slot, clearance_hole=sliding)
        hole = journal + self.take("journal_clearance_mm", lambda: 0.0)
        bottom_edge, top_edge = self.outer_edges()
        discs = tuple(
            ProfiledPart(
                name,
                colour,
                body=(Prism(circle, low, low + self.disc_height, *edges, inner=Circle(hole, circle.offset)),),
                contour=circle,
            )
            for name, colour, circle, low, edges in (
                ("disc_1", STEEL, self.disc, -half, (bottom_edge, SHARP)),
                ("disc_2", LIGHT_STEEL, Circle(self.disc.radius, -self.offset), self.gap / 2, (SHARP, top_edge)),
            )
        )
        return (hub, *discs)

    def _journals(self, radius: float, step: float) -> tuple[Prism, Prism]:
        """Both journals of this `radius` on a flange that ends at z = `step`, with the groove of the ring that holds
        the discs between itself and the flange."""
        half, edge, ring = self.width / 2, self.chamfer(), ring_of(2 * radius)
        top, groove = half, None
        if ring is not None:
            groove = RingGroove(half, ring.groove_width, ring.depth)
            top = half + ring.groove_width + ring.land
            edge = BrokenEdge.chamfer(min(edge.axial, ring.land / 2))
        else:
            self.notes += (
                f"DIN 471 has no retaining ring for journals of {2 * radius:g} mm: the discs are held along the axis "
                "by their fit alone; export.journal_radius_mm changes that",
            )
        foot, corner = self._undercuts()
        return (
            Prism(Circle(radius, self.offset), step, 0.0, foot=foot, head=corner),
            Prism(Circle(radius, -self.offset), 0.0, top, top_edge=edge, foot=corner, groove=groove),
        )

    def _undercuts(self) -> tuple[Undercut, Undercut]:
        """The undercuts at the flange and on both sides of the step between the journals: the largest that leave each
        disc a seat on at least `SEAT_SHARE` of its thickness. They may lie in the gaps beside the discs."""
        seat = -math.inf
        for foot, corner in ((AT_SHOULDER, IN_CORNER), (IN_CORNER, IN_CORNER), (SMALL, SMALL)):
            at_flange, at_step = max(0.0, foot.length - self.gap), max(0.0, corner.length - self.gap / 2)
            seat = self.disc_height - at_flange - at_step
            if seat >= SEAT_SHARE * self.disc_height and self.gap >= 1.5 * foot.rise:
                return foot, corner
        raise HdoptError(
            f"the undercuts of the eccentric hub leave {max(seat, 0.0):.4g} mm of the seat of a disc "
            f"{self.disc_height:.4g} mm thick, less than half; give a greater wave_generator.width_mm or "
            "export.disc_gap_mm"
        )

    def integral_parts(self) -> tuple[Part, ...]:
        bore = self.shaft_bore(MAJOR, self.room, "disc")
        thickness = self.take("hub_flange_thickness_mm", lambda: max(1.0, round(0.8 * self.width) / 2))
        return self.parts(bore, self._journal(bore) + self.offset + self.wall / 2, thickness)


SEAT_SHARE = 0.5
"""Least share of a disc's thickness that the undercuts leave it to sit on."""


def arc_departure(profile: TwoDisk) -> float:
    """How far the disc's circle lies outside the two-disk `profile` at most, mm."""
    radius = tip_radius_of_curvature(profile)
    offset = profile.semi_major - radius
    phi = np.linspace(0, math.pi / 2, 2001)
    circle = offset * np.cos(phi) + np.sqrt(radius**2 - (offset * np.sin(phi)) ** 2)
    return float(max(0.0, np.max(circle - profile.radius(phi))))
