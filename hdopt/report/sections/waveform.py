"""The kinematic error over a full relative turn: the beat, one turn in detail, and every turn at once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.report import Figure, KeyFigures, Section
from hdopt.report.theme import BLUE, DIVERGING, GREY, INK, VERMILLION, faded, figure
from hdopt.words import counted

if TYPE_CHECKING:
    import plotly.graph_objects as go

POINTS_PER_TURN = 180
BEAT_POINTS_PER_TURN = 120
HOVER = "%{x:.1f} deg: %{y:.3f} arcmin"

Extremes = tuple[tuple[float, float], tuple[float, float]]
"""The lowest and the highest point of a waveform, each as angle, rad, and error, arcmin."""


def waveform_section(
    theta: Array,
    ke_arcmin: Array,
    *,
    peak_to_peak_arcmin: float | None = None,
    extremes: Extremes | None = None,
    requirement_arcmin: float | None = None,
    key: str = "waveform",
) -> Section:
    """Kinematic error of one drive over its full relative turn.

    `theta` input angle, rad, rising evenly over one relative turn of both splines, shape (n,), its end given or left
    out; `ke_arcmin` the error there, shape (n,), at least 90 points a turn. `peak_to_peak_arcmin` is the converged
    value where the grid's own is not to be shown, `extremes` the lowest and the highest point between which it lies,
    each as angle (rad) and error (arcmin), where those of the grid are not to be marked; `requirement_arcmin` is what
    it is held against. `key` begins the keys of its figures.
    """
    turns = _by_turn(theta, ke_arcmin)
    peak_to_peak = float(np.ptp(ke_arcmin)) if peak_to_peak_arcmin is None else peak_to_peak_arcmin
    low, high = _extremes_by_turn(theta, ke_arcmin)
    by_turn = high - low
    values = {"Peak-to-peak, converged": f"{peak_to_peak:.3f} arcmin"}
    if requirement_arcmin is not None:
        values["Required"] = f"{requirement_arcmin:.3f} arcmin"
    values |= {
        "Largest in one turn": f"{by_turn.max():.3f} arcmin",
        "Smallest in one turn": f"{by_turn.min():.3f} arcmin",
    }
    return Section(
        key,
        "Kinematic error over a full turn",
        (
            KeyFigures(values),
            Figure(
                f"{key}-beat",
                f"The error over {counted(len(turns), 'input turn')}",
                _beat(theta, ke_arcmin, extremes or _of_the_grid(theta, ke_arcmin)),
                "Every turn of the wave generator, and the envelope of its peaks. The flexspline falls behind by 1/N "
                "of a turn each time, so its teeth meet those of the circular spline anew only after "
                f"{counted(len(turns), 'turn')}.",
            ),
            Figure(
                f"{key}-turn",
                "One turn of the wave generator",
                _one_turn(turns, by_turn),
                "All turns in grey, with the two whose peak-to-peak is largest and smallest. Kinks are where the "
                "driving meshing zone or the touching rim changes.",
            ),
            Figure(
                f"{key}-carpet",
                "Every turn at once",
                _carpet(turns),
                "Each row is one turn. Upright stripes stay with the input angle; slanted ones travel with the "
                "flexspline's teeth.",
            ),
        ),
        f"A single recording of one turn would show between {by_turn.min():.2f} and {by_turn.max():.2f} arcmin, "
        f"depending on which turn it catches; over the full relative turn it is {peak_to_peak:.3f} arcmin.",
    )


def _whole_turns(theta: Array) -> int:
    """Whole turns in a record, whose last angle may be the end of a turn or the last sample before it."""
    step = (theta[-1] - theta[0]) / (len(theta) - 1)
    return max(1, math.floor(float(theta[-1] - theta[0] + 1.001 * step) / (2 * math.pi)))


def _extremes_by_turn(theta: Array, ke_arcmin: Array) -> tuple[Array, Array]:
    """Smallest and largest error in each whole turn, of the points given: each of shape (turns,)."""
    turns = _whole_turns(theta)
    starts = np.searchsorted(theta, theta[0] + 2 * math.pi * np.arange(turns) - 1e-9)
    within = ke_arcmin[: np.searchsorted(theta, theta[0] + 2 * math.pi * turns + 1e-9)]
    return np.minimum.reduceat(within, starts), np.maximum.reduceat(within, starts)


def _by_turn(theta: Array, ke_arcmin: Array) -> Array:
    """The error on an even grid, one row a whole turn: shape (turns, POINTS_PER_TURN + 1)."""
    turns = _whole_turns(theta)
    grid = np.linspace(0, 2 * math.pi, POINTS_PER_TURN + 1)
    end = theta[0] + 2 * math.pi * turns
    if theta[-1] < end:  # the error repeats after a full relative turn
        theta, ke_arcmin = np.append(theta, end), np.append(ke_arcmin, ke_arcmin[0])
    wanted: Array = theta[0] + 2 * math.pi * np.arange(turns)[:, None] + grid
    return np.asarray(np.interp(wanted, theta, ke_arcmin), float)


def _of_the_grid(theta: Array, ke_arcmin: Array) -> Extremes:
    lowest, highest = (
        (float(theta[index]), float(ke_arcmin[index])) for index in (ke_arcmin.argmin(), ke_arcmin.argmax())
    )
    return lowest, highest


def _beat(theta: Array, ke_arcmin: Array, extremes: Extremes) -> go.Figure:
    low, high = _extremes_by_turn(theta, ke_arcmin)
    middle = np.arange(len(low)) + 0.5
    step = max(1, len(theta) // (len(low) * BEAT_POINTS_PER_TURN))
    made = figure("Input turns", "Kinematic error [arcmin]", height=380)
    made.add_scatter(
        x=(theta[::step] / (2 * math.pi)).astype(np.float32),
        y=ke_arcmin[::step].astype(np.float32),
        mode="lines",
        name="Kinematic error",
        line={"width": 0.8, "color": faded(BLUE, 0.55)},
        hoverinfo="skip",
    )
    for name, edge in (("Envelope of the peaks", high), ("", low)):
        made.add_scatter(
            x=middle,
            y=edge,
            mode="lines",
            name=name or "Envelope, lower",
            showlegend=bool(name),
            line={"width": 2, "color": INK, "shape": "spline", "smoothing": 0.6},
            hovertemplate="turn %{x:.0f}: %{y:.3f} arcmin<extra></extra>",
        )
    (_, lowest), (_, highest) = extremes
    for (angle, error), position in zip(extremes, ("bottom center", "top center"), strict=True):
        made.add_scatter(
            x=[angle / (2 * math.pi)],
            y=[error],
            mode="markers+text",
            showlegend=False,
            text=[f"{error:.3f}".replace("-", "−")],
            textposition=position,
            marker={"size": 8, "color": VERMILLION},
            textfont={"color": VERMILLION},
            name="Highest" if position.startswith("top") else "Lowest",
            hovertemplate="turn %{x:.2f}: %{y:.3f} arcmin",
        )
    margin = 0.12 * (highest - lowest)
    made.update_yaxes(range=[min(lowest, ke_arcmin.min()) - margin, max(highest, ke_arcmin.max()) + margin])
    made.update_xaxes(range=[0, len(low)])
    return made


def _one_turn(turns: Array, by_turn: Array) -> go.Figure:
    angle = np.linspace(0, 360, turns.shape[1])
    made = figure("Input angle [deg]", "Kinematic error [arcmin]", height=400)
    made.add_scatter(
        x=np.tile(np.append(angle, np.nan), len(turns)),
        y=np.hstack([turns, np.full((len(turns), 1), np.nan)]).ravel().astype(np.float32),
        mode="lines",
        name=f"All {counted(len(turns), 'turn')}",
        line={"width": 1, "color": faded(GREY, 0.22)},
        hoverinfo="skip",
    )
    for index, colour, name in ((by_turn.argmax(), VERMILLION, "Largest"), (by_turn.argmin(), BLUE, "Smallest")):
        made.add_scatter(
            x=angle,
            y=turns[index],
            mode="lines",
            name=f"{name}: turn {index + 1}, {by_turn[index]:.3f} arcmin",
            line={"width": 2.2, "color": colour},
            hovertemplate=HOVER,
        )
    made.update_xaxes(range=[0, 360], dtick=45)
    return made


def _carpet(turns: Array) -> go.Figure:
    made = figure("Input angle [deg]", "Input turn", height=440)
    made.add_heatmap(
        x=np.linspace(0, 360, turns.shape[1]),
        y=np.arange(1, len(turns) + 1),
        z=turns.astype(np.float32),
        zmin=float(turns.min()),
        zmax=float(turns.max()),
        zsmooth="best",
        colorscale=[list(stop) for stop in DIVERGING],
        name="Kinematic error",
        colorbar={"title": {"text": "arcmin"}},
        hovertemplate="turn %{y}, %{x:.0f} deg: %{z:.3f} arcmin<extra></extra>",
    )
    made.update_xaxes(range=[0, 360], dtick=45, showgrid=False)
    made.update_yaxes(range=[0.5, len(turns) + 0.5], showgrid=False)
    return made
