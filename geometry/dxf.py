"""DXF of the profile for wire cutting: closed outlines of tangent arcs in mm, a layer each, with the tolerance zone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.files import JsonReady
from hdopt.geometry.arcs import enclosed_area, outline_of, outline_of_bore, outline_of_slot, sample
from hdopt.geometry.check import PROFILE_TOLERANCE, CheckFailed
from hdopt.geometry.contour import Circle, Contour

if TYPE_CHECKING:
    from hdopt.geometry.job import Job
    from hdopt.geometry.part import ProfiledPart

MILLIMETRES = 4
"""$INSUNITS of a drawing in mm."""

AREA_TOLERANCE = 1e-9
"""Relative: what rounding leaves where an outline is made of exact arcs and lines."""

COLOURS = {"PROFILE": 7, "TOLERANCE": 1, "BORE": 5, "HOLES": 3, "SLOT": 6, "AXES": 8, "TEXT": 8}
"""AutoCAD colour numbers of the layers, by the first word of their names."""


@dataclass(frozen=True)
class Outline:
    """A closed outline of the drawing: its layer, what it is to follow, and its area in closed form."""

    layer: str
    rows: Array
    area: float
    contour: Contour | None = None


def outlines(part: ProfiledPart, zone: float, suffix: str = "") -> list[Outline]:
    """All outlines of a `part` that carries the bearing; `zone` is the full width of the profile's tolerance zone, mm,
    `suffix` the end of the layers' names."""

    def of(layer: str, contour: Contour) -> Outline:
        return Outline(layer, outline_of(contour), contour.area, contour)

    found = [
        of(f"PROFILE{suffix}", part.contour),
        of(f"TOLERANCE_OUTER{suffix}", part.contour.inward(-zone / 2)),
        of(f"TOLERANCE_INNER{suffix}", part.contour.inward(zone / 2)),
    ]
    if part.bore:
        found.append(Outline(f"BORE{suffix}", outline_of_bore(part.bore), part.bore.area_with_disc(0.0)))
    for inner in part.walls[1:]:
        found.append(of(f"BORE{suffix}", inner))
    if part.slot:
        found.append(Outline(f"SLOT{suffix}", outline_of_slot(part.slot), part.slot.area))
    if part.bolts:
        hole = Circle(part.bolts.hole / 2)
        for x, y in part.bolts.centres:
            found.append(Outline(f"HOLES{suffix}", outline_of(hole) + np.array([x, y, 0.0]), hole.area))
    return found


def all_outlines(job: Job) -> list[Outline]:
    """The outlines of the cam of a `job`, or of both discs with their names at the end of the layers'."""
    parts, zone = job.model.profiled, job.model.profile_zone
    if len(parts) == 1:
        return outlines(parts[0], zone)
    return [outline for part in parts for outline in outlines(part, zone, f"_{part.name.upper()}")]


def write_dxf(path: Path, job: Job) -> None:
    """Write the outlines of what carries the bearing in a `job` to `path`."""
    from ezdxf import units
    from ezdxf.filemanagement import new

    document = new("R2010", setup=["linetypes"], units=units.MM)
    document.header.custom_vars.append("hdopt", job.identity.description)
    space = document.modelspace()
    made = all_outlines(job)
    for layer in dict.fromkeys(["AXES", "TEXT", *(outline.layer for outline in made)]):
        line = {"AXES": "CENTER", "TOLERANCE": "DASHED"}.get(layer.split("_")[0], "CONTINUOUS")
        document.layers.add(layer, color=COLOURS[layer.split("_")[0]], linetype=line)
    for outline in made:
        space.add_lwpolyline(outline.rows.tolist(), format="xyb", close=True, dxfattribs={"layer": outline.layer})
    box = job.model.profiled[0].contour.box
    reach = 1.15 * max(box[3], box[2])
    for end in ((reach, 0), (0, reach)):
        space.add_line((-end[0], -end[1]), end, dxfattribs={"layer": "AXES"})
    height = reach / 25
    notes = (
        job.identity.title,
        job.identity.description,
        "mm; PROFILE is the cutting line, TOLERANCE_* bound the profile tolerance of "
        f"{job.model.profile_zone:g} mm; +y is the major axis",
    )
    for row, text in enumerate(notes):
        place = (-reach, -reach - (2 * row + 2) * height)
        space.add_text(text, height=height, dxfattribs={"layer": "TEXT"}).set_placement(place)
    document.saveas(path)


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
    largest, areas = 0.0, {}
    for outline, entity in zip(expected, found, strict=False):
        layer = entity.dxf.layer
        if layer != outline.layer:
            failures.append(f"an outline lies on the layer {layer}, not {outline.layer}")
        if not entity.closed:
            failures.append(f"the outline on {layer} is not closed")
        rows = np.array(entity.get_points("xyb"))
        area = enclosed_area(rows)
        areas[layer] = area
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
