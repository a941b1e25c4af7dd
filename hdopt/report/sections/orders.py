"""The order spectrum: how much of the kinematic error each order carries, and where it comes from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any  # Any: Plotly's dictionaries and traces, which have no types

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.report import Figure, Item, Section, Table, Text
from hdopt.report.theme import PALETTE, figure
from hdopt.words import listed

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go


def spectrum_section(
    orders: Array,
    amplitude_arcmin: Array,
    expressions: Sequence[str],
    origins: Sequence[str],
    ratio: float,
    *,
    kinds: Sequence[str] | None = None,
    interference: pd.DataFrame | None = None,
    key: str = "orders",
) -> Section:
    """Amplitudes at exact orders.

    `ratio` is the reduction N. `orders` cycles per input turn, `amplitude_arcmin` half of each order's swing, both of
    shape (n,); `expressions` how each order is written ('2(1 + 1/N)'), `origins` the physics it comes from. Equal
    `kinds` share a colour and a place in the legend (at most seven; the origins, where none are given). `interference`
    is a table of orders that the record is too short to tell apart, where there are any. `key` begins the keys of its
    figures.
    """
    import pandas as pd

    orders, amplitude_arcmin = np.asarray(orders, float), np.asarray(amplitude_arcmin, float)
    rank = np.argsort(amplitude_arcmin)[::-1]
    frame = pd.DataFrame(
        {"order": orders, "written": list(expressions), "amplitude_arcmin": amplitude_arcmin, "origin": list(origins)}
    )
    items: list[Item] = [
        Figure(
            f"{key}-stems",
            "Order spectrum",
            _stems(orders, amplitude_arcmin, expressions, origins, kinds or origins, ratio),
            f"Above all orders, below the neighbourhood of order 2, where neighbours lie 1/N = {1 / ratio:g} apart "
            "and only a record of a full relative turn separates them.",
        ),
        Table(
            f"{key}-table",
            "Orders by amplitude",
            frame.iloc[rank].reset_index(drop=True),
            formats={"order": ".4f", "amplitude_arcmin": ".4f"},
        ),
    ]
    if interference is not None and len(interference):
        items += [
            Text("This record is too short to separate the following orders; their amplitudes share what is there."),
            Table(f"{key}-interference", "Orders that the record cannot separate", interference),
        ]
    largest = [f"{expressions[i]} ({amplitude_arcmin[i]:.3f} arcmin)" for i in rank[:3]]
    return Section(key, "Orders", tuple(items), f"Most of the error lies at the orders {listed(largest)}.")


def _stems(
    orders: Array,
    amplitude_arcmin: Array,
    expressions: Sequence[str],
    origins: Sequence[str],
    kinds: Sequence[str],
    ratio: float,
) -> go.Figure:
    around_two = np.abs(orders - 2) < 3.5 / ratio
    span = float(orders.max()) * 1.04 + 0.2
    near = np.abs(orders[:, None] - orders) < 0.06 * span
    outshone: Mask = np.any(near & (amplitude_arcmin[None, :] > amplitude_arcmin[:, None]), axis=1)
    top = float(amplitude_arcmin.max()) * 1.18
    made = _two_panels(span, top, ratio)
    for colour, kind in zip(PALETTE * 3, dict.fromkeys(kinds), strict=False):
        mine = np.array([name == kind for name in kinds])
        panels: list[tuple[str, str, Mask, bool, Mask]] = [
            ("x", "y", mine, True, np.logical_not(outshone)),
            ("x2", "y2", mine & around_two, False, around_two),
        ]
        for xaxis, yaxis, chosen, legend, named in panels:
            if not chosen.any():
                continue
            x, y = orders[chosen], amplitude_arcmin[chosen]
            gap = np.full_like(x, np.nan)
            places = np.flatnonzero(chosen).tolist()
            panel: dict[str, Any] = {"xaxis": xaxis, "yaxis": yaxis, "name": kind, "legendgroup": kind}
            made.add_scatter(
                **panel,
                x=np.stack([x, x, gap], axis=1).ravel(),
                y=np.stack([0 * y, y, gap], axis=1).ravel(),
                mode="lines",
                line={"color": colour, "width": 2.5},
                showlegend=False,
                hoverinfo="skip",
            )
            made.add_scatter(
                **panel,
                x=x,
                y=y,
                mode="markers+text",
                marker={"color": colour, "size": 9},
                text=[expressions[i] if named[i] else "" for i in places],
                textposition="top center",
                textfont={"color": colour, "size": 12},
                showlegend=legend,
                customdata=[(expressions[i], origins[i]) for i in places],
                cliponaxis=False,
                hovertemplate="order %{customdata[0]} = %{x:.4f}<br>%{y:.4f} arcmin<br>%{customdata[1]}<extra></extra>",
            )
    return made


def _two_panels(span: float, top: float, ratio: float) -> go.Figure:
    """All orders up to `span` above, the neighbourhood of order 2 below, both up to the amplitude `top`."""
    made = figure("", "", height=560)
    made.update_layout(
        xaxis={"domain": [0, 1], "anchor": "y", "range": [-0.03 * span, span], "dtick": 1},
        yaxis={"domain": [0.60, 1], "anchor": "x", "range": [0, top], "title": {"text": "Amplitude [arcmin]"}},
        xaxis2={
            "domain": [0, 1],
            "anchor": "y2",
            "range": [2 - 3.5 / ratio, 2 + 3.5 / ratio],
            "tickvals": [2 + k / ratio for k in range(-3, 4)],
            "ticktext": [f"{2 + k / ratio:.6g}" for k in range(-3, 4)],
            "title": {"text": "Order [cycles per input turn]"},
        },
        yaxis2={"domain": [0, 0.42], "anchor": "x2", "range": [0, top], "title": {"text": "Amplitude [arcmin]"}},
    )
    return made
