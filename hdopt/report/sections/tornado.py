"""Single-variable sensitivities as a tornado: what moves the kinematic error most stands on top."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from hdopt.report import Figure, Section, Table
from hdopt.report.sections.words import in_sentence
from hdopt.report.theme import BLUE, INK, ORANGE, figure
from hdopt.words import listed

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go


def sensitivities_section(
    frame: pd.DataFrame, base_arcmin: float, *, what: str = "peak-to-peak error", key: str = "sensitivities"
) -> Section:
    """Each variable alone moved to its low and its high value, the others at the base.

    `frame` has a row a variable: `variable` (its name in words), `low` and `high` (the two values, written out with
    their unit), `low_arcmin` and `high_arcmin` (the result there). `base_arcmin` is the result with none moved; `what`
    says in words what the result is, `key` names the section.
    """
    swing = (frame[["low_arcmin", "high_arcmin"]].sub(base_arcmin)).abs().max(axis=1)
    ordered = frame.iloc[np.argsort(-swing.to_numpy(), kind="stable")].reset_index(drop=True)
    return Section(
        key,
        "What the error depends on",
        (
            Figure(
                f"{key}-tornado",
                f"Sensitivity of the {what} to each variable alone",
                _tornado(ordered, base_arcmin),
                f"Bars run from the base, {base_arcmin:.3f} arcmin, to the value at either end of the variable's "
                "range, which is written beside them.",
            ),
            Table(f"{key}-table", "Sensitivities", ordered, formats={"low_arcmin": ".3f", "high_arcmin": ".3f"}),
        ),
        f"The {what} reacts most to {listed([in_sentence(name) for name in ordered['variable'][:3]])}.",
    )


def _tornado(frame: pd.DataFrame, base_arcmin: float) -> go.Figure:
    frame = frame.iloc[::-1].assign(variable=lambda f: ["<br>".join(wrap(name, 22)) for name in f["variable"]])
    made = figure("Peak-to-peak [arcmin]", "", height=90 + 38 * len(frame), barmode="overlay", bargap=0.3)
    for end, colour, name in (("low", BLUE, "At the low value"), ("high", ORANGE, "At the high value")):
        value = frame[f"{end}_arcmin"].to_numpy(float)
        change = value - base_arcmin
        made.add_bar(
            y=frame["variable"],
            x=change,
            base=base_arcmin,
            orientation="h",
            name=name,
            marker={"color": colour},
            customdata=np.stack([frame[end].astype(str), value.astype(object)], axis=1),
            hovertemplate="%{y} at %{customdata[0]}: %{customdata[1]:.4f} arcmin",
        )
        other = frame["high_arcmin" if end == "low" else "low_arcmin"].to_numpy(float) - base_arcmin
        # Where both ends lie on one side the shorter bar's label would be covered: it goes to the other side.
        covered = (np.sign(change) == np.sign(other)) & (np.abs(change) < np.abs(other)) | (change == 0)
        side = np.where(covered, -np.sign(np.where(other == 0, 1, other)), np.sign(change))
        made.add_scatter(
            y=frame["variable"],
            x=np.where(covered, base_arcmin, value),
            mode="text",
            text=["\u2002" + str(value) + "\u2002" for value in frame[end]],
            textposition=["middle right" if s > 0 else "middle left" for s in side],
            showlegend=False,
            name=name,
            textfont={"size": 11},
            hoverinfo="skip",
            cliponaxis=False,
        )
    reach = frame[["low_arcmin", "high_arcmin"]].to_numpy(float)
    low, high = min(reach.min(), base_arcmin), max(reach.max(), base_arcmin)
    room = 0.36 * (high - low or 1)
    made.update_xaxes(range=[low - room, high + room])
    made.update_yaxes(showgrid=False, ticks="", showline=False)
    made.add_vline(base_arcmin, line={"color": INK, "width": 1.2})
    return made
