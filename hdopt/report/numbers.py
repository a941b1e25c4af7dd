"""The numbers behind a figure as one long table, so that whoever wants to redraw it finds them in a CSV file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any  # Any: Plotly's dictionaries and traces, which have no types

import numpy as np

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go

COORDINATES = ("x", "y", "z", "r", "theta")


def figure_frame(figure: go.Figure) -> pd.DataFrame:
    """One row a point: the trace's name, its coordinates, and the titles of its axes where the figure has several.

    A grid (heat map, contour) gives one row a cell. Left out are traces without data of these kinds, and traces that
    have neither a legend entry nor a hover label, which only decorate.
    """
    import pandas as pd

    traces = [trace for trace in figure.data if not _is_decoration(trace)]
    frames_and_titles = [
        (frame, _axis_titles(figure, trace)) for trace in traces if (frame := _trace_frame(trace)) is not None
    ]
    if not frames_and_titles:
        return pd.DataFrame()
    frames, titles = zip(*frames_and_titles, strict=True)
    several = len(set(titles)) > 1
    for frame, (x_title, y_title) in zip(frames, titles, strict=True):
        if several:
            frame.insert(1, "x_axis", x_title)
            frame.insert(2, "y_axis", y_title)
    joined: pd.DataFrame = pd.concat(frames, ignore_index=True)
    if not several:
        renamed = {"x": titles[0][0] or "x", "y": titles[0][1] or "y"}
        if len(set(renamed.values()) | {"trace", "z"}) == 4:
            joined = joined.rename(columns=renamed)
    return joined


def _is_decoration(trace: Any) -> bool:
    return getattr(trace, "hoverinfo", None) == "skip" and getattr(trace, "showlegend", None) is False


def _trace_frame(trace: Any) -> pd.DataFrame | None:
    import pandas as pd

    given = {}
    for name in COORDINATES:
        values = getattr(trace, name, None) if name in trace else None
        if values is not None and not isinstance(values, str):
            given[name] = np.asarray(values)
    name = trace.name or ""
    if "z" in given and given["z"].ndim == 2:
        rows, cols = given["z"].shape
        x = given.get("x", np.arange(cols))
        y = given.get("y", np.arange(rows))
        if len(x) != cols or len(y) != rows:
            return None
        grid = {"x": np.tile(x, rows), "y": np.repeat(y, cols), "z": given["z"].ravel()}
        return pd.DataFrame({"trace": name, **grid})
    flat = {key: values for key, values in given.items() if values.ndim == 1}
    if not flat or len({len(values) for values in flat.values()}) != 1:
        return None
    frame = pd.DataFrame({"trace": name, **flat})
    return frame.dropna(subset=list(flat), how="any")


def _axis_titles(figure: go.Figure, trace: Any) -> tuple[str, str]:
    def title(letter: str) -> str:
        if letter + "axis" not in trace or letter not in trace:
            return ""
        reference = getattr(trace, letter + "axis") or letter
        axis = figure.layout[f"{letter}axis{reference[1:]}"]
        return (axis.title.text or "").replace("<br>", " ")

    return title("x"), title("y")
