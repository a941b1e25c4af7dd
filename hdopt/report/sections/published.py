"""Published numbers beside what hdopt computes: on the published sampling, and converged."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdopt.report import Figure, KeyFigures, Section, Table
from hdopt.report.theme import BLUE, GREY, INK, VERMILLION, faded, figure

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go


def published_section(
    frame: pd.DataFrame,
    *,
    source: str,
    sampling: str = "10 deg over 80 turns",
    tolerance_arcmin: float = 0.02,
    key: str = "published",
) -> Section:
    """Each published value with its re-computation.

    `frame` has a row a case: `case`, `published_arcmin`, `sampled_arcmin` (computed on the published sampling) and
    `converged_arcmin` (nan where it has no meaning); further columns are shown in the table. `sampling` names that
    sampling, `source` the publication. Cases whose sampled value is within `tolerance_arcmin` of the published one
    count as reproduced; `key` names the section.
    """
    difference = (frame["sampled_arcmin"] - frame["published_arcmin"]).rename("difference_arcmin")
    excess = 100 * (frame["converged_arcmin"] / frame["sampled_arcmin"] - 1)
    shown = frame.assign(difference_arcmin=difference)
    worst = int(difference.abs().to_numpy().argmax())
    within = int((difference.abs() <= tolerance_arcmin).sum())
    return Section(
        key,
        "Published numbers, recomputed",
        (
            KeyFigures(
                {
                    f"Within {tolerance_arcmin:g} arcmin": f"{within} of {len(frame)}",
                    "Median difference": f"{difference.abs().median():.4f} arcmin",
                    "Largest difference": f"{difference.abs().max():.4f} arcmin",
                    "Converged above sampled": f"{np.nanmedian(excess):.1f} %",
                }
            ),
            Figure(
                f"{key}-cases",
                "Published, sampled as published, and converged",
                _dumbbells(frame),
                f"Rings are published, dots hdopt on the same sampling ({sampling}), diamonds hdopt converged: "
                "coarse sampling misses the peaks.",
            ),
            Figure(
                f"{key}-difference",
                "Computed on the published sampling less published",
                _differences(frame, difference, tolerance_arcmin),
                f"The band is {tolerance_arcmin:g} arcmin to either side.",
            ),
            Table(
                f"{key}-table",
                "Published and computed values",
                shown,
                formats={name: ".4f" for name in ("sampled_arcmin", "converged_arcmin")}
                | {"difference_arcmin": "+.4f", "sampling_deg": "g"},
            ),
        ),
        f"{within} of {len(frame)} values of {source} come out within {tolerance_arcmin:g} arcmin on the sampling "
        f"they were computed with; the largest difference, {difference.iloc[worst]:+.4f} arcmin, is at "
        f"{frame['case'].iloc[worst]}.".replace("-0.", "−0."),
    )


def _dumbbells(frame: pd.DataFrame) -> go.Figure:
    frame = frame.iloc[::-1]
    made = figure("Peak-to-peak [arcmin]", "", height=110 + 22 * len(frame))
    columns = frame[["published_arcmin", "sampled_arcmin", "converged_arcmin"]].to_numpy(float)
    low, high = np.nanmin(columns, axis=1), np.nanmax(columns, axis=1)
    gap = np.full(len(frame), np.nan)
    made.add_scatter(
        x=np.stack([low, high, gap], axis=1).ravel(),
        y=np.repeat(frame["case"].to_numpy(), 3),
        mode="lines",
        line={"color": faded(GREY, 0.5), "width": 2},
        hoverinfo="skip",
        showlegend=False,
        name="Span",
    )
    marks = (
        ("converged_arcmin", "Converged", {"symbol": "diamond", "size": 9, "color": VERMILLION}),
        ("sampled_arcmin", "On the published sampling", {"size": 8, "color": BLUE}),
        ("published_arcmin", "Published", {"symbol": "circle-open", "size": 13, "color": INK, "line": {"width": 1.5}}),
    )
    for column, name, marker in marks:
        made.add_scatter(
            x=frame[column],
            y=frame["case"],
            mode="markers",
            marker=marker,
            name=name,
            hovertemplate="%{y}: %{x:.4f} arcmin",
        )
    made.update_yaxes(range=[-0.7, len(frame) - 0.3], dtick=1)
    return made


def _differences(frame: pd.DataFrame, difference: pd.Series, tolerance_arcmin: float) -> go.Figure:
    made = figure("", "Difference [arcmin]", height=340, hovermode="x")  # a bar of nil cannot be met
    made.add_hrect(-tolerance_arcmin, tolerance_arcmin, fillcolor=faded(BLUE, 0.08), line_width=0, layer="below")
    made.add_bar(
        x=frame["case"],
        y=difference,
        name="Difference",
        marker={"color": BLUE},
        showlegend=False,
        hovertemplate="%{x}: %{y:+.4f} arcmin<extra></extra>",
    )
    reach = 1.15 * max(tolerance_arcmin, float(difference.abs().max()))
    made.update_yaxes(range=[-reach, reach], zeroline=True, zerolinecolor=INK, zerolinewidth=1)
    made.update_xaxes(showgrid=False, ticks="", tickangle=-60)
    return made
