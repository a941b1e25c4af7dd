"""The sheet of what shaft, housing and bearing seats must keep, which goes to whoever makes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

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

NOTES = (
    "Largest values, in the worst case; all rows of one error together take no more than its bound.",
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
    for row, line in enumerate(_sums(job.mating)):
        sheet.text((LEFT, bottom + 19 + 6 * row), line, TEXT)


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


def _sums(rows: tuple[MatingRow, ...]) -> list[str]:
    lines = []
    for error, name in ERRORS.items():
        taken = [row for row in rows if row.feeds == error and row.takes is not None]
        if taken:
            lines.append(f"{name}: {sum(row.takes or 0.0 for row in taken):.4g} {taken[0].unit}")
    return lines
