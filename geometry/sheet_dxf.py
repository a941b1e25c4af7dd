"""A drawing sheet as a DXF in mm, true size: a layer for each kind of line, text as text."""

from __future__ import annotations

import math

from hdopt.geometry.dxf_text import text_of
from hdopt.geometry.sheet import KINDS, Area, Label, Line, Ring, Sheet, Solid

CAP_SHARE = 0.73
"""Height of a capital over the font size: what DXF calls a text's height."""

LINETYPES = {"hidden": "DASHED", "axis": "CENTER"}


def dxf_of(sheet: Sheet) -> str:
    """Text of the DXF of a `sheet`, in mm; y points up there."""
    from ezdxf import units
    from ezdxf.enums import TextEntityAlignment
    from ezdxf.filemanagement import new

    document = new("R2010", setup=["linetypes", "styles"], units=units.MM)
    space = document.modelspace()
    for name, kind in KINDS.items():
        document.layers.add(
            name.upper(), linetype=LINETYPES.get(name, "CONTINUOUS"), lineweight=round(100 * kind.width)
        )
    for name in ("TEXT", "HATCH", "ARROWS"):
        document.layers.add(name)
    document.styles.add("DRAWING", font="DejaVuSans.ttf")
    up = sheet.height
    align = {
        "start": TextEntityAlignment.LEFT,
        "middle": TextEntityAlignment.CENTER,
        "end": TextEntityAlignment.RIGHT,
    }
    for mark in sheet.marks:
        if isinstance(mark, Line):
            points = [(x, up - y) for x, y in mark.points.tolist()]
            space.add_lwpolyline(points, close=mark.closed, dxfattribs={"layer": mark.kind.upper()})
        elif isinstance(mark, Ring):
            centre = (mark.centre[0], up - mark.centre[1])
            space.add_circle(centre, mark.radius, dxfattribs={"layer": mark.kind.upper()})
        elif isinstance(mark, Solid):
            filled = space.add_hatch(dxfattribs={"layer": "ARROWS"})
            filled.paths.add_polyline_path([(x, up - y) for x, y in mark.points.tolist()], is_closed=True)
        elif isinstance(mark, Area):
            hatch = space.add_hatch(dxfattribs={"layer": "HATCH"})
            style = sheet.hatches[mark.hatch]
            hatch.set_pattern_fill(
                "ANSI31", scale=style.pitch / math.sqrt(2) / 2.2, angle=90.0 if style.angle < 0 else 0.0
            )
            for ring in (mark.outer, *mark.holes):
                hatch.paths.add_polyline_path([(x, up - y) for x, y in ring.tolist()], is_closed=True)
        elif isinstance(mark, Label):
            text = space.add_text(
                mark.content,
                height=CAP_SHARE * mark.size,
                rotation=-mark.turn,
                dxfattribs={"layer": "TEXT", "style": "DRAWING"},
            )
            text.set_placement((mark.at[0], up - mark.at[1]), align=align[mark.anchor])
    return text_of(document, f"{sheet.title}, {sheet.description}")
