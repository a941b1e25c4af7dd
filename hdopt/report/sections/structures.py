"""The four ways to hang a wave generator on its shaft, side by side: what each gains and what it costs."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.report import Figure, Section, Table
from hdopt.report.sections.words import label
from hdopt.report.theme import BLUE, INK, ORANGE, PALETTE, figure

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go


def structures_section(
    frame: pd.DataFrame,
    *,
    waveforms: tuple[Array, Mapping[str, Array]] | None = None,
    requirement_arcmin: float | None = None,
    key: str = "structures",
) -> Section:
    """Structures compared.

    `frame` has a row a structure with the columns `structure` and `peak_to_peak_arcmin`, and where lag is known
    `lag_mean_arcmin`, `lag_min_arcmin`, `lag_max_arcmin`; further columns are shown in the table. `waveforms` is
    (theta in rad, structure -> error in arcmin), drawn over the span of `theta`. `requirement_arcmin` is drawn as a
    line; `key` begins the keys of its figures.
    """
    items: list[Figure | Table] = [
        Figure(
            f"{key}-bars",
            "Kinematic error and lag by structure",
            _bars(frame, requirement_arcmin),
            "Alignment takes eccentricity out of the kinematic error and pays with clearance, which shows at "
            "reversal as lag (bar: mean over a turn; whisker: smallest and largest)."
            if "lag_mean_arcmin" in frame
            else "Alignment takes eccentricity out of the kinematic error.",
        ),
    ]
    if waveforms is not None:
        items.append(Figure(f"{key}-waveforms", "One turn with each structure", _waveforms(*waveforms)))
    shown = frame.assign(structure=[label(name) for name in frame["structure"]])
    items.append(Table(f"{key}-table", "Structures", shown))
    sizes = frame["peak_to_peak_arcmin"].to_numpy(float)
    best, worst = frame.iloc[int(np.nanargmin(sizes))], frame.iloc[int(np.nanargmax(sizes))]
    return Section(
        key,
        "Structures of the wave generator",
        tuple(items),
        f"{label(best['structure'])} gives the smallest kinematic error, {best['peak_to_peak_arcmin']:.3f} arcmin, "
        f"against {worst['peak_to_peak_arcmin']:.3f} arcmin with {label(worst['structure']).lower()}.",
    )


def _bars(frame: pd.DataFrame, requirement_arcmin: float | None) -> go.Figure:
    names = [label(name).replace(", ", ",<br>").replace("Automatic ", "Automatic<br>") for name in frame["structure"]]
    made = figure("", "Peak-to-peak, lag [arcmin]", height=380, barmode="group")
    made.add_bar(
        x=names,
        y=frame["peak_to_peak_arcmin"],
        name="Kinematic error, peak-to-peak",
        marker={"color": BLUE},
        texttemplate="%{y:.3f}",
        textposition="outside",
        cliponaxis=False,
        hovertemplate="%{x}: %{y:.4f} arcmin",
    )
    if "lag_mean_arcmin" in frame:
        mean = frame["lag_mean_arcmin"]
        made.add_bar(
            x=names,
            y=mean,
            name="Lag at reversal",
            marker={"color": ORANGE},
            error_y={
                "type": "data",
                "symmetric": False,
                "array": frame["lag_max_arcmin"] - mean,
                "arrayminus": mean - frame["lag_min_arcmin"],
                "color": INK,
                "thickness": 1.2,
                "width": 4,
            },
            customdata=np.stack([frame["lag_min_arcmin"], frame["lag_max_arcmin"]], axis=1),
            hovertemplate="%{x}: mean %{y:.3f} arcmin, %{customdata[0]:.3f} to %{customdata[1]:.3f}",
        )
    if requirement_arcmin is not None:
        made.add_hline(
            requirement_arcmin,
            line={"dash": "dash", "width": 1.5, "color": INK},
            name=f"Required, {requirement_arcmin:g} arcmin",
            showlegend=True,
        )
    made.update_xaxes(showgrid=False, ticks="")
    made.update_yaxes(rangemode="tozero", zeroline=True, zerolinecolor=INK, zerolinewidth=1)
    return made


def _waveforms(theta: Array, waveforms: Mapping[str, Array]) -> go.Figure:
    made = figure("Input angle [deg]", "Kinematic error [arcmin]", height=360)
    # A one-way type often runs exactly over one of the first two: dashes let what lies below be seen.
    styles = itertools.cycle([("solid", 3.5), ("solid", 3.5), ("5px,5px", 2), ("5px,5px", 2)])
    for colour, (dash, width), (name, ke_arcmin) in zip(PALETTE, styles, waveforms.items(), strict=False):
        made.add_scatter(
            x=np.degrees(theta),
            y=ke_arcmin,
            mode="lines",
            name=label(name),
            line={"color": colour, "width": width, "dash": dash},
            hovertemplate="%{x:.1f} deg: %{y:.3f} arcmin",
        )
    made.update_xaxes(range=[np.degrees(theta[0]), np.degrees(theta[-1])], dtick=45)
    return made
