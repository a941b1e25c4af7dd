"""The plug cam that carries the flexible bearing, and the flanged hub that it is screwed to."""

from __future__ import annotations

import math

from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError
from hdopt.geometry.carrier import MAJOR, Carrier
from hdopt.geometry.choices import Choices
from hdopt.geometry.colours import DARK_STEEL, STEEL
from hdopt.geometry.contour import Circle, ParallelCurve
from hdopt.geometry.features import BoltCircle, Bore, PlainBore
from hdopt.geometry.part import Part, Prism, ProfiledPart
from hdopt.geometry.screws import flange_for, least_engagement, require_engagement
from hdopt.geometry.slide_features import Slot
from hdopt.geometry.threads import THREAD_FOR_RADIUS, THREADS
from hdopt.geometry.undercut import AT_SHOULDER, IN_CORNER, SMALL, Undercut


class Cam(Carrier):
    """A plug cam: the profile's parallel curve, inward by the bearing's thickness."""

    def __init__(self, drive: Drive, choices: Choices) -> None:
        super().__init__(drive, choices)
        self.contour = ParallelCurve(drive.wave_generator.profile, self.bearing_thickness)
        self.require_room_for_edges(self.width)
        self.back = -self.width / 2
        if self.bearing_thickness > drive.wave_generator.profile.semi_minor - self.wall:
            raise HdoptError(f"the bearing ({self.bearing_thickness:g} mm thick) leaves no cam")

    @property
    def room(self) -> float:
        return self.contour.least_radius

    def parts(self, bore: Bore, bolts: BoltCircle | None = None, slot: Slot | None = None) -> tuple[Part, ...]:
        """The cam alone, with a `bore`, and with `bolts` to a hub or a `slot` in its back where it slides."""
        bottom_edge, top_edge = self.outer_edges()
        half = self.width / 2
        faces = ((half, 1),) if slot else ((-half, -1), (half, 1))
        body = Prism(self.contour, -half, half, bottom_edge, top_edge)
        return (
            ProfiledPart(
                "cam",
                STEEL,
                bore,
                self.countersink(bore),
                faces,
                slot,
                bolts,
                body=(body,),
                contour=self.contour,
                clearance_hole=slot is not None,
            ),
        )

    def integral_parts(self) -> tuple[Part, ...]:
        # The keyway lies on the major axis, where the wall is thickest, and so marks that axis.
        bore = self.shaft_bore(MAJOR, self.room, "cam")
        if not self.take("hub", lambda: self._hub_fits(self._seat_for(bore))):
            return self.parts(bore, self._bolts(bore.reach, THREADS[self._thread()][0], 0))
        seat = self.take("hub_seat_mm", lambda: 2 * self._seat_for(bore)) / 2
        bore = self.shaft_bore(MAJOR, seat, "hub")
        clearance, tap = THREADS[self._thread()]
        self._require_hub_room(seat)
        bolts = self._bolts(seat, clearance, 6)
        flange = seat + self.wall if bolts is None else bolts.radius + bolts.hole / 2 + self.wall
        thickness = self._flange_thickness(bolts)
        half, edge = self.width / 2, self.chamfer()
        body = (
            Prism(Circle(flange), -half - thickness, -half, bottom_edge=edge),
            Prism(Circle(seat), -half, half, top_edge=edge, foot=self._undercut(seat)),
        )
        tapped = BoltCircle(bolts.count, tap, bolts.radius) if bolts else None
        faces = ((-half - thickness, -1), (half, 1))
        hub = Part("hub", DARK_STEEL, body, bore, self.countersink(bore), faces, bolts=tapped)
        return (hub, *self.parts(PlainBore(seat), bolts))

    def _flange_thickness(self, bolts: BoltCircle | None) -> float:
        """Thickness of the hub's flange, mm, whose thread takes the screws of `bolts`."""
        usual, thread, material = max(1.0, round(0.8 * self.width) / 2), self._thread(), self.options.hub_material
        least = least_engagement(thread, material)

        def rule() -> float:
            return usual if bolts is None else flange_for(thread, self.width, least, usual)

        thickness = self.take("hub_flange_thickness_mm", rule)
        if bolts is not None:
            require_engagement(thread, self.width, thickness, material)
        return thickness

    def _seat_for(self, bore: Bore) -> float:
        """Radius of the hub's seat that leaves a wall around the bore, a whole number of mm."""
        return float(math.ceil(bore.reach + self.wall + AT_SHOULDER.depth))

    def _undercut(self, seat: float) -> Undercut:
        """The undercut of a hub's `seat` (radius, mm) at its flange, over which the cam's countersink has to pass: no
        longer than a third of the seat."""
        clear = self.countersink(PlainBore(seat)) >= 1.5 * AT_SHOULDER.rise
        sizes = (AT_SHOULDER, IN_CORNER) if clear else (IN_CORNER,)
        return next((size for size in sizes if size.length <= self.width / 3), SMALL)

    def _hub_fits(self, seat: float) -> bool:
        """Whether there is room between seat and rim for the usual circle of bolts."""
        hole = THREADS[self._thread()][0]
        return seat + max(1.7 * hole, hole + self.wall) + self.wall <= self.room

    def _require_hub_room(self, seat: float) -> None:
        if seat + self.wall > self.room:
            raise HdoptError(
                f"the hub's seat of {2 * seat:.4g} mm is larger than the cam allows: {2 * (self.room - self.wall):.4g} "
                f"mm, with a wall of {self.wall:g} mm; give a smaller export.bore_mm, or export.hub = false to bore "
                "the cam itself"
            )

    def _thread(self) -> str:
        return self.take(
            "bolt_thread", lambda: next(thread for limit, thread in THREAD_FOR_RADIUS if self.room < limit)
        )

    def _bolts(self, inside: float, hole: float, usual_count: int) -> BoltCircle | None:
        count = self.take("bolt_count", lambda: usual_count)
        if not count:
            return None
        radius = self.take("bolt_circle_mm", lambda: round(2 * (inside + max(1.2 * hole, hole / 2 + self.wall)), 1)) / 2
        low, high = inside + hole / 2 + self.wall, self.room - hole / 2 - self.wall
        if not low <= radius <= high:
            raise HdoptError(
                f"a bolt circle of {2 * radius:.4g} mm with {hole:g} mm holes does not fit: between the bore or seat "
                f"and the rim it may have {2 * low:.4g} to {2 * high:.4g} mm; change export.bore_mm, "
                "export.bolt_circle_mm, export.bolt_thread or export.bolt_count"
            )
        if 2 * radius * math.sin(math.pi / count) < 1.5 * hole and count > 1:
            raise HdoptError(f"{count} holes of {hole:g} mm run into each other; give fewer in export.bolt_count")
        return BoltCircle(count, hole, radius)
