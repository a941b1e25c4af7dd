"""What effects add to the base model: how much each, and the waveform with and without them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any  # Any: rows of the JSON

import numpy as np

from hdopt.arrays import Array
from hdopt.report import Figure, Item, KeyFigures, Section, Table, Text
from hdopt.report.theme import BLUE, GREY, VERMILLION, faded, figure
from hdopt.words import listed

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go

WAYS = {1.0: "forward", -1.0: "backward"}


def effects_section(
    rows: Sequence[Mapping[str, Any]],
    theta: Array,
    base_arcmin: Array,
    passes_arcmin: Mapping[float, Array],
    *,
    base_peak_to_peak_arcmin: float,
    peak_to_peak_arcmin: float,
    notes: Sequence[str] = (),
    key: str = "effects",
) -> Section:
    """Effects of a drive and its bench.

    `rows` as in `KinematicErrorResult.effects`; `theta` input angle over one full relative turn, rad, shape (n,);
    `base_arcmin` the base model's error there, `passes_arcmin` the extended model's by direction (+1, -1), each (n,).
    `base_peak_to_peak_arcmin` and `peak_to_peak_arcmin` are the converged values of both; `notes` are sentences for
    below, `key` names the section.
    """
    counted = [row["id"].replace("_", " ") for row in rows if row["counted"]]
    items: list[Item] = [
        KeyFigures(
            {
                "Base model": f"{base_peak_to_peak_arcmin:.3f} arcmin",
                "With effects": f"{peak_to_peak_arcmin:.3f} arcmin",
            }
        ),
        Table(
            f"{key}-table",
            "Effects and what each adds to the peak-to-peak of the others",
            _table(rows),
            "The effects do not add up: in the meshing zones the larger deviation drives, and extremes need not meet.",
            {"adds_arcmin": ".4f"},
        ),
    ]
    if counted:
        items += [
            Figure(
                f"{key}-envelope",
                "Highest and lowest error of every input turn",
                _envelope(theta, base_arcmin, passes_arcmin),
                "Grey: the base model. Coloured: with the effects, in each direction of the motion.",
            ),
            Figure(
                f"{key}-turn",
                "The input turn with the largest error",
                _largest_turn(theta, base_arcmin, passes_arcmin),
                "The same turn of the base model in grey.",
            ),
        ]
    items += [Text(f"{note[:1].upper()}{note[1:]}.") for note in notes]
    says = (
        f"With {listed(counted)} the error is {peak_to_peak_arcmin:.3f} instead of "
        f"{base_peak_to_peak_arcmin:.3f} arcmin."
        if counted
        else "No effect counts here."
    )
    return Section(key, "What the base model leaves out", tuple(items), says)


def _table(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(
        [
            {
                "effect": row["id"].replace("_", " "),
                "belongs to": f"the {row['origin']}",
                "counted": "yes" if row["counted"] else "no",
                "adds_arcmin": row["adds_arcmin"],
                "numbers": ", ".join(f"{name} {_short(value)}" for name, value in row["parameters"].items()),
            }
            for row in rows
        ]
    )


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _by_turn(theta: Array, values: Array) -> Array:
    """`values` with one row an input turn; `theta` is even and holds whole turns."""
    turns = round((theta[-1] + theta[1] - 2 * theta[0]) / (2 * np.pi))
    return values.reshape(turns, -1)


def _envelope(theta: Array, base: Array, passes: Mapping[float, Array]) -> go.Figure:
    made = figure("Input turn", "Kinematic error [arcmin]", height=380)
    colours = {1.0: BLUE, -1.0: VERMILLION}
    curves = [("Base model", base, GREY)] + [
        (f"With effects, {WAYS[way]}", values, colours[way]) for way, values in passes.items()
    ]
    for name, values, colour in curves:
        turns = _by_turn(theta, values)
        x = np.arange(len(turns)) + 0.5
        made.add_scatter(x=x, y=turns.max(axis=1), mode="lines", name=name, line={"color": colour}, legendgroup=name)
        made.add_scatter(
            x=x,
            y=turns.min(axis=1),
            mode="lines",
            name=name,
            line={"color": colour},
            legendgroup=name,
            showlegend=False,
            fill="tonexty",
            fillcolor=faded(colour, 0.12),
        )
    made.update_xaxes(range=[0, len(turns)])
    return made


def _largest_turn(theta: Array, base: Array, passes: Mapping[float, Array]) -> go.Figure:
    way = max(passes, key=lambda w: np.ptp(_by_turn(theta, passes[w]), axis=1).max())
    turns = _by_turn(theta, passes[way])
    at = int(np.ptp(turns, axis=1).argmax())
    angle = np.arange(turns.shape[1]) * 360 / turns.shape[1]
    made = figure("Input angle [deg]", "Kinematic error [arcmin]", height=380)
    base_turn = _by_turn(theta, base)[at]
    made.add_scatter(x=angle, y=base_turn, mode="lines", name="Base model", line={"color": GREY})
    name = f"With effects, {WAYS[way]}, turn {at + 1}"
    made.add_scatter(x=angle, y=turns[at], mode="lines", name=name, line={"color": BLUE})
    made.update_xaxes(range=[0, 360], dtick=45)
    return made
