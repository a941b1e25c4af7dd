"""Drawing sheets as a PDF, a page each, in true size."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: settings that Matplotlib takes and its types refuse

import numpy as np

from hdopt.geometry.sheet import INK, KINDS, Area, Hatch, Label, Line, Ring, Sheet, Solid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INCH, POINT = 25.4, 25.4 / 72
"""mm."""


def write_pdf(path: Path, sheets: Sequence[Sheet]) -> None:
    """Write the `sheets`, one at least, as pages of a PDF at `path`; text stays text, with its font in the file."""
    import matplotlib
    from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages
    from matplotlib.figure import Figure

    stated = {"Title": sheets[0].title, "Subject": sheets[0].description, "CreationDate": None}
    settings: Any = {"pdf.fonttype": 42, "font.family": "DejaVu Sans", "hatch.linewidth": 0.5}
    with matplotlib.rc_context(settings), PdfPages(path, metadata=stated) as pages:
        for sheet in sheets:
            figure = Figure(figsize=(sheet.width / INCH, sheet.height / INCH))
            FigureCanvasPdf(figure)
            axes = figure.add_axes((0, 0, 1, 1))
            axes.set_xlim(0, sheet.width)
            axes.set_ylim(sheet.height, 0)
            axes.axis("off")
            for order, mark in enumerate(sheet.marks):
                _draw(axes, mark, sheet, order)
            pages.savefig(figure)


def _pen(kind: str) -> dict[str, Any]:
    line = KINDS[kind]
    width = line.width / POINT
    dashes: Any = (0, tuple(dash / POINT for dash in line.dashes)) if line.dashes else "solid"
    return {"color": line.colour, "linewidth": width, "linestyle": dashes}


def _draw(axes: Axes, mark: object, sheet: Sheet, order: int) -> None:
    from matplotlib.patches import Circle, Polygon

    if isinstance(mark, Line):
        points = np.vstack([mark.points, mark.points[:1]]) if mark.closed else mark.points
        axes.plot(points[:, 0], points[:, 1], solid_capstyle="round", zorder=order, **_pen(mark.kind))
    elif isinstance(mark, Ring):
        pen = _pen(mark.kind)
        colour = pen.pop("color")
        filled = mark.fill != "none"
        face = mark.fill if filled else "none"
        axes.add_patch(Circle(mark.centre, mark.radius, facecolor=face, edgecolor=colour, zorder=order, **pen))
    elif isinstance(mark, Solid):
        axes.add_patch(Polygon(mark.points, closed=True, facecolor=INK, edgecolor="none", zorder=order))
    elif isinstance(mark, Area):
        _hatched(axes, mark, sheet.hatches[mark.hatch], order)
    elif isinstance(mark, Label):
        align = {"start": "left", "middle": "center", "end": "right"}[mark.anchor]
        axes.text(
            *mark.at,
            mark.content,
            fontsize=mark.size / POINT,
            ha=align,
            va="baseline",
            rotation=-mark.turn,
            rotation_mode="anchor",
            fontweight="bold" if mark.bold else "normal",
            color=mark.colour,
            parse_math=False,
            zorder=order,
        )


def _hatched(axes: Axes, mark: Area, hatch: Hatch, order: int) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    rings = [Outline(np.vstack([ring, ring[:1]]), closed=True) for ring in (mark.outer, *mark.holes)]
    slash = "/" if hatch.angle > 0 else "\\"
    patch = PathPatch(
        Outline.make_compound_path(*rings),
        facecolor="none",
        edgecolor=hatch.colour,
        linewidth=0,
        zorder=order,
        hatch=slash * (3 if hatch.pitch > 2 else 4),
    )
    axes.add_patch(patch)
