"""Drawing sheets (A3): one for each part that is made and one of the assembly with its parts list."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdopt.geometry.arcs import outline_of_slot, outline_of_strip, sample
from hdopt.geometry.callouts import Callout, callouts_of
from hdopt.geometry.contour import Circle
from hdopt.geometry.day import moment
from hdopt.geometry.din471 import ring_of
from hdopt.geometry.drawing import (
    FROM_LEFT,
    FRONT,
    SCALES,
    Placed,
    draw_exploded,
    draw_first_angle,
    draw_view,
)
from hdopt.geometry.materials import mass, material
from hdopt.geometry.mating_drawing import fill_mating_sheet
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.sheet import FRAME_HEIGHT, SMALL, TEXT, Point, Sheet, Solid, text_width
from hdopt.geometry.sheet_details import draw_details, mark_details
from hdopt.geometry.sheet_lengths import STACK, axial_spans, draw_lengths
from hdopt.geometry.step import ProductData
from hdopt.geometry.views import Region, half_behind_minor_axis_zero, section_at_minor_axis_zero, seen_from

if TYPE_CHECKING:
    import cadquery as cq

    from hdopt.geometry.job import Job

WIDTH, HEIGHT, BORDER = 420.0, 297.0, 10.0
FRONT_CENTRE, FRONT_ROOM = (92.0, 98.0), 116.0
SECTION_CENTRE, SECTION_ROOM = (216.0, 98.0), 44.0
COLUMN_LEFT, COLUMN_TOP, COLUMN_STEP = 282.0, 22.0, 5.0
TITLE_LEFT, TITLE_TOP = 232.0, 209.0
DETAILS = (276.0, 149.0)
"""Upper left of the detail views."""

BALLOON = 2.6
"""Radius of the ring round a number, mm."""

APART = math.radians(12)
"""Least angle between two numbers beside a view."""

NOTES = (
    "general tolerances: lengths ISO 2768-1 m; ISO 22081: profile of a surface 0.1 to the first datum",
    "edges ISO 13715: outside -0.1 to -0.3, inside +0.2 max; surfaces Ra 1.6 where not said otherwise",
    "ISO 8015; datums ISO 5459; frames ISO 1101, ISO 1660; boxed: theoretically exact; mm; 20 °C",
)


def sheets(job: Job) -> list[Sheet]:
    """The sheets of a `job`: the assembly, every part in the order of the parts list, what mating parts must keep."""
    made = job.made
    drawn = [_assembly(job)]
    drawn += [_part_sheet(job, part, solid, number) for number, (part, solid) in enumerate(made, 1)]
    return [*drawn, _mating(job, len(made) + 1)]


def part_number(job: Job, number: int) -> str:
    """Number of a part of a `job`: the study's own or the fingerprint, and its `number` in the parts list (0: the
    assembly)."""
    return f"{job.options.part_number or f'WG-{job.identity.fingerprint[:8].upper()}'}-{number:02d}"


def product_data(job: Job) -> dict[str, ProductData]:
    """Number, material and callouts of each part of a `job` that is made, by its name; and the assembly's number."""
    whole = {job.identity.title: ProductData(part_number(job, 0))}
    return whole | {
        part.name: ProductData(
            part_number(job, number),
            made_of.with_hardness,
            made_of.density,
            callouts_of(part, job.model),
            made_of.assumed,
        )
        for number, part in enumerate((part for part in job.model.parts if not part.context), 1)
        for made_of in (material(part, job.options),)
    }


def _part_sheet(job: Job, part: Part, solid: cq.Solid, number: int) -> Sheet:
    sheet = Sheet(WIDTH, HEIGHT, f"{part.name.replace('_', ' ')}, {job.identity.title}", job.identity.description)
    scale = _scale(part)
    front = Placed(FRONT_CENTRE, scale)
    middle = (part.bottom + part.top) / 2
    section = Placed((SECTION_CENTRE[0] - scale * middle, SECTION_CENTRE[1]), scale)
    _frame(sheet)
    _front(sheet, front, part, solid)
    _section(sheet, section, part, solid)
    _column(sheet, front, callouts_of(part, job.model))
    _limits(sheet, job, part)
    _title(sheet, job, part.name.replace("_", " "), part_number(job, number), scale, part)
    return sheet


def _scale(part: Part) -> float:
    tall, deep = max(part.size[0], part.size[1]), part.size[2]
    return next((s for s in SCALES if tall * s <= FRONT_ROOM and deep * s <= SECTION_ROOM), SCALES[-1])


def _frame(sheet: Sheet) -> None:
    x, y = WIDTH - BORDER, HEIGHT - BORDER
    sheet.polyline([(BORDER, BORDER), (x, BORDER), (x, y), (BORDER, y)], "frame", closed=True)


def _front(sheet: Sheet, place: Placed, part: Part, solid: cq.Solid) -> None:
    if part.slot is not None:
        # It is cut into the back, which the front view does not show.
        slot = part.slot
        rows = outline_of_slot(slot) if slot.closed else outline_of_strip(slot.width, slot.disc_radius, slot.direction)
        sheet.polyline(place(sample(rows)), "hidden", closed=True)
    draw_view(sheet, place, seen_from([solid], *FRONT))
    box, over = part.box, 5 / place.scale
    sheet.line(place.point(box[0] - over, 0), place.point(box[3] + over, 0), "axis")
    sheet.line(place.point(0, box[1] - 2 * over), place.point(0, box[4] + 2 * over), "axis")
    for y, outward in ((box[4] + 2 * over, 1), (box[1] - 2 * over, -1)):
        x, end = place.point(0, y)
        sheet.polyline([(x, end), (x, end + outward * 4)], "frame")
        sheet.line((x - 7, end), (x, end))
        sheet.arrow((x, end), 0.0)
        sheet.text((x - 8.5, end + 1.3), "A", 4.5, "end", bold=True)
    if part.bolts:
        sheet.circle(place.point(0, 0), place.scale * part.bolts.radius, "axis")
    if part.contour is not None and not isinstance(part.contour, Circle):
        low_x, low_y, high_x, high_y = part.contour.box
        left, bottom = place.point(low_x, 0)[0], place.point(0, low_y)[1]
        _boxed_dimension(sheet, place.point(0, low_y), place.point(0, high_y), left - 14, f"{high_y - low_y:.4f}", True)
        _boxed_dimension(
            sheet, place.point(low_x, 0), place.point(high_x, 0), bottom + 24, f"{high_x - low_x:.4f}", False
        )


def _boxed_dimension(
    sheet: Sheet, start: tuple[float, float], end: tuple[float, float], at: float, text: str, vertical: bool
) -> None:
    """A theoretically exact dimension: its number stands in a box."""
    sheet.dimension(start, end, at, text, vertical)
    label = sheet.labels[-1]
    half, (x, y) = text_width(text, TEXT) / 2 + 0.8, label.at
    box = (x - 3.1, y - half, x + 0.9, y + half) if vertical else (x - half, y - 3.1, x + half, y + 0.9)
    left, top, right, low = box
    sheet.polyline([(left, top), (right, top), (right, low), (left, low)], "thin", closed=True)


def _section(sheet: Sheet, place: Placed, part: Part, solid: cq.Solid) -> None:
    fill = sheet.hatch("section", "#30506a", 45, 1.9)
    for region in section_at_minor_axis_zero(solid):
        sheet.region(place(region.outer), [place(hole) for hole in region.holes], fill)
        _outline(sheet, place, region)
    draw_view(sheet, place, seen_from([half_behind_minor_axis_zero(solid)], *FROM_LEFT))
    box, over = part.box, 5 / place.scale
    sheet.line(place.point(part.bottom - over, 0), place.point(part.top + over, 0), "axis")
    top, bottom = place.point(0, box[4])[1], place.point(0, box[1])[1]
    middle = place.point((part.bottom + part.top) / 2, 0)[0]
    sheet.text((middle, top - 14), "A – A", 5, "middle", bold=True)
    draw_lengths(sheet, axial_spans(part), place.point(0, 0)[0], place.scale, bottom)
    _diameters(sheet, place, part)
    mark_details(sheet, part, place.point(0, 0), place.scale)
    draw_details(sheet, part, DETAILS)


def _outline(sheet: Sheet, place: Placed, region: Region) -> None:
    """The edges of a cut face, which are seen whatever lies behind it."""
    for ring in (region.outer, *region.holes):
        sheet.polyline(place(ring), "visible", closed=True)


def _diameters(sheet: Sheet, place: Placed, part: Part) -> None:
    """Diameters, a line each: holes on the left, rims on the right."""
    left, right = place.point(part.bottom, 0)[0], place.point(part.top, 0)[0]
    first = part.body[0]
    holes, rims = [], []
    if part.bore is not None:
        holes.append((part.bore.radius, 0.0))
    if isinstance(first, Prism) and isinstance(first.inner, Circle):
        holes.append((first.inner.radius, first.inner.offset))
    for piece in part.body:
        if isinstance(piece, Prism) and isinstance(piece.outline, Circle):
            rims.append((piece.outline.radius, piece.outline.offset, piece.bottom, piece.top))
    for row, (radius, offset) in enumerate(holes):
        start, end = (place.point(part.bottom, offset + sign * radius) for sign in (-1, 1))
        sheet.dimension(start, end, left - 12 - STACK * row, f"Ø{2 * radius:g}", True)
    for row, (radius, offset, _, top) in enumerate(dict.fromkeys(rims)):
        start, end = (place.point(top, offset + sign * radius) for sign in (-1, 1))
        sheet.dimension(start, end, right + 12 + STACK * row, f"Ø{2 * radius:.7g}", True)


def _column(sheet: Sheet, place: Placed, callouts: Sequence[Callout]) -> None:
    """The callouts one below the other, each with a number that stands in a ring at its feature too."""
    y = COLUMN_TOP
    tips = [place.point(*callout.at) for callout in callouts]
    ends = _balloon_places(tips, place.origin)
    for number, callout in enumerate(callouts, 1):
        tip, end = tips[number - 1], ends[number - 1]
        _balloon(sheet, (COLUMN_LEFT - 5, y - 1.2), number)
        sheet.line(tip, _toward(end, tip))
        sheet.arrow(tip, math.atan2(tip[1] - end[1], tip[0] - end[0]))
        _balloon(sheet, end, number)
        for line in callout.lines:
            sheet.text((COLUMN_LEFT, y), line, 2.9)
            y += COLUMN_STEP
        x = COLUMN_LEFT
        for text in callout.boxed:
            width = text_width(text, 2.9) + 2
            sheet.polyline([(x, y - 3.4), (x + width, y - 3.4), (x + width, y + 1), (x, y + 1)], "thin", closed=True)
            sheet.text((x + 1, y), text, 2.9)
            x += width + 2
        y += COLUMN_STEP if callout.boxed else 0.0
        for frame in callout.frames:
            sheet.frame((COLUMN_LEFT, y - 3.2), frame.symbol, frame.value, frame.datums)
            y += FRAME_HEIGHT + 1.2
        if callout.datum:
            _datum(sheet, (COLUMN_LEFT, y), callout.datum)
            y += 6.6
        y += 2.0


def _datum(sheet: Sheet, at: tuple[float, float], letter: str) -> None:
    """The letter of a datum feature in its box, with the triangle that stands on the feature."""
    x, y = at
    sheet.polyline([(x, y - 3.8), (x + 5, y - 3.8), (x + 5, y + 1.2), (x, y + 1.2)], "thin", closed=True)
    sheet.text((x + 2.5, y), letter, TEXT, "middle", bold=True)
    sheet.line((x + 5, y - 1.3), (x + 9, y - 1.3))
    sheet.marks.append(Solid(np.array([(x + 9, y - 1.3), (x + 11.6, y - 2.8), (x + 11.6, y + 0.2)])))


def _balloon(sheet: Sheet, centre: tuple[float, float], number: int) -> None:
    sheet.circle(centre, BALLOON, "thin", "#ffffff")
    sheet.text((centre[0], centre[1] + 1.0), str(number), 2.9, "middle")


def _toward(centre: Point, tip: Point) -> Point:
    """Where a line from `tip` to a balloon at `centre` meets its ring."""
    share = BALLOON / max(math.dist(centre, tip), BALLOON)
    return centre[0] + share * (tip[0] - centre[0]), centre[1] + share * (tip[1] - centre[1])


def _balloon_places(tips: Sequence[Point], centre: Point) -> list[Point]:
    """A place on a ring round the view for each tip, near its own direction, none nearer to another than `APART`.

    The directions of the cutting plane's letters and of the dimension lines stay free.
    """
    taken = [math.radians(angle) for angle in (-90, 90, 180)]
    places = []
    for tip in tips:
        wanted = math.atan2(tip[1] - centre[1], tip[0] - centre[0]) if math.dist(tip, centre) > 1e-6 else 0.0
        steps = (sign * step * math.radians(2) for step in range(90) for sign in (1, -1))
        angle = next(wanted + turn for turn in steps if all(_between(wanted + turn, other) >= APART for other in taken))
        taken.append(angle)
        reach = FRONT_ROOM / 2 + 9.0
        places.append((centre[0] + reach * math.cos(angle), centre[1] + reach * math.sin(angle)))
    return places


def _between(first: float, second: float) -> float:
    return abs(math.remainder(first - second, 2 * math.pi))


def _limits(sheet: Sheet, job: Job, part: Part) -> None:
    rows = [("dimension", "nominal", "deviations", "least", "largest")]
    for row in job.dimensions:
        if row.part != part.name or row.nominal is None:
            continue
        limits = ("", "")
        if row.lower is not None and row.upper is not None:
            limits = (f"{row.nominal + row.lower:.4f}", f"{row.nominal + row.upper:.4f}")
        rows.append((row.name, f"{row.nominal:.4f}", row.tolerance, *limits))
    top = TITLE_TOP + 2
    sheet.text((BORDER + 4, top - 2), "Limits", TEXT, bold=True)
    sheet.table((BORDER + 4, top), (62, 22, 70, 24, 24), rows, min(4.7, 66.0 / len(rows)))


def _mating(job: Job, number: int) -> Sheet:
    sheet = Sheet(WIDTH, HEIGHT, f"mating parts, {job.identity.title}", job.identity.description)
    _frame(sheet)
    fill_mating_sheet(sheet, job)
    _title(sheet, job, "mating parts", part_number(job, number), 1.0, None)
    return sheet


def _title(sheet: Sheet, job: Job, name: str, number: str, scale: float, part: Part | None) -> None:
    x, y, right, low = TITLE_LEFT, TITLE_TOP, WIDTH - BORDER, HEIGHT - BORDER
    sheet.polyline([(x, y), (right, y), (right, low), (x, low)], "frame", closed=True)
    ratio = f"{scale:g}:1" if scale >= 1 else f"1:{1 / scale:g}"
    sheet.text((x + 4, y + 8), name, 5.2, bold=True)
    sheet.text((x + 4, y + 14.5), job.identity.title, 3.4)
    lines = [
        f"number {number}   revision {job.identity.fingerprint}   date {moment().date().isoformat()}   scale {ratio}"
    ]
    if part is not None:
        made_of = material(part, job.options)
        lines += [made_of.label, made_of.hardness_label]
        weight, density = _weight(mass(part, job.options)), 1e6 * made_of.density
        lines.append(f"mass {weight} at {density:.4g} g/cm³   volume {part.volume:.2f} mm³")
    else:
        total = sum(mass(item, job.options) for item, _ in job.made)
        lines.append(f"mass of all parts {_weight(total)}")
    lines += [*NOTES, f"{job.identity.description}; first-angle projection"]
    for row, line in enumerate(lines):
        sheet.text((x + 4, y + 22 + 5.4 * row), line, SMALL)
    draw_first_angle(sheet, (right - 18, y + 9))


def _weight(kilograms: float) -> str:
    return f"{kilograms:.4g} kg" if kilograms >= 1 else f"{1e3 * kilograms:.4g} g"


def _assembly(job: Job) -> Sheet:
    """Section and exploded view of all parts, the parts list, and the budgets."""
    made = list(job.made)
    sheet = Sheet(WIDTH, HEIGHT, f"assembly, {job.identity.title}", job.identity.description)
    boxes = np.array([part.box for part, _ in made])
    tall, deep = float(np.ptp(boxes[:, [1, 4]])), float(np.ptp(boxes[:, [2, 5]]))
    scale = next((s for s in SCALES if tall * s <= 120 and deep * s <= 70), SCALES[-1])
    middle = float(boxes[:, 2].min() + boxes[:, 5].max()) / 2
    place = Placed((90.0 - scale * middle, 96.0), scale)
    _frame(sheet)
    for index, (part, solid) in enumerate(made):
        colour = "#" + "".join(f"{round(170 * share):02x}" for share in part.colour[:3])
        fill = sheet.hatch(f"part{index}", colour, 45 if index % 2 else -45, (1.7, 2.4, 3.0)[index % 3])
        for region in section_at_minor_axis_zero(solid):
            sheet.region(place(region.outer), [place(hole) for hole in region.holes], fill)
            _outline(sheet, place, region)
    draw_view(sheet, place, seen_from([half_behind_minor_axis_zero(solid) for _, solid in made], *FROM_LEFT))
    low, high = float(boxes[:, 2].min()), float(boxes[:, 5].max())
    bottom, top = place.point(0, float(boxes[:, 1].min()))[1], place.point(0, float(boxes[:, 4].max()))[1]
    sheet.text((90.0, top - 10), "A – A", 5, "middle", bold=True)
    edge = float(boxes[:, 1].min())
    sheet.dimension(place.point(low, edge), place.point(high, edge), bottom + 12, f"{high - low:g}", False)
    _numbers(sheet, place, made, top, bottom)
    draw_exploded(sheet, made, (255.0, 88.0), (150.0, 120.0))
    _parts_list(sheet, job)
    _budgets(sheet, job)
    _title(sheet, job, "wave generator, assembly", part_number(job, 0), scale, None)
    return sheet


def _numbers(sheet: Sheet, place: Placed, made: list[tuple[Part, cq.Solid]], top: float, bottom: float) -> None:
    """Each part's number in a ring beside the section, joined to the part."""
    right = max(place.point(part.top, 0)[0] for part, _ in made) + 14
    tips = []
    for number, (part, _) in enumerate(made, 1):
        first = part.body[0]
        reach = part.bore.reach if part.bore else 0.0
        outside = part.box[4]
        if isinstance(first, Prism):
            outside = first.outline.box[3]
            reach = first.inner.box[3] if first.inner is not None else reach
        x, y = place.point((first.bottom + first.top) / 2, (reach + outside) / 2)
        tips.append((y, x, number))
    for row, (y, x, number) in enumerate(sorted(tips)):
        end = top + (bottom - top) * (row + 0.5) / (2 * len(tips))
        sheet.line((x, y), _toward((right, end), (x, y)))
        _balloon(sheet, (right, end), number)


def _parts_list(sheet: Sheet, job: Job) -> None:
    rows = [("no.", "part", "number", "material", "mass, g")]
    for number, (part, _) in enumerate(job.made, 1):
        name = part.name.replace("_", " ")
        grams, made_of = f"{1e3 * mass(part, job.options):.4g}", material(part, job.options)
        rows.append(
            (f"{number}", name, part_number(job, number), made_of.with_hardness + " *" * made_of.assumed, grams)
        )
    thread = next((a.value for a in job.model.assumptions if a.key == "export.bolt_thread"), job.options.bolt_thread)
    hub = next((part for part, _ in job.made if part.name == "hub" and part.bolts), None)
    if hub is not None and hub.bolts is not None:
        rows.append((f"{len(rows)}", f"screw, {hub.bolts.count} off", f"ISO 4762 {thread}", "steel 8.8", ""))
    for part, _ in job.made:
        for piece in part.body:
            if isinstance(piece, Prism) and piece.groove is not None:
                ring = ring_of(piece.outline.perimeter / math.pi)
                rows.append((f"{len(rows)}", "retaining ring", ring.name if ring else "", "spring steel", ""))
    top = TITLE_TOP + 2
    sheet.text((BORDER + 4, top - 2), "Parts list (*: assumed, the study names no material)", TEXT, bold=True)
    sheet.table((BORDER + 4, top), (10, 50, 44, 88, 18), rows, min(4.7, 40.0 / len(rows)))


def _budgets(sheet: Sheet, job: Job) -> None:
    """The budgets, one line a share, on the right."""
    y = 22.0
    for budget in job.model.plan.budgets:
        values = budget.to_dict()
        spent = f"{values['spent']:.4g} of {values['allowed']:.4g} {values['unit']}"
        sheet.text((335, y), f"{budget.of.replace('_', ' ')}: {spent}", 2.6, bold=True)
        y += 4.6
        for share in values["shares"]:
            for line in (f"{share['part']}: {share['feature']}", f"   {share['callout']}: {share['takes']:.4g}"):
                sheet.text((335, y), line.replace("_", " "), 2.2)
                y += 3.6
        y += 3.0
