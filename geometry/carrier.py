"""What carries the flexible bearing, whatever its shape: the bore for the shaft, edges, walls, and the checks of
room."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from functools import cached_property

from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError, MissingValue
from hdopt.geometry.choices import Choices
from hdopt.geometry.din6885 import SMALLEST_BORE, key_for_bore
from hdopt.geometry.features import Bore, BrokenEdge, DBore, KeywayBore, PlainBore
from hdopt.geometry.part import SHARP, Part

MAJOR, MINOR = 0.0, math.pi / 2
"""Directions along which a slot may run, clockwise from the major axis."""

COMMON_BORES = (3, 4, 5, 6, 8, 10, 12, 14, 16, 18, 19, 20, 22, 24, 25, 28, 30, 32, 35, 38, 40, 42, 45, 48, 50, 55, 60)
"""Shaft diameters that motors and catalogues use, mm."""


class Carrier(ABC):
    """What all carriers of the flexible bearing share: the study's numbers, the bore, and the checks of room."""

    notes: tuple[str, ...] = ()
    clear_of_profile = 0.0
    profiled_part = "cam"

    def __init__(self, drive: Drive, choices: Choices) -> None:
        generator = drive.wave_generator
        if generator.bearing_thickness is None:
            raise MissingValue("the cam's outline", "wave_generator.bearing_thickness_mm")
        self.drive, self.take, self.options, self.bounds = drive, choices.take, choices.options, choices.bounds
        self.width = generator.width
        self.bearing_thickness = generator.bearing_thickness

    @cached_property
    def wall(self) -> float:
        """Least wall left anywhere, mm."""
        return self.take("minimum_wall_mm", lambda: round(min(2.0, 0.08 * self.room), 2))

    def chamfer(self) -> BrokenEdge:
        """The 45 degree chamfer of outer edges."""
        return BrokenEdge.chamfer(self.take("chamfer_mm", lambda: round(min(0.3, 0.04 * self.width), 2)))

    def outer_edges(self) -> tuple[BrokenEdge, BrokenEdge]:
        """Chamfer at the input end, lead-in for the bearing at the other."""
        length = self.take("lead_in_length_mm", lambda: round(min(1.0, 0.12 * self.width), 2))
        if not length:
            return self.chamfer(), SHARP
        angle = math.radians(self.take("lead_in_angle_deg", lambda: 15.0))
        return self.chamfer(), BrokenEdge.lead_in(length, angle)

    def require_room_for_edges(self, height: float) -> None:
        """Refuse edges that leave nothing of a rim `height` mm wide."""
        chamfer, lead_in = self.outer_edges()
        if chamfer.axial + lead_in.axial >= height:
            raise HdoptError(
                f"chamfer ({chamfer.axial:g} mm) and lead-in ({lead_in.axial:g} mm) leave nothing of a rim "
                f"{height:.4g} mm wide; give smaller export.chamfer_mm or export.lead_in_length_mm"
            )

    def shaft_bore(self, direction: float, room: float, inside: str) -> Bore:
        """The bore that takes the shaft, with at least the least wall left within radius `room` of `inside`."""
        diameter = self.shaft_diameter()
        radius = diameter / 2
        if radius + self.wall > room:
            raise HdoptError(
                f"export.bore_mm is {diameter:g} mm; the bore is larger than the {inside} allows: it may have at most "
                f"{2 * (room - self.wall):.4g} mm, with a wall of {self.wall:g} mm (export.minimum_wall_mm)"
            )
        mount = self.take("mount", lambda: "keyway" if diameter >= SMALLEST_BORE else "d_bore")
        if mount == "plain":
            return PlainBore(radius)
        if mount == "d_bore":
            flat = self.take("d_flat_mm", lambda: round(0.8 * radius, 2))
            if not flat < radius:
                raise HdoptError(
                    f"export.d_flat_mm is {flat:g} mm; the flat of a {diameter:g} mm bore lies less than "
                    f"{radius:g} mm from the axis"
                )
            return DBore(radius, flat, direction)
        bore = KeywayBore(radius, key_for_bore(diameter), direction)
        if bore.reach + self.wall > room:
            raise HdoptError(
                f"the keyway ({bore.key.name}, {bore.key.hub_depth:g} mm deep) of a {diameter:g} mm bore goes through "
                f"the wall of the {inside}: it reaches {bore.reach:.4g} mm from the axis, the {inside} ends at "
                f"{room:.4g} mm and {self.wall:g} mm of wall are to be left (export.minimum_wall_mm); "
                'give a smaller export.bore_mm, or export.mount = "d_bore" or "plain"'
            )
        return bore

    def shaft_diameter(self) -> float:
        """Diameter of the bore for the shaft, mm."""
        return self.take("bore_mm", self._common_bore)

    def _common_bore(self) -> float:
        return float(min(COMMON_BORES, key=lambda size: abs(size - self.room / 2)))

    @property
    @abstractmethod
    def room(self) -> float:
        """Radius of the largest circle about the axis inside the carrier, mm."""

    @abstractmethod
    def integral_parts(self) -> tuple[Part, ...]:
        """The parts of a carrier that is fixed to the shaft."""

    def countersink(self, bore: Bore) -> float:
        """The bore's countersink; a bore with a flat has none, for a cone cuts the flat in a curve no edge follows."""
        if isinstance(bore, DBore):
            if self.options.bore_chamfer_mm:
                raise HdoptError(
                    f"export.bore_chamfer_mm is {self.options.bore_chamfer_mm:g} mm, but a D-bore is not countersunk: "
                    "its edges are broken by hand (ISO 13715); leave the key out"
                )
            return 0.0
        rule = min(0.5, 0.05 * self.shaft_diameter(), 0.1 * self.width)
        return self.take("bore_chamfer_mm", lambda: round(rule, 2))

    def clearance_bore(self) -> PlainBore:
        """The hole in parts that slide: past the shaft's end with the slide's travel all round."""
        return PlainBore(self.shaft_diameter() / 2 + self.take("cross_slide_travel_mm", lambda: 0.5))
