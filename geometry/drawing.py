"""The drawing of a wave generator: front view with dimensions, section A-A, exploded view, key dimensions, title block.

Views and the section are taken from the solids, dimensions from the closed-form model. First-angle projection: the view
from the left stands on the right. A3, lines of ISO 128. Tolerance frames stand on the sheets of the parts.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from hdopt.arrays import Array
from hdopt.files import JsonReady
from hdopt.geometry.arcs import outline_of_slot, sample
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.contour import Circle
from hdopt.geometry.digits import auxiliary, drawn
from hdopt.geometry.features import DBore, KeywayBore, polar
from hdopt.geometry.part import Part, Prism, ProfiledPart
from hdopt.geometry.sheet import SMALL, TEXT, Point, Sheet
from hdopt.geometry.views import (
    Vector,
    View,
    half_behind_minor_axis_zero,
    section_at_minor_axis_zero,
    seen_from,
)

if TYPE_CHECKING:
    import cadquery as cq

    from hdopt.geometry.job import Job

WIDTH, HEIGHT, BORDER = 420.0, 297.0, 10.0
SCALES = (20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05)
TITLE_WIDTH, TITLE_HEIGHT = 178.0, 40.0
FRONT_ROOM, SECTION_ROOM = 118.0, 62.0
FRONT_CENTRE, SECTION_CENTRE_X = (98.0, 94.0), 226.0
EXPLODED_CENTRE, EXPLODED_ROOM = (344.0, 76.0), (118.0, 112.0)

VIEWS = (10.0, 14.0, 400.0, 168.0)
"""Left, top, width and height of the part of the sheet that the views take, mm."""

PAPERWORK = "paperwork"
"""Name of the group that holds border, tables and title block."""

CLEARANCE_CLASS = "H11"
"""Of holes that pass the shaft."""

FRONT: tuple[Vector, Vector] = ((0, 0, 1), (1, 0, 0))
"""Eye on +z, x to the right, y up."""
FROM_LEFT: tuple[Vector, Vector] = ((-1, 0, 0), (0, 0, 1))
"""Eye on -x, z to the right, y up."""
EXPLODED: tuple[Vector, Vector] = ((0.80, 0.34, 0.50), (0.50, 0.0, -0.80))
"""Eye in front, above and to the right; y stays up."""

EXPLODED_GAP = 0.30
"""Gap between parts pulled apart, as a share of the largest part's height."""


@dataclass(frozen=True)
class Placed:
    """A view's place on the sheet: view coordinates (mm, y up) times `scale`, from `origin`."""

    origin: Point
    scale: float

    def __call__(self, points: Array | Sequence[Point]) -> Array:
        return np.asarray(points, float) * (self.scale, -self.scale) + self.origin

    def point(self, x: float, y: float) -> Point:
        return self.origin[0] + self.scale * x, self.origin[1] - self.scale * y


def draw(job: Job) -> str:
    """The drawing of a `job` as the text of an SVG."""
    sheet = Sheet(WIDTH, HEIGHT, job.identity.title, job.identity.description)
    made = [(part, solid) for part, solid in job.solids if not part.context]
    boxes = np.array([part.box for part, _ in made])
    tall = np.ptp(boxes[:, [1, 4]])
    deep = np.ptp(boxes[:, [2, 5]])
    scale = next((s for s in SCALES if tall * s <= FRONT_ROOM and deep * s <= SECTION_ROOM), SCALES[-1])
    front = Placed(FRONT_CENTRE, scale)
    middle = (boxes[:, 2].min() + boxes[:, 5].max()) / 2
    section = Placed((SECTION_CENTRE_X - scale * middle, FRONT_CENTRE[1]), scale)

    with sheet.group(PAPERWORK):
        _border(sheet)
        _key_dimensions(sheet, job)
        _assumed(sheet, job)
        _title_block(sheet, job, scale)
    _front_view(sheet, front, made, job)
    _section(sheet, section, made, job)
    draw_exploded(sheet, made)
    return sheet.svg()


def views_alone(svg: str) -> str:
    """`svg`, a drawing of `draw`, without border, tables and title block: for a page that shows those in its own
    way."""
    svg = re.sub(rf'<g id="{PAPERWORK}">.*?</g>', "", svg, count=1, flags=re.DOTALL)
    left, top, width, height = VIEWS
    old = f'width="{WIDTH:g}mm" height="{HEIGHT:g}mm" viewBox="0 0 {WIDTH:g} {HEIGHT:g}"'
    new = f'width="{width:g}mm" height="{height:g}mm" viewBox="{left:g} {top:g} {width:g} {height:g}"'
    return svg.replace(old, new, 1).replace('<rect width="100%"', f'<rect x="{left:g}" y="{top:g}" width="100%"', 1)


def check_drawing(path: Path, job: Job, name: str) -> JsonReady:
    """Read the drawing at `path` back: well-formed, of its size, naming the study, with every key dimension of the
    `job`. Returns how many there are; raises `CheckFailed`, which calls the file `name`, with all that is wrong."""
    root = ElementTree.parse(path).getroot()
    said = [element.text or "" for element in root.iter("{http://www.w3.org/2000/svg}text")]
    failures = []
    if root.get("viewBox") != f"0 0 {WIDTH:g} {HEIGHT:g}":
        failures.append("it is not an A3 sheet")
    if not any(job.identity.fingerprint in text for text in said):
        failures.append("it does not name the study's fingerprint")
    wanted = {f"{row.nominal:.4f}" for row in job.dimensions if row.nominal is not None}
    if missing := wanted - set(said):
        failures.append(f"it lacks the dimensions {', '.join(sorted(missing))}")
    if failures:
        raise CheckFailed(name, failures)
    return {"dimensions": len(wanted)}


def _border(sheet: Sheet) -> None:
    x, y = WIDTH - BORDER, HEIGHT - BORDER
    sheet.polyline([(BORDER, BORDER), (x, BORDER), (x, y), (BORDER, y)], "frame", closed=True)


def draw_view(sheet: Sheet, place: Placed, view: View) -> None:
    """The visible lines of a `view` on the `sheet`, at `place`."""
    for line in view.visible:
        sheet.polyline(place(line))


def _front_view(sheet: Sheet, place: Placed, made: list[tuple[Part, cq.Solid]], job: Job) -> None:
    parts = [part for part, _ in made]
    for part in parts:
        for piece in part.body:
            if isinstance(piece, Prism) and isinstance(piece.outline, Circle) and part.contour is None:
                x, y = place.point(0, piece.outline.offset)
                sheet.circle((x, y), place.scale * piece.outline.radius, "hidden")
        if part.slot and part.slot.closed:
            sheet.polyline(place(sample(outline_of_slot(part.slot))), "hidden", closed=True)
    draw_view(sheet, place, seen_from([solid for _, solid in made], *FRONT))
    carrier = job.model.profiled[0]
    low_x, low_y, high_x, high_y = _extent(job.model.profiled)
    over = 5 / place.scale
    sheet.line(place.point(low_x - over, 0), place.point(high_x + over, 0), "axis")
    sheet.line(place.point(0, low_y - 3 * over), place.point(0, high_y + 3 * over), "axis")
    _cutting_plane(sheet, place, low_y - 3 * over, high_y + 3 * over)

    left, bottom = place.point(low_x, 0)[0], place.point(0, low_y)[1]
    tall, wide = f"{high_y - low_y:.3f}", f"{high_x - low_x:.3f}"
    if isinstance(carrier.contour, Circle):
        # The discs' diameter and their offset make them.
        tall, wide = f"({tall})", f"({wide})"
    sheet.dimension(place.point(0, low_y), place.point(0, high_y), left - 15, f"{tall}  major axis", True)
    sheet.dimension(place.point(low_x, 0), place.point(high_x, 0), bottom + 27, f"{wide}  minor axis", False)
    _bore_callout(sheet, place, job, high_x, low_y)
    _bolt_callout(sheet, place, parts, low_x, high_y)
    if isinstance(carrier.contour, Circle):
        _disc_callout(sheet, place, carrier.contour)


def _extent(parts: Sequence[ProfiledPart]) -> tuple[float, float, float, float]:
    """x_min, y_min, x_max, y_max of what carries the bearing, mm."""
    left, low, right, high = zip(*(part.contour.box for part in parts), strict=True)
    return min(left), min(low), max(right), max(high)


def _cutting_plane(sheet: Sheet, place: Placed, low: float, high: float) -> None:
    """The ends of the cutting plane's line, with arrows the way one looks, and its letter."""
    for y, outward in ((high, 1), (low, -1)):
        x, end = place.point(0, y)
        sheet.polyline([(x, end), (x, end + outward * 4)], "frame")
        sheet.line((x - 7, end), (x, end))
        sheet.arrow((x, end), 0.0)
        sheet.text((x - 8.5, end + 1.3), "A", 4.5, "end", bold=True)


def _fit_of(job: Job, part: Part) -> str:
    """Tolerance class of the bore of a `part`, as the limits on its own sheet have it."""
    fit = job.model.plan.hole_of(part.name)
    return CLEARANCE_CLASS if part.clearance_hole else fit.hole if fit is not None else ""


def _bore_callout(sheet: Sheet, place: Placed, job: Job, right: float, bottom: float) -> None:
    """The bore that holds the shaft, where it is seen from the front; else the hole that clears it."""
    parts = [part for part, _ in job.made]
    seen = next((part for part in reversed(parts) if part.clearance_hole), parts[0])
    bore = seen.bore
    if bore is None:
        return
    lines = [f"⌀{2 * bore.radius:g} {_fit_of(job, seen)}"]
    if isinstance(bore, KeywayBore):
        depth = 2 * bore.radius + bore.key.hub_depth
        lines += [f"keyway {bore.key.width:g} JS9", f"d + t2 = {depth:g} +{bore.key.hub_depth_tolerance:g}/0"]
    if isinstance(bore, DBore):
        lines.append(f"flat {bore.flat:g} from the axis")
    knee = place.point(right, bottom)
    sheet.leader(place.point(*polar(bore.radius, math.radians(128))), (knee[0] + 1, knee[1] + 3), lines)


def _bolt_callout(sheet: Sheet, place: Placed, parts: Sequence[Part], left: float, top: float) -> None:
    bolts = next((part.bolts for part in reversed(parts) if part.bolts), None)
    if bolts is None:
        return
    sheet.circle(place.point(0, 0), place.scale * bolts.radius, "axis")
    x, y = bolts.centres[-1]
    edge = math.hypot(x, y)
    tip = (x * (1 + bolts.hole / 2 / edge), y * (1 + bolts.hole / 2 / edge))
    knee = place.point(left, top)
    sheet.leader(
        place.point(*tip), (knee[0] + 6, knee[1] - 2), [f"{bolts.count} × ⌀{bolts.hole:g} on ⌀{2 * bolts.radius:g}"]
    )


def _disc_callout(sheet: Sheet, place: Placed, circle: Circle) -> None:
    tip = polar(circle.radius, math.radians(100))
    x, y = place.point(tip[0], tip[1] + circle.offset)
    lines = [f"2 × ⌀{2 * circle.radius:.3f}", f"e = {circle.offset:.4f}"]
    sheet.leader((x, y), (x + 6, y + 16), lines)


def _section(sheet: Sheet, place: Placed, made: list[tuple[Part, cq.Solid]], job: Job) -> None:
    for index, (part, solid) in enumerate(made):
        angle, pitch = (45, -45, 45, -45, 45)[index % 5], (1.7, 1.7, 2.4, 2.4, 3.0)[index % 5]
        colour = "#" + "".join(f"{round(170 * share):02x}" for share in part.colour[:3])
        fill = sheet.hatch(f"hatch{index}", colour, angle, pitch)
        for region in section_at_minor_axis_zero(solid):
            sheet.region(place(region.outer), [place(hole) for hole in region.holes], fill)
    halves = [half_behind_minor_axis_zero(solid) for _, solid in made]
    draw_view(sheet, place, seen_from(halves, *FROM_LEFT))
    boxes = np.array([part.box for part, _ in made])
    low, high = boxes[:, 2].min(), boxes[:, 5].max()
    over = 5 / place.scale
    sheet.line(place.point(low - over, 0), place.point(high + over, 0), "axis")
    half, top = job.drive.wave_generator.width / 2, _extent(job.model.profiled)[3]
    bottom = boxes[:, 1].min()
    line = place.point(0, bottom)[1]
    sheet.text((place.point((low + high) / 2, 0)[0], place.point(0, top)[1] - 16), "A – A", 5, "middle", bold=True)
    # Two discs and the gap between them make the width that they have together, all parts the whole.
    wide = drawn(2 * half, ()) if len(job.model.profiled) == 1 else auxiliary(2 * half)
    sheet.dimension(place.point(-half, bottom), place.point(half, bottom), line + 9, wide, False)
    if high - low > 2 * half + 1e-6:
        whole = auxiliary(high - low)
        sheet.dimension(place.point(low, bottom), place.point(high, bottom), line + 18, whole, False)
    _edge_callouts(sheet, place, made, top)
    _seat_dimension(sheet, place, job, high)
    _holding_bore(sheet, place, job, low)


def _edge_callouts(sheet: Sheet, place: Placed, made: list[tuple[Part, cq.Solid]], top: float) -> None:
    carrier = next(part for part, _ in reversed(made) if isinstance(part, ProfiledPart))
    edge = carrier.body[0].top_edge
    if edge.axial:
        tip = place.point(carrier.top - edge.axial / 2, -carrier.contour.box[1] - edge.radial / 2)
        if isinstance(carrier.contour, Circle):
            tip = place.point(carrier.top - edge.axial / 2, carrier.contour.box[3] - edge.radial / 2)
        slope = math.degrees(math.atan2(edge.radial, edge.axial))
        sheet.leader(tip, (tip[0] + 8, tip[1] - 8), [f"{edge.axial:g} × {slope:.3g}°"])


def _seat_dimension(sheet: Sheet, place: Placed, job: Job, right: float) -> None:
    """Diameter of the hub's seat or of the hole for the shaft, on the right of the section."""
    parts = [part for part, _ in job.made]
    top, bore = next(((part, part.bore) for part in reversed(parts) if part.bore), (parts[0], None))
    if bore is None or top is parts[0]:
        return
    radius = bore.radius
    seat = job.model.plan.shaft_of("hub")
    label = f"⌀{2 * radius:g} {_fit_of(job, top)}" + (f"/{seat.shaft}" if seat is not None else "")
    x = place.point(right, 0)[0] + 12
    sheet.dimension(place.point(top.top, -radius), place.point(top.top, radius), x, label, True)


def _holding_bore(sheet: Sheet, place: Placed, job: Job, left: float) -> None:
    """Diameter of the bore that holds the shaft, on the left of the section."""
    held = next((part for part, _ in job.made if part.bore and not part.clearance_hole), None)
    if held is None or held.bore is None:
        return
    foot, radius = held.bottom, held.bore.radius
    x = place.point(left, 0)[0] - 14
    label = f"⌀{2 * radius:g} {_fit_of(job, held)}"
    sheet.dimension(place.point(foot, -radius), place.point(foot, radius), x, label, True)


def draw_exploded(
    sheet: Sheet, made: list[tuple[Part, cq.Solid]], centre: Point = EXPLODED_CENTRE, room: Point = EXPLODED_ROOM
) -> None:
    """The parts of `made`, (part, solid) from the input on, pulled apart along the axis, with their names: on the
    `sheet` about `centre` (x, y) within `room` (width, height), mm."""
    apart = pulled_apart(made)
    view = seen_from(apart, *EXPLODED)
    low_x, low_y, high_x, high_y = view.box
    high_y += 0.06 * (high_y - low_y)
    scale = min(room[0] / (high_x - low_x), room[1] / (high_y - low_y))
    middle = ((low_x + high_x) / 2, (low_y + high_y) / 2)
    place = Placed((centre[0] - scale * middle[0], centre[1] + scale * middle[1]), scale)
    for line in view.visible:
        sheet.polyline(place(line), "thin")
    _names(sheet, place, made, apart)


def _names(sheet: Sheet, place: Placed, made: list[tuple[Part, cq.Solid]], apart: Sequence[cq.Shape]) -> None:
    """Each part's name above it."""
    eye, right = (np.array(vector) / np.linalg.norm(vector) for vector in EXPLODED)
    up = np.cross(eye, right)
    for (part, _), shape in zip(made, apart, strict=True):
        box = shape.BoundingBox()
        across = up[:2] / np.hypot(*up[:2])
        highest = np.array([*(box.ymax * across), box.zmin if up[2] < 0 else box.zmax])
        x, y = place.point(float(highest @ right), float(highest @ up))
        sheet.text((x, y - 2.5), part.name.replace("_", " "), TEXT, "middle")


def pulled_apart(made: Sequence[tuple[Part, cq.Solid]]) -> list[cq.Solid]:
    """The solids of `made`, (part, solid) from the lowest up, each moved along z to stand a gap above the one before;
    the gap is 0.3 of the largest part's height along y."""
    import cadquery as cq

    gap = EXPLODED_GAP * max(part.size[1] for part, _ in made)
    shapes: list[cq.Solid] = []
    end: float | None = None
    for part, solid in made:
        shift = 0.0 if end is None else end + gap - part.bottom
        shapes.append(solid.moved(cq.Location(cq.Vector(0, 0, shift))))
        end = part.top + shift
    return shapes


def _key_dimensions(sheet: Sheet, job: Job) -> None:
    rows = [("part", "dimension", "mm", "tolerance", "from")]
    for row in job.dimensions:
        nominal = "" if row.nominal is None else f"{row.nominal:.4f}"
        rows.append((row.part.replace("_", " "), row.name, nominal, row.tolerance, row.source))
    height = min(4.7, 90.0 / len(rows))
    top = HEIGHT - BORDER - 4 - height * len(rows)
    sheet.text((BORDER + 4, top - 2), "Key dimensions", TEXT, bold=True)
    sheet.table((BORDER + 4, top), (28, 58, 20, 52, 50), rows, height)


def _assumed(sheet: Sheet, job: Job) -> None:
    """The sizes that the study does not give, above the title block."""
    rows = [(a.key.removeprefix("export."), _written(a.value), a.reason) for a in job.model.assumptions]
    if not rows:
        return
    height, widths = 3.9, (38, 16, 124)
    top = HEIGHT - BORDER - TITLE_HEIGHT - 4 - height * (len(rows) + 1)
    left = WIDTH - BORDER - TITLE_WIDTH
    sheet.text((left, top - 2), "Assumed, not given by the study", TEXT, bold=True)
    sheet.table((left, top), widths, [("[export] key", "value", "why"), *rows], height)


def _written(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value).lower() if isinstance(value, bool) else str(value)


def _title_block(sheet: Sheet, job: Job, scale: float) -> None:
    width, height = TITLE_WIDTH, TITLE_HEIGHT
    x, y = WIDTH - BORDER - width, HEIGHT - BORDER - height
    sheet.polyline([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], "frame", closed=True)
    drive = job.drive
    gear = drive.geometry
    structure = drive.wave_generator.structure.value.replace("_", " ")
    ratio = f"{scale:g}:1" if scale >= 1 else f"1:{1 / scale:g}"
    sheet.text((x + 4, y + 9), job.identity.title, 5.2, bold=True)
    profile = drive.wave_generator.profile.name.replace("_", "-")
    teeth = f"{gear.flexspline_teeth}/{gear.circular_spline_teeth} teeth, module {gear.module:g} mm"
    lines = (
        f"{profile} profile, {structure} structure; {teeth}",
        f"cam: exact parallel curve, {drive.wave_generator.bearing_thickness:g} mm inside the flexspline's inner wall"
        if not isinstance(job.model.profiled[0].contour, Circle)
        else f"discs: {drive.wave_generator.bearing_thickness:g} mm inside the flexspline's inner wall at its tips",
        f"hdopt {job.identity.version}, study {job.identity.study}, fingerprint {job.identity.fingerprint}",
        f"dimensions in mm; scale {ratio}; first-angle projection; ISO 8015; ISO 2768-1 m; ISO 22081; "
        "in parentheses: auxiliary",
    )
    for row, line in enumerate(lines):
        sheet.text((x + 4, y + 16 + 5.6 * row), line, SMALL + 0.2)
    draw_first_angle(sheet, (x + width - 22, y + 9))


def draw_first_angle(sheet: Sheet, at: Point) -> None:
    """The symbol of first-angle projection (ISO 128) on the `sheet`, its middle at the point `at`, mm."""
    x, y = at
    sheet.polyline([(x - 10, y - 2), (x - 2, y - 4), (x - 2, y + 4), (x - 10, y + 2)], "thin", closed=True)
    sheet.circle((x + 7, y), 4)
    sheet.circle((x + 7, y), 2)
    sheet.line((x - 12, y), (x, y), "axis")
    sheet.line((x + 1.5, y), (x + 12.5, y), "axis")
    sheet.line((x + 7, y - 5.5), (x + 7, y + 5.5), "axis")
