"""DXF of every part for wire cutting: closed outlines of tangent arcs in mm, a layer each, with the tolerance zone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdopt.files import JsonReady
from hdopt.geometry.arcs import enclosed_area, sample
from hdopt.geometry.check import PROFILE_TOLERANCE, CheckFailed
from hdopt.geometry.cut_outlines import Outline, all_outlines
from hdopt.geometry.dxf_text import text_of

if TYPE_CHECKING:
    from hdopt.geometry.job import Job

MILLIMETRES = 4
"""$INSUNITS of a drawing in mm."""

AREA_TOLERANCE = 1e-9
"""Relative: what rounding leaves where an outline is made of exact arcs and lines."""

COLOURS = {"PROFILE": 7, "OUTLINE": 7, "TOLERANCE": 1, "BORE": 5, "HOLES": 3, "BLIND": 6, "AXES": 8, "TEXT": 8}
"""AutoCAD colour numbers of the layers, by the first word of their names."""


def write_dxf(path: Path, job: Job) -> None:
    """Write the outlines of all parts of a `job` to `path`, with notes of what is blind."""
    from ezdxf import units
    from ezdxf.filemanagement import new

    document = new("R2010", setup=["linetypes"], units=units.MM)
    document.header.custom_vars.append("hdopt", job.identity.description)
    space = document.modelspace()
    made = all_outlines(job)
    for layer in dict.fromkeys(["AXES", "TEXT", *(outline.layer for outline in made)]):
        line = {"AXES": "CENTER", "TOLERANCE": "DASHED", "BLIND": "DASHED"}.get(layer.split("_")[0], "CONTINUOUS")
        document.layers.add(layer, color=COLOURS[layer.split("_")[0]], linetype=line)
    for outline in made:
        space.add_lwpolyline(outline.rows.tolist(), format="xyb", close=True, dxfattribs={"layer": outline.layer})
    reach = 1.1 * float(np.abs(made[0].rows[:, :2]).max())
    for shift in dict.fromkeys(outline.shift for outline in made):
        own = np.concatenate([outline.rows for outline in made if outline.shift == shift])
        across = 1.1 * float(np.abs(own[:, 1]).max())
        space.add_line((shift - across, 0), (shift + across, 0), dxfattribs={"layer": "AXES"})
        space.add_line((shift, -across), (shift, across), dxfattribs={"layer": "AXES"})
    height = reach / 25
    for row, text in enumerate(_notes(job, made)):
        place = (-reach, -reach - (2 * row + 2) * height)
        space.add_text(text, height=height, dxfattribs={"layer": "TEXT"}).set_placement(place)
    path.write_text(text_of(document, job.identity.description), encoding="utf-8")


def _notes(job: Job, made: Sequence[Outline]) -> list[str]:
    """What stands below the outlines: the study, what the layers mean, and how far each blind one goes."""
    notes = [
        job.identity.title,
        job.identity.description,
        "mm; PROFILE is the cutting line, TOLERANCE_* bound the profile tolerance of "
        f"{job.model.profile_zone:g} mm; +y is the major axis; BLIND_* are not cut through",
    ]
    said = [f"{outline.part.replace('_', ' ')}, {outline.layer}: {outline.note}" for outline in made if outline.note]
    return [*notes, *dict.fromkeys(said)]


def check_dxf(path: Path, job: Job, name: str) -> JsonReady:
    """Read the file at `path` back and compare it with the `job`: unit, layers, closed outlines, their area, and their
    distance from the analytic curve.

    Returns the largest distance (um) and the areas by layer (mm^2); raises `CheckFailed`, which calls the file `name`,
    with all that is wrong.
    """
    from ezdxf.entities.lwpolyline import LWPolyline
    from ezdxf.filemanagement import readfile

    document = readfile(path)
    failures = []
    if document.header.get("$INSUNITS") != MILLIMETRES:
        failures.append("its unit is not the millimetre")
    if document.header.custom_vars.get("hdopt") != job.identity.description:
        failures.append("it does not name the study")
    expected = all_outlines(job)
    found = [entity for entity in document.modelspace() if isinstance(entity, LWPolyline)]
    if len(found) != len(expected):
        failures.append(f"it has {len(found)} outlines, not {len(expected)}")
    said = [entity.dxf.text for entity in document.modelspace().query("TEXT")]
    largest, areas = 0.0, {}
    for outline, entity in zip(expected, found, strict=False):
        layer = entity.dxf.layer
        if layer != outline.layer:
            failures.append(f"an outline lies on the layer {layer}, not {outline.layer}")
        if not entity.closed:
            failures.append(f"the outline on {layer} is not closed")
        rows = np.array(entity.get_points("xyb")) - np.array([outline.shift, 0.0, 0.0])
        area = enclosed_area(rows)
        areas[layer] = area
        if outline.note and not any(layer in text and outline.note in text for text in said):
            failures.append(f"it does not say of {layer} that it is {outline.note}")
        allowed = AREA_TOLERANCE * outline.area
        if outline.contour is not None:
            deviation = float(np.abs(outline.contour.deviation(sample(rows, (0.0, 0.2, 0.45, 0.7, 0.9)))).max())
            allowed += PROFILE_TOLERANCE * outline.contour.perimeter
            largest = max(largest, deviation)
            if not deviation <= PROFILE_TOLERANCE:
                failures.append(f"{layer} is {deviation * 1e3:.4g} um off the analytic curve")
        if not abs(area - outline.area) <= allowed:
            failures.append(f"{layer} encloses {area:.6f} mm^2; {outline.area:.6f} is right to {allowed:.1g}")
    if failures:
        raise CheckFailed(name, failures)
    return {"max_profile_deviation_um": largest * 1e3, "area_mm2": areas, "layers": sorted(areas)}
