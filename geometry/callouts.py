"""What a part's drawing says beyond its views: datums, tolerance frames and notes, as they follow from the budgets.

Datums (ISO 5459): A is the feature that holds the part, B what locks its rotation. Frames (ISO 1101) take their zones
from the budgets of eccentricity and tilt. A profile that is not round has a profile tolerance (ISO 1660), never a
coaxiality; a round one has size, cylindricity and coaxiality, of which no one bounds another (ISO 8015).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hdopt.geometry.contour import Circle, ParallelCurve
from hdopt.geometry.digits import auxiliary, plain, rounded
from hdopt.geometry.din471 import ring_of
from hdopt.geometry.features import BoltCircle, DBore, KeywayBore, polar
from hdopt.geometry.iso286 import deviations
from hdopt.geometry.model import WaveGeneratorModel
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.slide_features import SlideEdges
from hdopt.geometry.slides import Slide, slides_of
from hdopt.geometry.threads import THREADS
from hdopt.geometry.undercut import AT_SHOULDER, Undercut

GENERAL_POSITION = 0.1
"""Diameter of the position zone of bolt holes, mm: half the play of a bolt in a medium clearance hole (ISO 273)."""

FLAT_ZONE = 0.05
"""Width of the position zone of a bore's flat, mm: what its shaft's flat keeps clear of (no standard has one)."""

LETTERS = "ABCDEFGHJKLMNPRSTUVWXYZ"
"""Letters for datums; I, O and Q are left out (ISO 5459)."""


@dataclass(frozen=True)
class Frame:
    """A tolerance frame: symbol, zone in mm, whether the zone is a cylinder, the datums in their order."""

    symbol: str
    zone: float
    diameter: bool = False
    datums: str = ""
    usual: bool = False
    """Whether the zone is a usual one, which follows from no budget and no slide."""

    @property
    def value(self) -> str:
        return f"{'Ø' if self.diameter else ''}{self.zone:.4g}"


@dataclass(frozen=True)
class Cylinder:
    """Cylindrical faces of a radius about an axis at x, y, mm."""

    radius: float
    axis: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Level:
    """Plane faces square to the axis at z, mm."""

    z: float


@dataclass(frozen=True)
class Flank:
    """Plane faces along the axis at a distance (mm) from it, whose normal lies at `direction` (rad) or opposite."""

    distance: float
    direction: float


@dataclass(frozen=True)
class Profile:
    """The upright wall of a profile that is not round."""


Face = Cylinder | Level | Flank | Profile


@dataclass(frozen=True)
class Callout:
    """Notes and frames at one feature, which a leader points to at x, y (mm, seen from the front).

    `boxed` are theoretically exact dimensions; `datum` is the letter that the feature bears. `faces` are the faces
    that the frames speak of and `size` their diameter or width with its deviations, mm; `datum_faces` those of the
    datum where they are others.
    """

    at: tuple[float, float]
    lines: tuple[str, ...]
    frames: tuple[Frame, ...] = ()
    boxed: tuple[str, ...] = ()
    datum: str = ""
    faces: tuple[Face, ...] = ()
    size: tuple[float, float, float] | None = None
    datum_faces: tuple[Face, ...] = ()
    on_face: bool = False
    """Whether the leader ends within a face, in a dot, and not at an outline."""


def callouts_of(part: Part, model: WaveGeneratorModel) -> tuple[Callout, ...]:
    """The callouts of a `part` of the `model`, each of its own feature; a datum that nothing refers to has none."""
    found = [
        _profile(part, model),
        _bore(part, model),
        _keyway(part),
        _bolts(part, model),
        _slot(part, model),
        _block(part, model),
    ]
    found += [_seat(part, model), _face(part, model), _edges(part)]
    given = [callout for callout in found if callout is not None]
    # A datum that no frame refers to says nothing, and is not drawn.
    used = {letter for callout in given for frame in callout.frames for letter in frame.datums}
    given = [replace(c, datum="") if c.datum and c.datum not in used else c for c in given]
    names = [item.name for item in model.parts if not item.context]
    return tuple(_with_letters(callout, names.index(part.name)) for callout in given)


def _with_letters(callout: Callout, number: int) -> Callout:
    """The callout with the letters of its part: a letter stands for one datum in the whole wave generator."""
    own = str.maketrans("ABC", LETTERS[3 * number : 3 * number + 3])
    frames = tuple(replace(frame, datums=frame.datums.translate(own)) for frame in callout.frames)
    return replace(callout, datum=callout.datum.translate(own), frames=frames)


def primary(part: Part) -> str:
    """What datum A is: the bore or hole that holds the part, else its back."""
    if part.bore is not None and not part.clearance_hole:
        return "bore"
    if isinstance(part.body[0], Prism) and part.body[0].inner is not None:
        return "hole"
    return "back"


def secondary(part: Part) -> str | None:
    """What datum B of a `part` is, which locks the rotation: keyway, flat, slot or the pattern of bolt holes; None
    without one."""
    if isinstance(part.bore, KeywayBore):
        return "keyway"
    if isinstance(part.bore, DBore):
        return "flat"
    if part.slot is not None:
        return "slot"
    return "bolts" if part.bolts is not None else None


def _datums(part: Part) -> str:
    return "AB" if secondary(part) else "A"


def _profile(part: Part, model: WaveGeneratorModel) -> Callout | None:
    contour = part.contour
    if contour is None:
        return None
    zone = model.profile_zone
    if isinstance(contour, Circle):
        place = polar(contour.radius, math.radians(60))
        located = model.plan.zone(part.name, "wg_eccentricity") or zone
        return Callout(
            (place[0], place[1] + contour.offset),
            (f"rim Ø{2 * contour.radius:.4f} ±{zone / 2:.4g}", "Ra 0.4"),
            (Frame("cylindricity", zone), Frame("coaxiality", located, True, "A")),
            faces=(Cylinder(contour.radius, (0.0, contour.offset)),),
            size=(2 * contour.radius, -zone / 2, zone / 2),
        )
    box = contour.box
    boxed = (f"{box[3] - box[1]:.4f} major axis", f"{box[2] - box[0]:.4f} minor axis")
    lines = (
        f"profile: parallel curve, {contour_name(part)}",
        "its points: the CSV of the cam and the STEP file of this revision",
        f"perimeter {plain(rounded(contour.perimeter, (-math.pi * zone, math.pi * zone)))} ±{math.pi * zone:.4g}",
        "Ra 0.4",
    )
    point = polar(contour.least_radius, math.radians(52))
    if hasattr(contour, "points"):
        point = tuple(contour.points(math.radians(52))[0].tolist())
    return Callout(point, lines, (Frame("profile", zone, False, _datums(part)),), boxed, faces=(Profile(),))


def contour_name(part: Part) -> str:
    """The law of the profile of a `part`, in words and numbers (mm): "circle" for one without a parallel curve."""
    contour = part.contour
    if not isinstance(contour, ParallelCurve):
        return "circle"
    profile = contour.profile
    name = profile.name.replace("_", "-")
    return f"{name} a = {profile.semi_major:.4f}, b = {profile.semi_minor:.4f}, {contour.distance:g} inside it"


def _bore(part: Part, model: WaveGeneratorModel) -> Callout | None:
    place = math.radians(128)
    first = part.body[0]
    if isinstance(first, Prism) and first.inner is not None:
        hole = first.inner
        fit = model.plan.hole_of(part.name)
        radius, y = (hole.box[2] - hole.box[0]) / 2, (hole.box[1] + hole.box[3]) / 2
        at = polar(radius, place)
        words = (f"hole Ø{2 * radius:g} {fit.hole if fit else ''} {_limits(fit.hole_limits) if fit else ''}".strip(),)
        limits = (2 * radius, *fit.hole_limits) if fit else None
        held = (Cylinder(radius, (0.0, y)),)
        return Callout((at[0], at[1] + y), (*words, "Ra 0.8"), datum="A", faces=held, size=limits)
    if part.bore is None:
        return None
    diameter = 2 * part.bore.radius
    if part.clearance_hole:
        return Callout(polar(part.bore.radius, place), (f"hole Ø{diameter:g} H11 through", *_countersunk(part)))
    fit = model.plan.hole_of(part.name)
    named = f"bore Ø{diameter:g} {fit.hole} {_limits(fit.hole_limits)}" if fit else f"bore Ø{diameter:g}"
    faces = (Cylinder(part.bore.radius),)
    limits = (diameter, *fit.hole_limits) if fit else None
    return Callout(
        polar(part.bore.radius, place),
        (named, "; ".join(("Ra 0.8", *_countersunk(part)))),
        datum="A",
        faces=faces,
        size=limits,
    )


def _countersunk(part: Part) -> tuple[str, ...]:
    """At which of its ends the bore of a `part` is countersunk."""
    if not part.countersink or not part.countersunk:
        return ()
    ends = {side for _, side in part.countersunk}
    where = "at both ends" if len(ends) == 2 else "at the front" if 1 in ends else "at the back"
    return (f"countersunk {part.countersink:g} × 45° {where}",)


def _limits(limits: tuple[float, float]) -> str:
    low, high = limits
    if not high:
        return f"0/{low:.4g}"
    return f"{high:+.4g}/{low:+.4g}" if low else f"+{high:.4g}/0"


def _keyway(part: Part) -> Callout | None:
    """What holds the part against turning: its middle plane, or its flat, has its place to the bore."""
    bore = part.bore
    if isinstance(bore, KeywayBore):
        radii = bore.key.corner_radii
        lines = (
            f"keyway {bore.key.width:g} JS9, DIN 6885-1",
            f"d + t2 = {2 * bore.radius + bore.key.hub_depth:g} +{bore.key.hub_depth_tolerance:g}/0",
            f"corners R {radii[0]:g} to {radii[1]:g}",
        )
        sides = (Flank(bore.key.width / 2, bore.direction + math.pi / 2),)
        size = (bore.key.width, *deviations("JS9", bore.key.width))
        frames = (Frame("symmetry", keyway_symmetry(bore), False, "A", usual=True),)
        return Callout(polar(bore.bottom, bore.direction), lines, frames, datum="B", faces=sides, size=size)
    if isinstance(bore, DBore):
        return Callout(
            polar(bore.flat, bore.direction),
            ("flat",),
            (Frame("position", FLAT_ZONE, False, "A", usual=True),),
            (f"{bore.flat:g} from the axis",),
            datum="B",
            faces=(Flank(bore.flat, bore.direction),),
        )
    return None


def keyway_symmetry(bore: KeywayBore) -> float:
    """Zone of a keyway's middle plane about the axis of its `bore`, mm: as wide as the tolerance of its width.

    DIN 6885-1 leaves it open. Off the axis by half of it, the keyway turns the part on its shaft once and for all.
    """
    lower, upper = deviations("JS9", bore.key.width)
    return upper - lower


def _bolts(part: Part, model: WaveGeneratorModel) -> Callout | None:
    bolts = part.bolts
    if bolts is None:
        return None
    lines = (hole_note(part, model),)
    datum = "B" if secondary(part) == "bolts" else ""
    frame = Frame("position", GENERAL_POSITION, True, "A" if datum else _datums(part), usual=True)
    at = outer_point(bolts)
    holes = tuple(Cylinder(bolts.hole / 2, centre) for centre in bolts.centres)
    return Callout(at, lines, (frame,), (f"{360 / bolts.count:g}°", f"Ø{2 * bolts.radius:g}"), datum, holes)


def outer_point(bolts: BoltCircle) -> tuple[float, float]:
    """The point (x, y), mm, of the first hole of `bolts` that lies farthest from the axis."""
    x, y = bolts.centres[0]
    away = math.hypot(x, y)
    return x * (1 + bolts.hole / 2 / away), y * (1 + bolts.hole / 2 / away)


def hole_note(part: Part, model: WaveGeneratorModel) -> str:
    """Thread or clearance of the bolt holes of a `part`, which has some, with the depth (mm) of a hub's thread, which
    its flange has; `model` is that of the wave generator."""
    bolts = part.bolts
    assert bolts is not None
    thread = next((name for name, (_, tap) in THREADS.items() if math.isclose(tap, bolts.hole)), None)
    if part.name == "hub" and thread is not None:
        depth = part.body[0].height
        return f"{bolts.count} × {thread}-6H through {auxiliary(depth)}, drill Ø{bolts.hole:g}"
    return f"{bolts.count} × Ø{bolts.hole:g} H13 through"


def _slot(part: Part, model: WaveGeneratorModel) -> Callout | None:
    slot = part.slot
    slide = next((slide for slide in slides_of(model.parts) if slide.above is part), None)
    if slot is None or slide is None:
        return None
    # The width of the slot makes its round ends.
    round_end = auxiliary(slot.width / 2, "R")
    ends = f"ends {round_end}, {plain(rounded(2 * slot.reach))} long" if slot.closed else "open at both ends"
    lines = (
        f"slot {slot.width:g} {_limits((0.0, slide.zone))}, {slot.depth:g} {_limits(slide.depth_limits)} deep",
        f"from the back, {ends}; Ra 0.8",
        f"bottom corners {_cornered(slot.edges)}",
        f"mouth {slot.edges.chamfer:g} × 45°",
    )
    sides = (Flank(slot.width / 2, slot.direction + math.pi / 2),)
    letter = "B" if secondary(part) == "slot" else ""
    frames = (Frame("perpendicularity", slide.zone, False, "A"),)
    at, size = polar(0.93 * slot.half_length, slot.direction), (slot.width, 0.0, slide.zone)
    return Callout(at, lines, frames, datum=letter, faces=sides, size=size, on_face=True)


def _cornered(edges: SlideEdges) -> str:
    return f"R{edges.corner:g} max or {edges.corner:g} × 45° max"


def _block(part: Part, model: WaveGeneratorModel) -> Callout | None:
    slide = next((slide for slide in slides_of(model.parts) if slide.below is part), None)
    if slide is None:
        return None
    block = slide.block
    lines = (
        f"block {block.width:g} {_limits((-slide.zone, 0.0))}, {block.height:g} {_limits(slide.height_limits)} high; "
        "Ra 0.8",
        f"foot {_cornered(block.edges)}; upper edges {block.edges.chamfer:g} × 45°",
    )
    sides = (Flank(block.width / 2, block.direction + math.pi / 2),)
    frames, size = _upright(part, model, slide), (block.width, -slide.zone, 0.0)
    return Callout(polar(0.8 * block.radius, block.direction), lines, frames, faces=sides, size=size, on_face=True)


def _upright(part: Part, model: WaveGeneratorModel, slide: Slide) -> tuple[Frame, ...]:
    """What keeps the block of a `slide` on its `part` upright and square: to the slot in the same part, or, without
    one, to what the shaft holds."""
    if part.slot is not None:
        return Frame("perpendicularity", slide.zone, False, "A"), Frame(
            "perpendicularity", slide.squareness, False, "B"
        )
    centred = model.plan.zone(part.name, "wg_eccentricity")
    upright = Frame("parallelism", slide.zone, False, "A")
    first = (Frame("symmetry", centred, False, "A"), upright) if centred else (upright,)
    # A keyway lies across the block, and so its flat along it. They only say how the block stands on the shaft.
    turned = {"keyway": "perpendicularity", "flat": "parallelism"}.get(secondary(part) or "")
    return (*first, Frame(turned, GENERAL_POSITION, False, "B", usual=True)) if turned else first


def _seat(part: Part, model: WaveGeneratorModel) -> Callout | None:
    fit = model.plan.shaft_of(part.name)
    rounds = [p for p in part.body[1:] if isinstance(p, Prism) and isinstance(p.outline, Circle)]
    if fit is None or not rounds or not isinstance(rounds[0].outline, Circle):
        return None
    circle = rounds[0].outline
    zone = model.plan.zone(part.name, "wg_eccentricity")
    size = f"Ø{2 * circle.radius:g} {fit.shaft} {_limits(fit.shaft_limits)}; Ra 0.8"
    reliefs = _reliefs(rounds)
    at = polar(circle.radius, math.radians(60))
    limits = (2 * circle.radius, *fit.shaft_limits)
    if circle.offset:
        frames: tuple[Frame, ...] = (Frame("position", model.journal_zone, True, _datums(part)),)
        boxed = (f"±{circle.offset:.4f} off the axis",)
        faces = tuple(Cylinder(circle.radius, (0.0, sign * circle.offset)) for sign in (1, -1))
        tip = (at[0], at[1] + circle.offset)
        return Callout(tip, (f"2 journals {size}", *reliefs), frames, boxed, faces=faces, size=limits)
    frames = (Frame("coaxiality", zone, True, "A"),) if zone else ()
    return Callout(at, (f"seat {size}", *reliefs), frames, faces=(Cylinder(circle.radius),), size=limits)


def _reliefs(rounds: Sequence[Prism]) -> list[str]:
    """What is turned into seat or journals, in words."""
    lines = []
    for recess in dict.fromkeys(recess for piece in rounds for recess in piece.recesses):
        if recess == AT_SHOULDER:
            lines.append("undercut DIN 509-E0.2×0.1 at the shoulder")
        elif isinstance(recess, Undercut):
            lines.append(f"relief {recess.length:g} × {recess.depth:g} deep, R{recess.radius:g}, 15° out, at shoulders")
        else:
            ring = ring_of(rounds[-1].outline.perimeter / math.pi)
            assert ring is not None
            lines.append(
                f"groove Ø{ring.groove:g} {ring.groove_class} × {ring.groove_width:g} H13 for ring {ring.name}"
            )
    return lines


def _face(part: Part, model: WaveGeneratorModel) -> Callout | None:
    zone = model.plan.zone(part.name, "wg_tilt")
    at = polar(0.96 * part.box[3], math.radians(97))
    back = (Level(part.bottom),)
    if part.contour is not None and not isinstance(part.contour, Circle):
        if primary(part) == "bore" and part.bolts is None:
            frames = (Frame("parallelism", zone, False, "A"),) if zone else ()
            return Callout(at, ("profile to the bore; faces: Ra 0.8",), frames, faces=(Profile(),), on_face=True)
        # Screwed on, the profile stands square to the back, which is the datum that carries the cam.
        letter = "A" if primary(part) == "back" else "C"
        frames = (Frame("perpendicularity", zone, False, letter),) if zone else ()
        lines = ("profile to the back face; back: Ra 0.8",)
        return Callout(at, lines, frames, datum=letter, faces=(Profile(),), datum_faces=back, on_face=True)
    first = part.body[0]
    front = (Level(first.top if len(part.body) > 1 else part.bottom),)
    if primary(part) == "back":
        frames = (Frame("parallelism", zone, False, "A"),) if zone else ()
        lines = ("front face to the back; Ra 0.8",)
        return Callout(at, lines, frames, datum="A", faces=front, datum_faces=back, on_face=True)
    if zone is None:
        return None
    frame = Frame("perpendicularity", zone, False, "A")
    return Callout(at, ("face that carries the next part; Ra 0.8",), (frame,), faces=front, on_face=True)


def _edges(part: Part) -> Callout | None:
    texts = []
    prisms = [piece for piece in part.body if isinstance(piece, Prism)]
    for place, edges in (("back", "bottom_edge"), ("front", "top_edge")):
        for edge in dict.fromkeys(getattr(piece, edges) for piece in prisms):
            if edge.axial:
                slope = math.degrees(math.atan2(edge.radial, edge.axial))
                texts.append(f"{edge.axial:g} × {slope:.3g}° at the {place}")
    if not texts:
        return None
    return Callout(polar(0.99 * part.box[3], math.radians(115)), ("outer edges: " + ", ".join(texts),))
