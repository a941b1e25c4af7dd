"""Lag at reversal over a turn, and the clearances it is made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.report import Figure, KeyFigures, Section
from hdopt.report.sections.words import label
from hdopt.report.theme import GREY, INK, PALETTE, VERMILLION, faded, figure

if TYPE_CHECKING:
    import plotly.graph_objects as go


def lag_section(
    theta: Array,
    lag_arcmin: Array,
    parts: Mapping[str, Array],
    interference: float,
    *,
    key: str = "lag",
) -> Section:
    """Lag over the input angle `theta` (rad, even, one or more whole turns, shape (n,)).

    `lag_arcmin` is the whole, `parts` its parts by name, each of shape (n,); `interference` the share of the angles
    where the teeth have no backlash left; `key` names the section. What is below zero is shown as such, never clipped.
    Of several turns the first is drawn, within the band of all.
    """
    lag_arcmin = np.asarray(lag_arcmin, float)
    says = f"The output lags by {lag_arcmin.mean():.3f} arcmin on average when the input reverses"
    says += f"; over {100 * interference:.0f} % of the angles the flanks interfere." if interference else "."
    return Section(
        key,
        "Lag at reversal",
        (
            KeyFigures(
                {
                    "Mean lag": f"{lag_arcmin.mean():.3f} arcmin",
                    "Smallest": f"{lag_arcmin.min():.3f} arcmin",
                    "Largest": f"{lag_arcmin.max():.3f} arcmin",
                }
            ),
            Figure(
                f"{key}-turn",
                "Lag over a turn of the wave generator",
                _lag(theta, lag_arcmin, parts),
                "The first turn, in the band of all. Where the tooth backlash is below zero the flanks interfere: "
                "the teeth deviate by more than the backlash gives.",
            ),
        ),
        says,
    )


def _lag(theta: Array, lag_arcmin: Array, parts: Mapping[str, Array]) -> go.Figure:
    made = figure("Input angle [deg]", "Lag [arcmin]", height=360)
    turns = max(1, round((theta[-1] - theta[0]) / (2 * np.pi)))
    points = len(theta) // turns
    first = slice(0, points + 1 if turns > 1 else None)
    angle = np.degrees(theta[first] - theta[0])
    if turns > 1:
        by_turn = lag_arcmin[: turns * points].reshape(turns, points)
        for name, edge, fill in (("", by_turn.min(axis=0), None), ("All turns", by_turn.max(axis=0), "tonexty")):
            made.add_scatter(
                x=angle[:points],
                y=edge,
                mode="lines",
                line={"width": 0, "color": GREY},
                fill=fill,
                fillcolor=faded(GREY, 0.2),
                name=name or "All turns, lowest",
                showlegend=bool(name),
                hoverinfo="skip",
            )
    drawn = parts if len(parts) > 1 else {}
    for colour, (name, values) in zip(PALETTE, drawn.items(), strict=False):
        made.add_scatter(
            x=angle,
            y=np.asarray(values)[first],
            mode="lines",
            name=label(name),
            line={"color": colour, "width": 1.8},
            hovertemplate="%{x:.1f} deg: %{y:.3f} arcmin",
        )
    made.add_scatter(
        x=angle,
        y=lag_arcmin[first],
        mode="lines",
        name="Lag",
        line={"color": INK, "width": 3},
        hovertemplate="%{x:.1f} deg: %{y:.3f} arcmin",
    )
    lowest = min(0.0, *(float(np.min(values)) for values in (lag_arcmin, *drawn.values())))
    if lowest < 0:
        made.add_hrect(lowest * 1.1, 0, fillcolor=faded(VERMILLION, 0.08), line_width=0, layer="below")
        made.add_annotation(x=0.01, xref="paper", xanchor="left", y=0, yanchor="top", text="interference")
    made.update_xaxes(range=[angle[0], angle[-1]], dtick=90)
    made.update_yaxes(rangemode="tozero", zeroline=True, zerolinecolor=INK, zerolinewidth=1)
    return made
