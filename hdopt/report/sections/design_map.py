"""A map of one quantity over two design variables, with the design on it and the lines that bound it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any  # Any: Plotly's dictionaries and traces, which have no types

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.report import Figure, Section
from hdopt.report.theme import GREEN, GREY, INK, ORANGE, PAPER, PURPLE, SEQUENTIAL, SKY, VERMILLION, faded, figure
from hdopt.words import listed

if TYPE_CHECKING:
    import plotly.graph_objects as go

LIMIT_COLOURS = (VERMILLION, GREEN, PURPLE, ORANGE, GREY, SKY)
BROKEN_OPACITY = 0.22
"""Of the shade over the side of a limit on which it is broken."""


@dataclass(frozen=True)
class Limit:
    """A line on the map: where `values`, on the map's grid, equal `limit`, which they may not exceed, or where
    `at_least`, not fall below. `name` stands in the legend."""

    name: str
    values: Array
    limit: float
    at_least: bool = False

    @property
    def broken(self) -> Mask:
        """Where on the grid the limit is broken."""
        return np.asarray(self.values < self.limit if self.at_least else self.values > self.limit)


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
    more line among `limits`. `key` names the section.
    """
    values = np.asarray(peak_to_peak_arcmin, float)
    if requirement_arcmin is not None:
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
                f"Dark is large. The point is the design; hover for values. {words_on_limits(limits)}".strip(),
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
    _draw_limits(made, limits, silent)
    _mark(made, designs)
    made.update_xaxes(showgrid=False, range=[float(np.min(x)), float(np.max(x))])
    made.update_yaxes(showgrid=False, range=[float(np.min(y)), float(np.max(y))])
    return made


def _draw_limits(made: go.Figure, limits: Sequence[Limit], silent: Mapping[str, Any]) -> None:
    """Each of `limits` that is broken somewhere, as a line with the broken side shaded; `silent` has the grid."""
    drawn = [limit for limit in limits if limit.broken.any()]
    if len(drawn) > len(LIMIT_COLOURS):
        raise ValueError(f"{len(drawn)} limits on a map that has colours for {len(LIMIT_COLOURS)}; show fewer")
    for colour, limit in zip(LIMIT_COLOURS, drawn, strict=False):
        # Plotly shades the side on which a constraint does not hold.
        made.add_contour(
            **silent,
            z=limit.values,
            showlegend=True,
            name=limit.name,
            contours={"type": "constraint", "operation": ">=" if limit.at_least else "<=", "value": limit.limit},
            fillcolor=faded(colour, BROKEN_OPACITY),
            line={"width": 3, "color": colour},
        )


def words_on_limits(limits: Sequence[Limit]) -> str:
    """What a caption says of `limits`: which side is shaded, and which are kept, or broken, all over the map."""
    says = ["The shaded side of a line breaks its limit."] if any(limit.broken.any() for limit in limits) else []
    kept = [limit.name for limit in limits if not limit.broken.any()]
    lost = [limit.name for limit in limits if limit.broken.all()]
    if kept:
        says.append(f"Kept all over this map, so without a line: {listed(kept)}.")
    if lost:
        says.append(f"Broken all over this map: {listed(lost)}.")
    return " ".join(says)


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
