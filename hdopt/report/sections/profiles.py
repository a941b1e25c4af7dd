"""Wave-generator profiles: their shape, how they differ, and how they bend the ring."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any  # Any: Plotly's dictionaries and traces, which have no types

import numpy as np

from hdopt.arrays import Array
from hdopt.report import Figure, Section, Table
from hdopt.report.sections.words import label
from hdopt.report.theme import DIVERGING, GREY, INK, PALETTE, figure

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go

Curves = Mapping[str, Array]

TIMES = "\u00a0×\u00a0"
"""Keeps a power of ten on the line of its number."""
EXAGGERATED = 0.28
"""Largest deflection as drawn, as a share of the radius."""


def profiles_section(
    phi: Array,
    deflection_mm: Curves,
    curvature_change_per_mm: Curves,
    undeformed_radius_mm: float,
    summary: pd.DataFrame,
    *,
    key: str = "profiles",
) -> Section:
    """Profiles compared.

    `phi` angle from the major axis over one turn, rad, shape (n,); `deflection_mm` profile -> r(phi) - R, and
    `curvature_change_per_mm` profile -> change of curvature of the ring's neutral line, both of shape (n,);
    `undeformed_radius_mm` R. `summary` has a row a profile with the column `profile` and any figures of merit. `key`
    begins the keys of its figures.
    """
    times = EXAGGERATED * undeformed_radius_mm / max(float(np.abs(w).max()) for w in deflection_mm.values())
    change = {name: 1000 * values for name, values in curvature_change_per_mm.items()}
    peaks = {name: float(np.abs(values).max()) for name, values in change.items()}
    shown = summary.assign(profile=[label(name) for name in summary["profile"]])
    reference = next(iter(deflection_mm))
    items: list[Figure | Table] = [
        Figure(
            f"{key}-rings",
            "Curvature change along the ring",
            _rings(phi, deflection_mm, change, undeformed_radius_mm, times),
            f"Deflection drawn {times:.0f} times. Vermillion: bent more than the free ring; blue: straightened.",
        ),
        Figure(
            f"{key}-curvature",
            "Curvature change over the angle",
            _along(phi, change, "Curvature change [10⁻³/mm]", "%{y:.3f} × 10⁻³/mm"),
            "Bending stress follows this curve: half the wall times the modulus times the change.",
        ),
        Figure(
            f"{key}-deflection",
            "Deflection over the angle",
            _along(phi, deflection_mm, "Deflection [mm]", "%{y:.4f} mm"),
        ),
    ]
    others = {name: 1000 * (w - deflection_mm[reference]) for name, w in deflection_mm.items() if name != reference}
    if others:
        items.append(
            Figure(
                f"{key}-difference",
                f"Deflection against that of the {label(reference).lower()}",
                _along(phi, others, "Difference [µm]", "%{y:.2f} µm", first_colour=1),
                f"Up to {max(float(np.abs(w).max()) for w in others.values()):.0f} µm, which decide where the ring "
                "bends and how many teeth meet.",
            )
        )
    items.append(Table(f"{key}-table", "Profiles", shown))
    return Section(
        key,
        "Profiles of the wave generator",
        tuple(items),
        _comparison(peaks),
    )


def _comparison(peaks: Mapping[str, float]) -> str:
    gentle, harsh = min(peaks, key=lambda name: peaks[name]), max(peaks, key=lambda name: peaks[name])
    says = f"{label(gentle)}: the curvature changes by {peaks[gentle]:.2f}{TIMES}10⁻³/mm at most"
    if len(peaks) == 1:
        return f"{says}; bending stress grows in proportion."
    return (
        f"{says}, least of all. {label(harsh)}: {peaks[harsh]:.2f}{TIMES}10⁻³/mm, most of all. "
        "Bending stress grows in proportion."
    )


def _rings(phi: Array, deflection_mm: Curves, change: Curves, radius: float, times: float) -> go.Figure:
    """One ring a profile, coloured by its curvature change, the free ring behind it; the major axis points up."""
    reach = max(float(np.abs(values).max()) for values in change.values())
    extent = radius * (1 + EXAGGERATED) * 1.08
    count = len(deflection_mm)
    margin = {"l": 8, "r": 8, "t": 28, "b": 8}
    made = figure("", "", height=360, showlegend=False, margin=margin, meta={"narrow_height": 290})
    circle = np.linspace(0, 2 * np.pi, 181)
    for i, (name, w) in enumerate(deflection_mm.items()):
        tag = str(i + 1) if i else ""
        place: dict[str, Any] = {"xaxis": f"x{tag}", "yaxis": f"y{tag}"}
        made.update_layout(_panel(tag, (i / count, (i + 1) / count), extent))
        made.add_scatter(
            **place,
            x=radius * np.sin(circle),
            y=radius * np.cos(circle),
            mode="lines",
            line={"color": GREY, "width": 1, "dash": "dot"},
            hoverinfo="skip",
            showlegend=False,
            name="Free ring",
        )
        r = radius + times * w
        made.add_scatter(
            **place,
            x=r * np.sin(phi),
            y=r * np.cos(phi),
            mode="markers",
            name=label(name),
            marker={"size": 7, "color": change[name], **_colours(reach, shown=i == count - 1)},
            customdata=np.stack([np.degrees(phi), 1000 * w, change[name]], axis=1),
            hovertemplate="%{customdata[0]:.0f} deg: deflection %{customdata[1]:.0f} µm<br>"
            "curvature change %{customdata[2]:.3f} × 10⁻³/mm",
        )
        made.add_annotation(
            x=(i + 0.5) / count,
            xref="paper",
            xanchor="center",
            y=1,
            yref="paper",
            yanchor="bottom",
            text=f"<b>{label(name)}</b>",
            font={"size": 13, "color": INK},
        )
    return made


def _panel(tag: str, domain: tuple[float, float], extent: float) -> dict[str, Any]:
    """Axes of one ring, of equal scale and without ticks, in its part of the figure."""
    hidden = {"visible": False, "fixedrange": True, "range": [-extent, extent], "constrain": "domain"}
    return {
        f"xaxis{tag}": {"domain": list(domain), "anchor": f"y{tag}", **hidden},
        f"yaxis{tag}": {"domain": [0.2, 1], "anchor": f"x{tag}", "scaleanchor": f"x{tag}", **hidden},
    }


def _colours(reach: float, shown: bool) -> dict[str, Any]:
    """Colours from -reach to reach, and their bar below the rings."""
    return {
        "cmin": -reach,
        "cmax": reach,
        "colorscale": [list(stop) for stop in DIVERGING],
        "showscale": shown,
        "colorbar": {
            "title": {"text": "Curvature change [10⁻³/mm]", "side": "top"},
            "orientation": "h",
            "x": 0.5,
            "y": 0.02,
            "yanchor": "bottom",
            "len": 0.6,
        },
    }


def _along(phi: Array, curves: Curves, title: str, number: str, first_colour: int = 0) -> go.Figure:
    made = figure("Angle from the major axis [deg]", title, height=340)
    for colour, (name, values) in zip(PALETTE[first_colour:], curves.items(), strict=False):
        made.add_scatter(
            x=np.degrees(phi),
            y=values,
            mode="lines",
            name=label(name),
            line={"color": colour, "width": 2},
            hovertemplate=f"%{{x:.0f}} deg: {number}",
        )
    made.update_xaxes(range=[float(np.degrees(phi[0])), float(np.degrees(phi[-1]))], dtick=45)
    made.update_yaxes(zeroline=True, zerolinecolor=INK, zerolinewidth=1)
    return made
