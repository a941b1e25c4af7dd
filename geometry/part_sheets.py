"""Drawing sheets (A3): one for each part that is made, beside those of the assembly and of what mates with it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdopt.geometry.arcs import outline_of_slot, outline_of_strip, sample
from hdopt.geometry.assembly_sheet import assembly_sheet, draw_section
from hdopt.geometry.balloons import draw_balloon, places_around, point_out
from hdopt.geometry.callouts import Callout, callouts_of
from hdopt.geometry.chains import axial_lengths
from hdopt.geometry.contour import Circle
from hdopt.geometry.digits import drawn, plain
from hdopt.geometry.drawing import FRONT, SCALES, Placed, draw_view
from hdopt.geometry.materials import material
from hdopt.geometry.mating_drawing import fill_mating_sheet
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.sheet import FRAME_HEIGHT, TEXT, Sheet, Solid, text_width
from hdopt.geometry.sheet_details import draw_details, mark_details
from hdopt.geometry.sheet_lengths import STACK, draw_lengths
from hdopt.geometry.sheet_title import BORDER, HEIGHT, TITLE_TOP, WIDTH, draw_border, draw_title, part_number
from hdopt.geometry.step import ProductData
from hdopt.geometry.views import seen_from

if TYPE_CHECKING:
    import cadquery as cq

    from hdopt.geometry.dimensions import Dimension
    from hdopt.geometry.job import Job

FRONT_CENTRE, FRONT_ROOM = (92.0, 98.0), 116.0
SECTION_CENTRE, SECTION_ROOM = (216.0, 98.0), 44.0
COLUMN_LEFT, COLUMN_TOP, COLUMN_STEP = 282.0, 22.0, 5.0
DETAILS = (276.0, 149.0)
"""Upper left of the detail views."""


def sheets(job: Job) -> list[Sheet]:
    """The sheets of a `job`: the assembly, every part in the order of the parts list, what mating parts must keep."""
    made = job.made
    drawn = [assembly_sheet(job)]
    drawn += [_part_sheet(job, part, solid, number) for number, (part, solid) in enumerate(made, 1)]
    return [*drawn, _mating(job, len(made) + 1)]


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
    # A disc is drawn about its own axis, which lies off that of the wave generator.
    raised = scale * axis_of(part)
    front = Placed((FRONT_CENTRE[0], FRONT_CENTRE[1] + raised), scale)
    middle = (part.bottom + part.top) / 2
    section = Placed((SECTION_CENTRE[0] - scale * middle, SECTION_CENTRE[1] + raised), scale)
    draw_border(sheet)
    _front(sheet, front, part, solid)
    _section(sheet, section, part, solid, [row for row in job.dimensions if row.part == part.name])
    _column(sheet, front, callouts_of(part, job.model))
    _limits(sheet, job, part)
    draw_title(sheet, job, part.name.replace("_", " "), number, scale, part)
    return sheet


def axis_of(part: Part) -> float:
    """How far the axis of a `part` lies off that of the wave generator, along the major axis, mm."""
    return part.contour.offset if isinstance(part.contour, Circle) else 0.0


def _scale(part: Part) -> float:
    tall, deep = max(part.size[0], part.size[1]), part.size[2]
    return next((s for s in SCALES if tall * s <= FRONT_ROOM and deep * s <= SECTION_ROOM), SCALES[-1])


def _front(sheet: Sheet, place: Placed, part: Part, solid: cq.Solid) -> None:
    if part.slot is not None:
        # It is cut into the back, which the front view does not show.
        slot = part.slot
        rows = outline_of_slot(slot) if slot.closed else outline_of_strip(slot.width, slot.disc_radius, slot.direction)
        sheet.polyline(place(sample(rows)), "hidden", closed=True)
    draw_view(sheet, place, seen_from([solid], *FRONT))
    box, over, axis = part.box, 5 / place.scale, axis_of(part)
    sheet.line(place.point(box[0] - over, axis), place.point(box[3] + over, axis), "axis")
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


def _section(sheet: Sheet, place: Placed, part: Part, solid: cq.Solid, rows: Sequence[Dimension]) -> None:
    draw_section(sheet, place, [(part, solid)])
    box, over, axis = part.box, 5 / place.scale, axis_of(part)
    sheet.line(place.point(part.bottom - over, axis), place.point(part.top + over, axis), "axis")
    top, bottom = place.point(0, box[4])[1], place.point(0, box[1])[1]
    middle = place.point((part.bottom + part.top) / 2, 0)[0]
    sheet.text((middle, top - 14), "A – A", 5, "middle", bold=True)
    draw_lengths(sheet, axial_lengths(part), (place.point(0, 0)[0], bottom), place.scale, rows)
    _diameters(sheet, place, part, rows)
    mark_details(sheet, part, place.point(0, 0), place.scale)
    draw_details(sheet, part, DETAILS)


def _diameters(sheet: Sheet, place: Placed, part: Part, rows: Sequence[Dimension]) -> None:
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
        sheet.dimension(start, end, left - 12 - STACK * row, f"Ø{drawn(2 * radius, rows)}", True)
    for row, (radius, offset, _, top) in enumerate(dict.fromkeys(rims)):
        start, end = (place.point(top, offset + sign * radius) for sign in (-1, 1))
        sheet.dimension(start, end, right + 12 + STACK * row, f"Ø{drawn(2 * radius, rows)}", True)


def _column(sheet: Sheet, place: Placed, callouts: Sequence[Callout]) -> None:
    """The callouts one below the other, each with a number that stands in a ring at its feature too."""
    y = COLUMN_TOP
    tips = [place.point(*callout.at) for callout in callouts]
    ends = places_around(sheet, tips, FRONT_CENTRE, FRONT_ROOM / 2 + 9.0)
    for number, (callout, tip, end) in enumerate(zip(callouts, tips, ends, strict=True), 1):
        draw_balloon(sheet, (COLUMN_LEFT - 5, y - 1.2), number)
        point_out(sheet, tip, end, number, callout.on_face)
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


def _limits(sheet: Sheet, job: Job, part: Part) -> None:
    rows = [("dimension", "nominal", "deviations", "least", "largest")]
    for row in job.dimensions:
        if row.part != part.name or row.nominal is None:
            continue
        limits = ("", "")
        if row.lower is not None and row.upper is not None:
            limits = (plain(row.nominal + row.lower), plain(row.nominal + row.upper))
        rows.append((row.name, plain(row.nominal), row.tolerance, *limits))
    top = TITLE_TOP + 2
    sheet.text((BORDER + 4, top - 2), "Limits", TEXT, bold=True)
    sheet.table((BORDER + 4, top), (62, 22, 70, 24, 24), rows, min(4.7, 66.0 / len(rows)))


def _mating(job: Job, number: int) -> Sheet:
    sheet = Sheet(WIDTH, HEIGHT, f"mating parts, {job.identity.title}", job.identity.description)
    draw_border(sheet)
    fill_mating_sheet(sheet, job)
    draw_title(sheet, job, "mating parts", number, None)
    return sheet
