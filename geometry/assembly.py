"""From a drive to the parts of its wave generator: which there are, how large, and where each lies.

The cam lies between z = -b/2 and +b/2, as in the model of kinematic error; the input shaft comes from below (-z). The
parts stand in their nominal place, all slides in the middle. Sizes that nobody gave follow a rule, and every rule that
was used is listed in `WaveGeneratorModel.assumptions`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

from hdopt.drive.geometry import Drive, Structure
from hdopt.drive.profiles import TwoDisk, tip_radius_of_curvature
from hdopt.errors import HdoptError, MissingValue
from hdopt.geometry.budget import FIT_SHARE, Bounds, Plan, plan
from hdopt.geometry.context import context_parts
from hdopt.geometry.contour import Circle, Contour, ParallelCurve
from hdopt.geometry.din6885 import SMALLEST_BORE, key_for_bore
from hdopt.geometry.features import BoltCircle, Bore, BrokenEdge, DBore, KeywayBore, PlainBore, Slot
from hdopt.geometry.options import RULES, ExportOptions
from hdopt.geometry.part import SHARP, Colour, Part, Prism, Tongue
from hdopt.geometry.walls import require_walls

STEEL: Colour = (0.36, 0.52, 0.68, 1.0)
DARK_STEEL: Colour = (0.30, 0.33, 0.38, 1.0)
BRONZE: Colour = (0.80, 0.58, 0.30, 1.0)
GREEN: Colour = (0.36, 0.62, 0.48, 1.0)
LIGHT_STEEL: Colour = (0.55, 0.67, 0.78, 1.0)

MAJOR, MINOR = 0.0, math.pi / 2
"""Directions along which a slot may run, clockwise from the major axis."""

COMMON_BORES = (3, 4, 5, 6, 8, 10, 12, 14, 16, 18, 19, 20, 22, 24, 25, 28, 30, 32, 35, 38, 40, 42, 45, 48, 50, 55, 60)
"""Shaft diameters that motors and catalogues use, mm."""

THREADS = {"M2": (2.4, 1.6), "M3": (3.4, 2.5), "M4": (4.5, 3.3), "M5": (5.5, 4.2), "M6": (6.6, 5.0), "M8": (9.0, 6.8)}
"""Coarse thread -> clearance hole (ISO 273, medium) and tap drill (ISO 2306), mm."""

THREAD_FOR_RADIUS = ((15.0, "M2"), (35.0, "M3"), (50.0, "M4"), (70.0, "M5"), (100.0, "M6"), (math.inf, "M8"))
"""Thread taken for a cam up to this radius, mm, where none is given."""


CAM_STEP_DEG, WHEEL_RADIUS = 0.5, 200.0
"""Step of the cam's table and radius of the grinding wheel (mm) where nobody gives them; the files name them."""

T = TypeVar("T")


@dataclass(frozen=True)
class Assumption:
    """A value that the study does not give."""

    key: str
    value: Any
    reason: str

    def __str__(self) -> str:
        return f"{self.key} = {self.value} ({self.reason})"


@dataclass(frozen=True)
class WaveGeneratorModel:
    """The parts in their places, lowest first, and what had to be assumed."""

    structure: Structure
    parts: tuple[Part, ...]
    assumptions: tuple[Assumption, ...]
    profile_zone: float
    """Full width of the profile's tolerance zone, mm."""
    plan: Plan
    """Its fits, and the budgets of eccentricity and tilt that they keep."""
    notes: tuple[str, ...] = ()
    cam_resolution_deg: float = CAM_STEP_DEG
    """Step of the cam's table."""
    wheel_radius: float = WHEEL_RADIUS
    """Of the grinding wheel, mm."""

    def part(self, name: str) -> Part:
        return next(part for part in self.parts if part.name == name)

    @property
    def profiled(self) -> tuple[Part, ...]:
        """The parts that carry the flexible bearing: the cam, or the two discs."""
        return tuple(part for part in self.parts if part.contour is not None and not part.context)


@dataclass
class Choices:
    """Reads the options and remembers which values were not given."""

    options: ExportOptions
    bounds: Bounds
    assumptions: list[Assumption] = field(default_factory=list)

    def take(self, key: str, rule: Callable[[], T]) -> T:
        """The value of an option, or what `rule` makes of it where nobody gave one."""
        given: T | None = getattr(self.options, key)
        if given is not None:
            return given
        name = f"export.{key}"
        if (known := next((a for a in self.assumptions if a.key == name), None)) is not None:
            return known.value  # type: ignore[no-any-return]  # assumptions are of any type
        value = rule()
        self.assumptions.append(Assumption(name, value, RULES[key]))
        return value


def wave_generator_model(
    drive: Drive, options: ExportOptions | None = None, bounds: Bounds | None = None
) -> WaveGeneratorModel:
    """All parts of a drive's wave generator; `HdoptError` where the numbers leave no part to make.

    `bounds` limit its eccentricity (mm) and tilt (rad); the fits follow from them.
    """
    bounds = bounds or Bounds()
    choices = Choices(options or ExportOptions(), bounds)
    carrier = _TwoDiscs(drive, choices) if isinstance(drive.wave_generator.profile, TwoDisk) else _Cam(drive, choices)
    structure = drive.wave_generator.structure
    parts = _integral(carrier) if structure is Structure.INTEGRAL else _sliding(carrier, structure)
    require_walls(parts, carrier.wall)
    given = {key: getattr(choices.options, key) for key in ("shaft_fit", "seat_fit")}
    gap = choices.take("axial_gap_mm", lambda: 0.0) if structure.slots else 0.0
    fits = plan(structure, parts, bounds, drive.clearances, given, gap)
    located = fits.zone(carrier.profiled_part, "wg_eccentricity")
    zone = choices.take("profile_tolerance_mm", lambda: min(0.010, located or math.inf))
    if choices.options.context:
        share = choices.take("race_share", lambda: 0.25)
        parts += context_parts(drive, carrier.bearing_thickness, share, carrier.clear_of_profile)
    step, wheel = choices.options.cam_resolution_deg or CAM_STEP_DEG, choices.options.wheel_radius_mm or WHEEL_RADIUS
    return WaveGeneratorModel(structure, parts, tuple(choices.assumptions), zone, fits, carrier.notes, step, wheel)


class _Carrier:
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
        return BrokenEdge.chamfer(self.take("chamfer_mm", lambda: round(min(0.3, 0.04 * self.width), 2)))

    def outer_edges(self) -> tuple[BrokenEdge, BrokenEdge]:
        """Chamfer at the input end, lead-in for the bearing at the other."""
        length = self.take("lead_in_length_mm", lambda: round(min(1.0, 0.12 * self.width), 2))
        if not length:
            return self.chamfer(), SHARP
        angle = math.radians(self.take("lead_in_angle_deg", lambda: 15.0))
        return self.chamfer(), BrokenEdge.lead_in(length, angle)

    def require_room_for_edges(self, height: float) -> None:
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
        return self.take("bore_mm", self._common_bore)

    def _common_bore(self) -> float:
        return float(min(COMMON_BORES, key=lambda size: abs(size - self.room / 2)))

    @property
    def room(self) -> float:
        """Radius of the largest circle about the axis inside the carrier."""
        raise NotImplementedError

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


class _Cam(_Carrier):
    """A plug cam: the profile's parallel curve, inward by the bearing's thickness."""

    def __init__(self, drive: Drive, choices: Choices) -> None:
        super().__init__(drive, choices)
        self.contour: Contour = ParallelCurve(drive.wave_generator.profile, self.bearing_thickness)
        self.require_room_for_edges(self.width)
        self.back = -self.width / 2
        if self.bearing_thickness > drive.wave_generator.profile.semi_minor - self.wall:
            raise HdoptError(f"the bearing ({self.bearing_thickness:g} mm thick) leaves no cam")

    @property
    def room(self) -> float:
        return self.contour.least_radius

    def parts(self, bore: Bore, bolts: BoltCircle | None = None, slot: Slot | None = None) -> tuple[Part, ...]:
        bottom_edge, top_edge = self.outer_edges()
        half = self.width / 2
        faces = ((half, 1),) if slot else ((-half, -1), (half, 1))
        body = Prism(self.contour, -half, half, bottom_edge, top_edge)
        sliding = slot is not None
        return (
            Part("cam", STEEL, (body,), bore, self.countersink(bore), faces, slot, bolts, self.contour, False, sliding),
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
        thickness = self.take("hub_flange_thickness_mm", lambda: max(1.0, round(0.8 * self.width) / 2))
        half, edge = self.width / 2, self.chamfer()
        body = (
            Prism(Circle(flange), -half - thickness, -half, bottom_edge=edge),
            Prism(Circle(seat), -half, half, top_edge=edge),
        )
        tapped = BoltCircle(bolts.count, tap, bolts.radius) if bolts else None
        faces = ((-half - thickness, -1), (half, 1))
        hub = Part("hub", DARK_STEEL, body, bore, self.countersink(bore), faces, bolts=tapped)
        return (hub, *self.parts(PlainBore(seat), bolts))

    def _seat_for(self, bore: Bore) -> float:
        """Radius of the hub's seat that leaves a wall around the bore, a whole number of mm."""
        return float(math.ceil(bore.reach + self.wall))

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


class _TwoDiscs(_Carrier):
    """Two round discs side by side on an eccentric hub.

    Over the wrap angle Eq. (38) is a circular arc to first order in the deflection; the disc made here is the circle
    that shares the tip and the radius of curvature there, so the tip that decides kinematic error is met exactly.
    """

    def __init__(self, drive: Drive, choices: Choices) -> None:
        super().__init__(drive, choices)
        profile = drive.wave_generator.profile
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
        rule = lambda: math.ceil(2 * (bore.reach + self.offset + 2 * self.wall)) / 2  # noqa: E731
        radius = self.take("journal_radius_mm", rule)
        low, high = bore.reach + self.offset + self.wall, self.disc.radius - self.wall
        if not low <= radius <= high:
            raise HdoptError(
                f"the eccentric hub's journals have a radius of {radius:.4g} mm; between bore and disc there is room "
                f"for {low:.4g} to {high:.4g} mm; change export.journal_radius_mm or give a smaller export.bore_mm"
            )
        return radius

    def parts(self, bore: Bore, shoulder: float, thickness: float, slot: Slot | None = None) -> tuple[Part, ...]:
        journal = self._journal(bore)
        half, chamfer = self.width / 2, self.chamfer()
        step = -half - self.gap
        body = (
            Prism(Circle(max(shoulder, journal + self.offset)), step - thickness, step, bottom_edge=chamfer),
            Prism(Circle(journal, self.offset), step, 0.0),
            Prism(Circle(journal, -self.offset), 0.0, half, top_edge=chamfer),
        )
        faces = ((half, 1),) if slot else ((step - thickness, -1), (half, 1))
        sliding = slot is not None
        hub = Part("eccentric_hub", DARK_STEEL, body, bore, self.countersink(bore), faces, slot, clearance_hole=sliding)
        hole = journal + self.take("journal_clearance_mm", lambda: 0.0)
        bottom_edge, top_edge = self.outer_edges()
        discs = tuple(
            Part(
                name,
                colour,
                (Prism(circle, low, low + self.disc_height, *edges, inner=Circle(hole, circle.offset)),),
                contour=circle,
            )
            for name, colour, circle, low, edges in (
                ("disc_1", STEEL, self.disc, -half, (bottom_edge, SHARP)),
                ("disc_2", LIGHT_STEEL, Circle(self.disc.radius, -self.offset), self.gap / 2, (SHARP, top_edge)),
            )
        )
        return (hub, *discs)

    def integral_parts(self) -> tuple[Part, ...]:
        bore = self.shaft_bore(MAJOR, self.room, "disc")
        thickness = self.take("hub_flange_thickness_mm", lambda: max(1.0, round(0.8 * self.width) / 2))
        return self.parts(bore, self._journal(bore) + self.offset + self.wall / 2, thickness)


def arc_departure(profile: TwoDisk) -> float:
    """How far the disc's circle lies outside the two-disk profile at most, mm."""
    import numpy as np

    radius = tip_radius_of_curvature(profile)
    offset = profile.semi_major - radius
    phi = np.linspace(0, math.pi / 2, 2001)
    circle = offset * np.cos(phi) + np.sqrt(radius**2 - (offset * np.sin(phi)) ** 2)
    return float(max(0.0, np.max(circle - profile.radius(phi))))


def _integral(carrier: _Cam | _TwoDiscs) -> tuple[Part, ...]:
    return carrier.integral_parts()


def _sliding(carrier: _Cam | _TwoDiscs, structure: Structure) -> tuple[Part, ...]:
    """Input disc, the floating disc where both directions slide, and the carrier with its slot.

    Slot 1 runs along the major axis and slot 2 along the minor one, as their lever arms in Jia 2021, Eq. (33) say; a
    one-way wave generator has the slot of the direction it frees, between input disc and cam.
    """
    if carrier.options.bolt_count:
        raise HdoptError(
            f"export.bolt_count is {carrier.options.bolt_count}, but the cam of the {structure.value} structure "
            "slides; remove it, or choose the integral structure"
        )
    slide = _CrossSlide(carrier, structure)
    bore = carrier.clearance_bore()
    if isinstance(carrier, _Cam):
        slot = slide.carrier_slot(carrier.room, carrier.width)
        back, driven = carrier.back, carrier.parts(bore, slot=slot)
    else:
        thickness = slide.depth + carrier.wall
        slot = slide.carrier_slot(math.inf, thickness)
        driven = carrier.parts(bore, slot.reach + carrier.wall, thickness, slot)
        back = driven[0].bottom
    between: tuple[Part, ...] = ()
    if structure is Structure.AUTOMATIC:
        disc = slide.floating_disc(back, bore)
        back, between = disc.bottom, (disc,)
    return (slide.input_disc(back), *between, *driven)


class _CrossSlide:
    """Sizes of the slots and of the blocks that run in them."""

    def __init__(self, carrier: _Carrier, structure: Structure) -> None:
        clearances, take = carrier.drive.clearances, carrier.take
        needed = {
            "clearances.cross_slide_clearance_mm": clearances.cross_slide,
            "clearances.disc_radius_mm": clearances.disc_radius,
            **{f"clearances.slot_{n}_width_mm": getattr(clearances, f"slot_{n}_width") for n in structure.slots},
        }
        if missing := [key for key, value in needed.items() if value is None]:
            raise MissingValue(f"the {structure.value} structure", *missing)
        self.carrier, self.structure = carrier, structure
        self.clearance, self.radius = clearances.cross_slide, clearances.disc_radius
        self.widths = {n: getattr(clearances, f"slot_{n}_width") for n in structure.slots}
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

    def carrier_slot(self, room: float, thickness: float) -> Slot:
        """The slot in the cam's back, closed at both ends: the last slot of the chain."""
        number, wall = self.structure.slots[-1], self.carrier.wall
        width = self.widths[number]
        straight = math.sqrt(self.radius**2 - width**2 / 4) + self.travel
        slot = Slot(width, self.depth, straight, self._direction(number), self.radius, closed=True)
        if slot.reach + wall > room:
            raise HdoptError(
                f"slot {number} for a disc of {2 * self.radius:g} mm reaches {slot.reach:.4g} mm from the axis; the "
                f"cam allows {room - wall:.4g} mm; give a smaller clearances.disc_radius_mm"
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
            Tongue(self.radius, self.widths[2] - self.clearance, MINOR, top, top + self.depth),
        )
        slot = Slot(self.widths[1], self.depth, self.radius, MAJOR, self.radius, closed=False)
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
            Tongue(self.radius, self.widths[number] - self.clearance, direction, top, top + self.depth),
        )
        face = ((body[0].bottom, -1),)
        return Part("input_disc", BRONZE, body, bore, self.carrier.countersink(bore), face)

    def _require_disc_around(self, bore: PlainBore) -> None:
        if bore.radius + self.carrier.wall > self.radius:
            raise HdoptError(
                f"export.bore_mm is {self.carrier.shaft_diameter():g} mm; past it the floating disc needs a hole of "
                f"{2 * bore.radius:g} mm, larger than its {2 * self.radius:g} mm allow; give a smaller bore"
            )
