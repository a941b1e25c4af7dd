"""Lag at reversal over a turn, and the clearances it is made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdopt.report import Figure, KeyFigures, Section
from hdopt.report.sections.words import label
from hdopt.report.theme import INK, PALETTE, VERMILLION, faded, figure

if TYPE_CHECKING:
    import plotly.graph_objects as go


def lag_section(
    theta: NDArray[np.float64],
    lag_arcmin: NDArray[np.float64],
    parts: Mapping[str, NDArray[np.float64]],
    *,
    key: str = "lag",
) -> Section:
    """Lag over the input angle `theta` (rad, shape (n,)): the whole, and its `parts` by name, arcmin, shape (n,).

    A lag below zero is interference: the teeth have no play there. It is shown as such, never clipped.
    """
    lag_arcmin = np.asarray(lag_arcmin, float)
    tight = float(np.mean(lag_arcmin < 0))
    says = f"Output lags by {lag_arcmin.mean():.3f} arcmin on average when the input reverses"
    says += f"; over {100 * tight:.0f} % of the turn the teeth have no play at all." if tight else "."
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
                ("The thick line is the whole. " if len(parts) > 1 else "") + "Below zero the teeth interfere.",
            ),
        ),
        says,
    )


def _lag(
    theta: NDArray[np.float64], lag_arcmin: NDArray[np.float64], parts: Mapping[str, NDArray[np.float64]]
) -> go.Figure:
    angle = np.degrees(theta)
    made = figure("Input angle [deg]", "Lag [arcmin]", height=360)
    for colour, (name, values) in zip(PALETTE, parts.items() if len(parts) > 1 else (), strict=False):
        made.add_scatter(
            x=angle,
            y=np.broadcast_to(values, angle.shape),
            mode="lines",
            name=label(name),
            line={"color": colour, "width": 1.8},
            hovertemplate="%{x:.1f} deg: %{y:.3f} arcmin",
        )
    made.add_scatter(
        x=angle,
        y=lag_arcmin,
        mode="lines",
        name="Lag",
        line={"color": INK, "width": 3},
        hovertemplate="%{x:.1f} deg: %{y:.3f} arcmin",
    )
    lowest = min(0.0, *(float(np.min(values)) for values in (lag_arcmin, *parts.values())))
    if lowest < 0:
        made.add_hrect(lowest * 1.1, 0, fillcolor=faded(VERMILLION, 0.08), line_width=0, layer="below")
        made.add_annotation(x=0.01, xref="paper", xanchor="left", y=0, yanchor="top", text="interference")
    made.update_xaxes(range=[angle[0], angle[-1]], dtick=90 if angle[-1] <= 720 else None)
    made.update_yaxes(rangemode="tozero", zeroline=True, zerolinecolor=INK, zerolinewidth=1)
    return made
