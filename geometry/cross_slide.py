"""The cross-slide that frees a wave generator: slots, the blocks that run in them, and the discs that have them."""

from __future__ import annotations

import math

from hdopt.drive.geometry import Structure
from hdopt.errors import HdoptError, MissingValue
from hdopt.geometry.budget import FIT_SHARE
from hdopt.geometry.carrier import MAJOR, MINOR, Carrier
from hdopt.geometry.colours import BRONZE, GREEN
from hdopt.geometry.contour import Circle
from hdopt.geometry.features import PlainBore
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.slide_features import SlideEdges, Slot, Tongue


class CrossSlide:
    """Sizes of the slots and of the blocks that run in them."""

    def __init__(self, carrier: Carrier, structure: Structure) -> None:
        clearances, take = carrier.drive.clearances, carrier.take
        clearance, radius = clearances.cross_slide, clearances.disc_radius
        widths = {n: getattr(clearances, f"slot_{n}_width") for n in structure.slots}
        needed = {
            "clearances.cross_slide_clearance_mm": clearance,
            "clearances.disc_radius_mm": radius,
            **{f"clearances.slot_{n}_width_mm": width for n, width in widths.items()},
        }
        missing = [key for key, value in needed.items() if value is None]
        if missing or clearance is None or radius is None:
            raise MissingValue(f"the {structure.value} structure", *missing)
        self.carrier, self.structure = carrier, structure
        self.clearance, self.radius, self.widths = clearance, radius, widths
        self.depth = take("slot_depth_mm", lambda: max(round(2 * carrier.width / 3) / 2, round(carrier.width / 3, 1)))
        self.gap = take("axial_gap_mm", self._usual_gap)
        self.travel = take("cross_slide_travel_mm", lambda: 0.5)
        self.thickness = take("disc_thickness_mm", lambda: self.depth + 2 * carrier.wall)
        self._check()

    def _usual_gap(self) -> float:
        """0.1 mm, or less where the slides would lean by more than their part of the tilt that is allowed."""
        if self.carrier.bounds.tilt is None:
            return 0.1
        lean = FIT_SHARE * self.carrier.bounds.tilt / (1 + len(self.structure.slots))
        return min(0.1, math.floor(1e3 * 2 * self.radius * lean) / 1e3)

    def _check(self) -> None:
        wall = self.carrier.wall
        for number, width in self.widths.items():
            if width - self.clearance < wall:
                raise HdoptError(
                    f"clearances.cross_slide_clearance_mm is {self.clearance:g} mm in slot {number} of {width:g} mm: "
                    f"the clearance closes the slot: a block of {width - self.clearance:.4g} mm is left, {wall:g} "
                    f"mm are needed (export.minimum_wall_mm); give less clearance or a wider slot_{number}_width_mm"
                )
        if self.gap >= self.depth:
            raise HdoptError(
                f"export.axial_gap_mm is {self.gap:g} mm, the slots are {self.depth:g} mm deep: the blocks do not "
                "reach into them; give a smaller gap"
            )
        if self.depth + wall > self.thickness:
            raise HdoptError(
                f"export.slot_depth_mm is {self.depth:g} mm in a disc {self.thickness:g} mm thick; {wall:g} mm have to "
                "be left; give a thicker disc (export.disc_thickness_mm) or a shallower slot"
            )

    def _direction(self, number: int) -> float:
        return MAJOR if number == 1 else MINOR

    def _edges(self, number: int) -> SlideEdges:
        return SlideEdges.of(self.widths[number], self.depth)

    def _block(self, number: int, bottom: float) -> Tongue:
        """The block that runs in a slot, on a face at z = `bottom`."""
        width = self.widths[number] - self.clearance
        return Tongue(self.radius, width, self._direction(number), bottom, bottom + self.depth, self._edges(number))

    def carrier_slot(self, room: float, thickness: float) -> Slot:
        """The slot in the cam's back, closed at both ends: the last slot of the chain."""
        number, wall = self.structure.slots[-1], self.carrier.wall
        width = self.widths[number]
        straight = math.sqrt(self.radius**2 - width**2 / 4) + self.travel
        slot = Slot(width, self.depth, straight, self._direction(number), self.radius, True, self._edges(number))
        if slot.mouth_reach + wall > room:
            raise HdoptError(
                f"slot {number} for a disc of {2 * self.radius:g} mm reaches {slot.mouth_reach:.4g} mm from the axis; "
                f"the cam allows {room - wall:.4g} mm; give a smaller clearances.disc_radius_mm"
            )
        if self.depth + wall > thickness:
            raise HdoptError(
                f"export.slot_depth_mm is {self.depth:g} mm in a cam {thickness:g} mm wide; {wall:g} mm have to be left"
            )
        return slot

    def floating_disc(self, back: float, bore: PlainBore) -> Part:
        """Slot 1 in its back for the input disc, block 2 on its front for the cam."""
        self._require_disc_around(bore)
        top = back - self.gap
        body = (
            Prism(Circle(self.radius), top - self.thickness, top),
            self._block(2, top),
        )
        slot = Slot(self.widths[1], self.depth, self.radius, MAJOR, self.radius, False, self._edges(1))
        return Part("floating_disc", GREEN, body, bore, slot=slot, clearance_hole=True)

    def input_disc(self, back: float) -> Part:
        """The disc on the shaft; its keyway lies across the block, which it would otherwise cut in two."""
        number = self.structure.slots[0]
        direction = self._direction(number)
        bore = self.carrier.shaft_bore(direction + math.pi / 2, self.radius, "input disc")
        top = back - self.gap
        edge = self.carrier.chamfer()
        body = (
            Prism(Circle(self.radius), top - self.thickness, top, bottom_edge=edge),
            self._block(number, top),
        )
        face = ((body[0].bottom, -1),)
        return Part("input_disc", BRONZE, body, bore, self.carrier.countersink(bore), face)

    def _require_disc_around(self, bore: PlainBore) -> None:
        if bore.radius + self.carrier.wall > self.radius:
            raise HdoptError(
                f"export.bore_mm is {self.carrier.shaft_diameter():g} mm; past it the floating disc needs a hole of "
                f"{2 * bore.radius:g} mm, larger than its {2 * self.radius:g} mm allow; give a smaller bore"
            )
