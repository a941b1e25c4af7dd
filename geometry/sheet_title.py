"""What every drawing sheet has: its size and border, its title block, and the numbers of parts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hdopt.geometry.drawing import draw_first_angle
from hdopt.geometry.materials import mass, material
from hdopt.geometry.part import Part
from hdopt.geometry.sheet import SMALL, Sheet
from hdopt.moment import moment

if TYPE_CHECKING:
    from hdopt.geometry.job import Job

WIDTH, HEIGHT, BORDER = 420.0, 297.0, 10.0
TITLE_LEFT, TITLE_TOP = 232.0, 209.0

NOTES = (
    "general tolerances: lengths ISO 2768-1 m; ISO 22081: profile of a surface 0.1 to the first datum",
    "edges ISO 13715: outside -0.1 to -0.3, inside +0.2 max; surfaces Ra 1.6 where not said otherwise",
    "ISO 8015; datums ISO 5459; frames ISO 1101, ISO 1660; boxed: theoretically exact; "
    "in parentheses: auxiliary; mm; 20 °C",
)


def part_number(job: Job, number: int) -> str:
    """Number of a part of a `job`: the study's own or the fingerprint, and its `number` in the parts list (0: the
    assembly)."""
    return f"{job.options.part_number or f'WG-{job.identity.fingerprint[:8].upper()}'}-{number:02d}"


def draw_border(sheet: Sheet) -> None:
    """The border of a `sheet`."""
    x, y = WIDTH - BORDER, HEIGHT - BORDER
    sheet.polyline([(BORDER, BORDER), (x, BORDER), (x, y), (BORDER, y)], "frame", closed=True)


def draw_title(sheet: Sheet, job: Job, name: str, number: int, scale: float | None, part: Part | None = None) -> None:
    """The title block of a `job` on a `sheet`: what is drawn is called `name` and has this `number` in the parts list.

    `scale` is that of its views, None for a sheet of words; with a `part`, its material, hardness and mass.
    """
    x, y, right, low = TITLE_LEFT, TITLE_TOP, WIDTH - BORDER, HEIGHT - BORDER
    sheet.polyline([(x, y), (right, y), (right, low), (x, low)], "frame", closed=True)
    sheet.text((x + 4, y + 8), name, 5.2, bold=True)
    sheet.text((x + 4, y + 14.5), job.identity.title, 3.4)
    said = f"number {part_number(job, number)}   revision {job.identity.fingerprint}   date {moment().date()}"
    lines = [said if scale is None else f"{said}   scale {ratio(scale)}"]
    if part is not None:
        made_of = material(part, job.options)
        lines += [made_of.label, made_of.hardness_label]
        weight, density = _weight(mass(part, job.options)), 1e6 * made_of.density
        lines.append(f"mass {weight} at {density:.4g} g/cm³   volume {part.volume:.2f} mm³")
    elif scale is not None:
        total = sum(mass(item, job.options) for item, _ in job.made)
        lines.append(f"mass of the parts that are made {_weight(total)}")
    lines += [*(NOTES if scale is not None else NOTES[2:]), f"{job.identity.description}; first-angle projection"]
    for row, line in enumerate(lines):
        sheet.text((x + 4, y + 22 + 5.4 * row), line, SMALL)
    draw_first_angle(sheet, (right - 18, y + 9))


def ratio(scale: float) -> str:
    """A `scale` as drawings write it."""
    return f"{scale:g}:1" if scale >= 1 else f"1:{1 / scale:g}"


def _weight(kilograms: float) -> str:
    return f"{kilograms:.4g} kg" if kilograms >= 1 else f"{1e3 * kilograms:.4g} g"
