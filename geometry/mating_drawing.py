"""The sheet of what shaft, housing and bearing seats must keep, which goes to whoever makes them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from hdopt.geometry.budget import bounds_from
from hdopt.geometry.mating import MatingRow
from hdopt.geometry.sheet import SMALL, TEXT, Sheet, text_width

if TYPE_CHECKING:
    from hdopt.geometry.job import Job

LEFT, TOP, ROW = 20.0, 62.0, 7.0
WIDTHS = (28.0, 108.0, 118.0, 26.0, 22.0, 42.0, 36.0)
HEADING = ("part", "feature", "requirement", "value, mm", "over, mm", "feeds", "takes")

ERRORS = {
    "axis_eccentricity": "e1, eccentricity of the input axis",
    "axis_tilt": "β2, β3, tilt of the input axis",
    "wg_eccentricity": "e2, eccentricity of the wave generator",
    "wg_tilt": "α2, α3, tilt of the wave generator",
}
"""Error of the model -> how the theory writes it."""

AXIS_KEYS = {
    "axis_eccentricity": ("axis_eccentricity_mm",),
    "axis_tilt": ("axis_tilt_y_deg", "axis_tilt_x_deg"),
}
"""Errors of the input axis -> the study's bounds of them; the least counts."""

NOTES = (
    "Largest values, in the worst case; whether all rows of one error together keep its bound is said with the sums.",
    "Circular spline and shaft are assembled within these values; the wave generator's parts have their own sheets.",
)


def fill_mating_sheet(sheet: Sheet, job: Job) -> None:
    """Draw the rows of a `job` on an empty `sheet`, with the sum that the rows of each error take."""
    sheet.text((LEFT, 26), "What shaft, housing and bearing seats must keep", 6.0, bold=True)
    for row, line in enumerate(NOTES):
        sheet.text((LEFT, 35 + 6 * row), line, TEXT)
    rows = [HEADING, *(_cells(row) for row in job.mating)]
    bottom = sheet.table((LEFT, TOP - 8), WIDTHS, rows, ROW)
    sheet.text((LEFT, bottom + 12), "Sums", TEXT, bold=True)
    for row, (line, kept) in enumerate(sums(job.mating, allowed(job))):
        sheet.text((LEFT, bottom + 19 + 6 * row), line, TEXT, bold=not kept)


def _cells(row: MatingRow) -> tuple[str, ...]:
    value, over = (("" if number is None else f"{number:.4g}") for number in (row.value_mm, row.over_mm))
    takes = "" if row.takes is None else f"{row.takes:.4g} {row.unit}"
    feeds = row.feeds.replace("_", " ").replace("wg", "wave generator")
    cells = (row.part, row.feature, row.requirement, value, over, feeds, takes)
    return tuple(_fitted(cell, width) for cell, width in zip(cells, WIDTHS, strict=True))


def _fitted(cell: str, width: float) -> str:
    """The text of a `cell`, cut where it is wider than its column."""
    while cell and text_width(cell, SMALL) > width - 3:
        cell = cell[:-2].rstrip() + "…"
    return cell


def allowed(job: Job) -> dict[str, float]:
    """What the study of a `job` allows of each error (mm or deg), by its name; errors that nothing bounds are left
    out."""
    given = bounds_from(job.bounds, job.contributors)
    found = {"wg_eccentricity": given.eccentricity, "wg_tilt": None if given.tilt is None else math.degrees(given.tilt)}
    fed = {spec.get("feeds") for spec in job.contributors.values()}
    for error, keys in AXIS_KEYS.items():
        # A study's own callouts are what the error is made of: nothing else bounds it.
        bounds = [job.bounds[key] for key in keys if key in job.bounds] if error not in fed else []
        found[error] = min(bounds, default=None)
    return {error: bound for error, bound in found.items() if bound is not None}


def sums(rows: Sequence[MatingRow], bounds: Mapping[str, float]) -> list[tuple[str, bool]]:
    """What the `rows` of each error take together against its bound, and whether that is kept; true where `bounds` (mm
    or deg, by error) gives none."""
    lines = []
    for error, name in ERRORS.items():
        taken = [row for row in rows if row.feeds == error and row.takes is not None]
        if not taken:
            continue
        spent, unit = sum(row.takes or 0.0 for row in taken), taken[0].unit
        said = f"{name}: {spent:.4g} {unit}"
        bound = bounds.get(error)
        if bound is None:
            lines.append((f"{said}; the study gives no bound", True))
            continue
        kept = spent <= bound * (1 + 1e-5)
        lines.append((f"{said}, {'within' if kept else 'BEYOND'} the bound of {bound:.4g} {unit}", kept))
    return lines
