"""The wave generator as it is to be made: drawing, picture, key dimensions, and what the check of its files found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any  # Any: values of JSON

import pandas as pd

from hdopt.report import Download, Item, KeyFigures, Picture, Section, Table, Text
from hdopt.report.cells import NAMES

if TYPE_CHECKING:
    from hdopt.geometry.export import ExportResult


FILES = {
    "step": "The parts as solids (STEP).",
    "dxf": "The profile for wire cutting (DXF).",
    "svg": "The drawing at its own size, with every dimension: opens in a new tab.",
}
"""Files of an export that travel in the page, and what they are."""


def geometry_section(
    result: ExportResult, files: Mapping[str, str], picture_png: bytes | None = None, *, key: str = "geometry"
) -> Section:
    """The section of an export that gave `result`: the text of its `files` by format, "svg" the drawing, and
    `picture_png` (bytes; None for no picture) as the export wrote them. `key` begins the keys of its figures and
    tables."""
    from hdopt.geometry.drawing import views_alone

    values = result.to_dict()
    made = [part for part in values["parts"] if not part["context"]]
    figures = {"Parts": str(len(made)), "Fingerprint": result.identity.fingerprint}
    if result.profile_deviation_um is not None:
        figures["Profile in the files, off the analytic curve"] = deviation_words(result.profile_deviation_um)
    items: list[Item] = [KeyFigures(figures)]
    items.append(
        Picture(
            f"{key}-drawing",
            "Wave generator",
            views_alone(files["svg"]),
            "Front view, section through the major axis, parts pulled apart. Lengths in mm.",
        )
    )
    items += [
        Download(f"wave-generator.{kind}", files[kind], what, opens=kind == "svg")
        for kind, what in FILES.items()
        if kind in files
    ]
    if picture_png is not None:
        items.append(Picture(f"{key}-picture", "Parts, pulled apart along the axis", picture_png))
    items += [_parts(key, made), _dimensions(key, result), *_assumptions(key, result)]
    unmet = [budget.verdict for budget in result.model.plan.budgets if not budget.met]
    items += [Text(verdict[0].upper() + verdict[1:] + ".") for verdict in unmet]
    items += [Text(note[0].upper() + note[1:] + ".") for note in values["notes"]]
    return Section(key, "Wave generator to be made", tuple(items), _summary(values))


def _summary(values: Mapping[str, Any]) -> str:
    files = ", ".join(kind.upper() for kind in values["files"])
    if not files:
        return "The parts, their key dimensions and the tolerances that the study allows them."
    return (
        f"The parts, their key dimensions and the tolerances that the study allows them. Every file ({files}) was read "
        "back from disk and compared with closed-form values before it was given its name."
    )


def deviation_words(deviation_um: float) -> str:
    """The largest `deviation_um` of a profile in a file, in words: below a nanometre it is rounding."""
    return "<0.001 µm" if deviation_um < 1e-3 else f"≤{deviation_um:.2g} µm"


def _parts(key: str, made: Sequence[Mapping[str, Any]]) -> Table:
    rows = [(_words(part["name"]), part["volume_mm3"], *part["bounding_box_mm"]) for part in made]
    frame = pd.DataFrame(rows, columns=["part", "volume [mm³]", "x [mm]", "y [mm]", "z [mm]"])
    return Table(f"{key}-parts", "Parts", frame, "Volume and extents as measured in the file.")


def _dimensions(key: str, result: ExportResult) -> Table:
    rows = [(_words(row.part), row.name, row.nominal, row.tolerance, row.source) for row in result.dimensions]
    frame = pd.DataFrame(rows, columns=["part", "dimension", "nominal [mm]", "tolerance", "from"])
    caption = "Tolerances are those of the study, or of its allocation; the last column says where each comes from."
    return Table(f"{key}-dimensions", "Key dimensions", frame, caption, {"nominal [mm]": ".4f", "from": NAMES})


def _assumptions(key: str, result: ExportResult) -> list[Table]:
    if not result.model.assumptions:
        return []
    rows = [(assumption.key, assumption.written, assumption.reason) for assumption in result.model.assumptions]
    frame = pd.DataFrame(rows, columns=["key", "value", "why"])
    caption = "Give a key in the study's [export] section to replace it."
    return [Table(f"{key}-assumed", "Sizes that the study does not give", frame, caption)]


def _words(name: str) -> str:
    return name.replace("_", " ")
