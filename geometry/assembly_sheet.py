"""The sheet of the assembly: section with the numbers of the parts list, parts pulled apart, budgets."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdopt.geometry.balloons import point_out
from hdopt.geometry.bought import HeldRing, Screws, bought
from hdopt.geometry.digits import auxiliary
from hdopt.geometry.drawing import FROM_LEFT, SCALES, Placed, draw_exploded, draw_view
from hdopt.geometry.materials import mass, material
from hdopt.geometry.mating_drawing import ERRORS
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.sheet import TEXT, Point, Sheet, Solid
from hdopt.geometry.sheet_title import BORDER, HEIGHT, TITLE_TOP, WIDTH, draw_border, draw_title, part_number
from hdopt.geometry.views import half_behind_minor_axis_zero, section_at_minor_axis_zero, seen_from

if TYPE_CHECKING:
    import cadquery as cq

    from hdopt.geometry.job import Job

MIDDLE, ROOM = (90.0, 96.0), (70.0, 120.0)
"""Of the section."""

BUDGETS = (332.0, 22.0)
"""Upper left of the budgets."""


def assembly_sheet(job: Job) -> Sheet:
    """The sheet of a `job`: section and exploded view of all parts, the parts list, and the budgets."""
    made = list(job.made)
    sheet = Sheet(WIDTH, HEIGHT, f"assembly, {job.identity.title}", job.identity.description)
    boxes = np.array([part.box for part, _ in made])
    tall, deep = float(np.ptp(boxes[:, [1, 4]])), float(np.ptp(boxes[:, [2, 5]]))
    scale = next((s for s in SCALES if tall * s <= ROOM[1] and deep * s <= ROOM[0]), SCALES[-1])
    low, high = float(boxes[:, 2].min()), float(boxes[:, 5].max())
    edge = float(boxes[:, 1].min())
    place = Placed((MIDDLE[0] - scale * (low + high) / 2, MIDDLE[1]), scale)
    bottom, top = place.point(0, edge)[1], place.point(0, float(boxes[:, 4].max()))[1]
    draw_border(sheet)
    draw_section(sheet, place, made)
    sheet.text((MIDDLE[0], top - 10), "section along the major axis", 3.6, "middle", bold=True)
    over = 5 / scale
    sheet.line(place.point(low - over, 0), place.point(high + over, 0), "axis")
    # The parts' own lengths make it.
    sheet.dimension(place.point(low, edge), place.point(high, edge), bottom + 12, auxiliary(high - low), False)
    _numbers(sheet, place, job, (top, bottom))
    draw_exploded(sheet, made, (255.0, 88.0), (146.0, 120.0))
    _parts_list(sheet, job)
    _budgets(sheet, job)
    draw_title(sheet, job, "wave generator, assembly", 0, scale)
    return sheet


def draw_section(sheet: Sheet, place: Placed, made: Sequence[tuple[Part, cq.Solid]]) -> None:
    """The section of the parts `made`, (part, solid), on the `sheet` at `place`, hatched, with what lies behind it."""
    for index, (part, solid) in enumerate(made):
        colour = "#30506a" if len(made) == 1 else "#" + "".join(f"{round(170 * c):02x}" for c in part.colour[:3])
        pitch = 1.9 if len(made) == 1 else (1.7, 2.4, 3.0)[index % 3]
        fill = sheet.hatch(f"section{index}", colour, -45 if index % 2 else 45, pitch)
        for region in section_at_minor_axis_zero(solid):
            sheet.region(place(region.outer), [place(hole) for hole in region.holes], fill)
            # The edges of a cut face are seen whatever lies behind it.
            for ring in (region.outer, *region.holes):
                sheet.polyline(place(ring), "visible", closed=True)
    draw_view(sheet, place, seen_from([half_behind_minor_axis_zero(solid) for _, solid in made], *FROM_LEFT))


def _numbers(sheet: Sheet, place: Placed, job: Job, rows: tuple[float, float]) -> None:
    """Each part's number in a ring beside the section, between the `rows` (y of the highest and the lowest), joined to
    the part."""
    made = job.made
    right = max(place.point(part.top, 0)[0] for part, _ in made) + 16
    tips = [(_inside(part, place), number) for number, (part, _) in enumerate(made, 1)]
    for number, item in enumerate(bought(job), len(made) + 1):
        draw = _screw if isinstance(item, Screws) else _ring
        tips.append((draw(sheet, place, item), number))  # type: ignore[arg-type]  # each draws its own kind
    top, bottom = rows
    pitch = min(12.0, (bottom - top) / len(tips))
    ends = [(right, top + pitch * (row + 0.5)) for row in range(len(tips))]
    for (tip, number), end in zip(uncrossed(tips, ends), ends, strict=True):
        point_out(sheet, tip, end, number, on_face=True)


def uncrossed(tips: Sequence[tuple[Point, int]], ends: Sequence[Point]) -> list[tuple[Point, int]]:
    """The `tips`, (point, number), in an order in which the lines to the `ends`, from the highest down, do not cross.

    Two lines that cross are longer together than with their ends changed, so that changing them comes to an end.
    """
    order = sorted(tips, key=lambda tip: tip[0][1])
    pairs = list(itertools.combinations(range(len(order)), 2))
    while True:
        crossing = [(i, j) for i, j in pairs if _cross(order[i][0], ends[i], order[j][0], ends[j])]
        if not crossing:
            return order
        i, j = crossing[0]
        order[i], order[j] = order[j], order[i]


def _cross(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether the lines from a to b and from c to d meet between their ends."""

    def side(p: Point, q: Point, r: Point) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    return side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0


def _inside(part: Part, place: Placed) -> Point:
    """A point of the section of a `part`, above the axis."""
    first = part.body[0]
    reach = part.bore.reach if part.bore else 0.0
    outside = part.box[4]
    if isinstance(first, Prism):
        outside = first.outline.box[3]
        reach = first.inner.box[3] if first.inner is not None else reach
    low = first.bottom if part.slot is None or part.slot.closed else first.bottom + part.slot.depth
    return place.point((low + first.top) / 2, (reach + outside) / 2)


def _screw(sheet: Sheet, place: Placed, screws: Screws) -> Point:
    """The axes of the `screws`, turned into the section, as drawings show what is screwed; returns where one lies."""
    over = 4 / place.scale
    for y in (screws.radius, -screws.radius):
        sheet.line(place.point(screws.bottom - over, y), place.point(screws.top + over, y), "axis")
    return place.point(screws.top + over / 2, screws.radius)


def _ring(sheet: Sheet, place: Placed, held: HeldRing) -> Point:
    """Both cuts through a retaining ring, filled, as thin sections are; returns a point of the upper one."""
    ring, wide = held.ring, held.ring.width
    for side in (-1, 1):
        low, high = held.offset + side * ring.groove / 2, held.offset + side * (ring.groove / 2 + wide)
        corners = [(held.bottom, low), (held.bottom + ring.thickness, low), (held.bottom + ring.thickness, high)]
        sheet.marks.append(Solid(place([*corners, (held.bottom, high)])))
    return place.point(held.bottom + ring.thickness, held.offset + ring.groove / 2 + 0.7 * wide)


def _parts_list(sheet: Sheet, job: Job) -> None:
    rows = [("no.", "part", "number", "material", "mass, g")]
    for number, (part, _) in enumerate(job.made, 1):
        name = part.name.replace("_", " ")
        grams, made_of = f"{1e3 * mass(part, job.options):.4g}", material(part, job.options)
        words = made_of.with_hardness + " *" * made_of.assumed
        rows.append((f"{number}", name, part_number(job, number), words, grams))
    rows += [(f"{number}", *item.words, "") for number, item in enumerate(bought(job), len(rows))]
    top = TITLE_TOP + 2
    sheet.text((BORDER + 4, top - 2), "Parts list (*: assumed, the study names no material)", TEXT, bold=True)
    sheet.table((BORDER + 4, top), (10, 50, 44, 88, 18), rows, min(4.7, 40.0 / len(rows)))


def _budgets(sheet: Sheet, job: Job) -> None:
    """The budgets, one line a share, on the right."""
    x, y = BUDGETS
    for budget in job.model.plan.budgets:
        values = budget.to_dict()
        spent = f"{values['spent']:.4g} of {values['allowed']:.4g} {values['unit']}"
        sheet.text((x, y), ERRORS[budget.of], 2.6, bold=True)
        sheet.text((x, y + 4.2), spent if budget.met else f"{spent}: NOT KEPT", 2.6, bold=True)
        y += 8.8
        for share in values["shares"]:
            for line in (f"{share['part']}: {share['feature']}", f"   {share['callout']}: {share['takes']:.4g}"):
                sheet.text((x, y), line.replace("_", " "), 2.2)
                y += 3.6
        y += 3.0
