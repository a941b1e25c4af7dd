"""A map of one quantity over two design variables, with the design on it and the lines that bound it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any  # Any: Plotly's dictionaries and traces, which have no types

import numpy as np

from hdopt.arrays import Array
from hdopt.report import Figure, Section
from hdopt.report.theme import GREEN, INK, PAPER, PURPLE, SEQUENTIAL, VERMILLION, figure

if TYPE_CHECKING:
    import plotly.graph_objects as go

LIMIT_COLOURS = (VERMILLION, GREEN, PURPLE)


@dataclass(frozen=True)
class Limit:
    """A line on the map: where `values`, on the map's grid, equal `limit`. `name` stands in the legend."""

    name: str
    values: Array
    limit: float


@dataclass(frozen=True)
class Design:
    """A point on the map."""

    name: str
    x: float
    y: float


def pressure_angle_width_section(
    pressure_angle_deg: Array,
    width_mm: Array,
    peak_to_peak_arcmin: Array,
    design: Design,
    *,
    requirement_arcmin: float | None = None,
    limits: Sequence[Limit] = (),
    key: str = "design-map",
) -> Section:
    """Peak-to-peak over `pressure_angle_deg` (m,) and the wave generator's `width_mm` (n,): `peak_to_peak_arcmin` has
    shape (m, n).

    `design` is the drive in hand: x its width in mm, y its pressure angle in deg. `requirement_arcmin` becomes one
    more line among `limits`, where it lies within the map's values. `key` names the section.
    """
    values = np.asarray(peak_to_peak_arcmin, float)
    if requirement_arcmin is not None and values.min() < requirement_arcmin < values.max():
        limits = (Limit(f"required, {requirement_arcmin:g} arcmin", values, requirement_arcmin), *limits)
    made = design_map(
        width_mm, pressure_angle_deg, values, ("WG width [mm]", "Pressure angle [deg]", "arcmin"), [design], limits
    )
    return Section(
        key,
        "Pressure angle and width",
        (
            Figure(
                f"{key}-figure",
                "Peak-to-peak error over pressure angle and width of the wave generator",
                made,
                "Dark is large. The point is the design; hover for values.",
            ),
        ),
        f"Over the map the error runs from {values.min():.2f} to {values.max():.2f} arcmin: a smaller pressure angle "
        "turns less radial motion into rotation, and a narrower wave generator lifts its rims less when it tilts. "
        "What both cost in load capacity is not on this map.",
    )


def design_map(
    x: Array,
    y: Array,
    values: Array,
    titles: tuple[str, str, str],
    designs: Sequence[Design] = (),
    limits: Sequence[Limit] = (),
    height: int = 500,
) -> go.Figure:
    """A filled map with labelled contour lines over `x` (n,) and `y` (m,).

    `values` has the shape (m, n), `titles` are those of x, y and the scale; `designs` are marked, `limits` drawn as
    lines; `height` is in px.
    """
    x_title, y_title, unit = titles
    made = figure(x_title, y_title, height=height)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    made.add_heatmap(
        x=x,
        y=y,
        z=values,
        zsmooth="best",
        name=unit,
        colorbar={"title": {"text": unit}},
        colorscale=[list(stop) for stop in SEQUENTIAL],
        hovertemplate=f"{x_title.split(' [')[0]} %{{x:.4~g}}<br>{y_title.split(' [')[0]} %{{y:.4~g}}<br>"
        f"<b>%{{z:.4~g}} {unit}</b><extra></extra>",
    )
    step = _round_step((high - low) / 10)
    silent: dict[str, Any] = {"x": x, "y": y, "showscale": False, "hoverinfo": "skip"}
    made.add_contour(
        **silent,
        z=values,
        showlegend=False,
        name=unit,
        contours={
            "coloring": "none",
            "showlabels": True,
            "start": np.ceil(low / step) * step,
            "end": high,
            "size": step,
            "labelfont": {"size": 12, "color": INK},
        },
        line={"width": 0.8, "color": INK, "smoothing": 1},
    )
    for colour, limit in zip(LIMIT_COLOURS, limits, strict=False):
        made.add_contour(
            **silent,
            z=limit.values,
            showlegend=True,
            name=limit.name,
            contours={"coloring": "none", "start": limit.limit, "end": limit.limit, "size": 1},
            line={"width": 3, "color": colour},
        )
    _mark(made, designs)
    made.update_xaxes(showgrid=False, range=[float(np.min(x)), float(np.max(x))])
    made.update_yaxes(showgrid=False, range=[float(np.min(y)), float(np.max(y))])
    return made


def _mark(made: go.Figure, designs: Sequence[Design]) -> None:
    for design in designs:
        made.add_scatter(
            x=[design.x],
            y=[design.y],
            mode="markers+text",
            name=design.name,
            text=[f"<b>{design.name}</b>"],
            textposition="top center",
            textfont={"size": 13, "color": INK},
            showlegend=False,
            marker={"size": 13, "color": PAPER, "line": {"width": 3, "color": INK}},
            hovertemplate="%{x:.4~g}, %{y:.4~g}",
        )


def _round_step(step: float) -> float:
    """The nearest of 1, 2, 5 times a power of ten at or above `step`."""
    power = 10.0 ** np.floor(np.log10(step)) if step > 0 else 1.0
    return float(next(factor * power for factor in (1, 2, 5, 10) if factor * power >= step * (1 - 1e-9)))
