"""What `plot()` of a result gives: the Plotly figure, or the same drawn by matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any  # Any: Plotly's traces and shapes, which have no types

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError, MissingLibrary, unknown_name

if TYPE_CHECKING:
    import plotly.graph_objects as go
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as MatplotlibFigure

BACKENDS = ("plotly", "matplotlib")
LINES = {"dash": "--", "dot": ":", "dashdot": "-."}
"""Plotly's name of a broken line -> matplotlib's."""
GROUP = 0.8
"""Share of a category that its bars take, as Plotly's."""


def drawn(figure: go.Figure, backend: str) -> go.Figure | MatplotlibFigure:
    """The `figure` itself for the `backend` "plotly"; for "matplotlib" its lines, points and bars drawn by that.

    A matplotlib figure belongs to no window: save it with `savefig`, or let a notebook show it. Raises `HdoptError` for
    another backend, and for a figure of traces that are neither lines, points nor bars; `MissingLibrary` where
    matplotlib is not installed.
    """
    if backend not in BACKENDS:
        raise HdoptError(unknown_name("backend", backend, BACKENDS))
    return figure if backend == "plotly" else _by_matplotlib(figure)


def _by_matplotlib(figure: go.Figure) -> MatplotlibFigure:
    try:
        from matplotlib.figure import Figure as MatplotlibFigure
    except ImportError as error:
        raise MissingLibrary(f"matplotlib cannot be loaded ({error}); install it, or leave backend out") from error
    others = sorted({trace.type for trace in figure.data} - {"scatter", "scattergl", "bar"})
    if others:
        raise HdoptError(f"matplotlib draws lines, points and bars here, not {', '.join(others)}; leave backend out")
    made = MatplotlibFigure(figsize=(8, 5), layout="constrained")
    rows = _rows(figure)
    panels = made.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    for axes, row in zip(panels, rows, strict=True):
        _draw_row(axes, figure, row)
    panels[-1].set_xlabel(figure.layout.xaxis.title.text or "")
    made.suptitle(figure.layout.title.text or "")
    return made


def _rows(figure: go.Figure) -> list[str]:
    """The vertical axes of `figure` that traces lie on, 'y' or 'y2', the uppermost first."""
    names = {trace.yaxis or "y" for trace in figure.data}
    return sorted(names, key=lambda name: _axis(figure, name).domain or (0, 1), reverse=True)


def _axis(figure: go.Figure, name: str) -> Any:
    return figure.layout[f"{name[0]}axis{name[1:]}"]


def _draw_row(axes: Axes, figure: go.Figure, row: str) -> None:
    traces = [trace for trace in figure.data if (trace.yaxis or "y") == row]
    _draw_bars(axes, [trace for trace in traces if trace.type == "bar"])
    for trace in traces:
        if trace.type != "bar":
            _draw_points(axes, trace)
    for shape in figure.layout.shapes:
        style: dict[str, Any] = {"linestyle": LINES.get(shape.line.dash, "-"), "color": "0.3", "linewidth": 1}
        if shape.x0 == shape.x1:
            axes.axvline(shape.x0, **style)
        elif shape.y0 == shape.y1:
            axes.axhline(shape.y0, **style)
    for note in figure.layout.annotations:  # those of a line across, which stand at its end
        if str(note.xref).endswith("domain"):
            axes.text(1, note.y, note.text, transform=axes.get_yaxis_transform(), ha="right", va="bottom")
        elif str(note.yref).endswith("domain"):
            axes.text(note.x, 1, note.text, transform=axes.get_xaxis_transform(), ha="left", va="top")
    if sum(bool(trace.name) for trace in traces) > 1:
        axes.legend()
    vertical = _axis(figure, row)
    axes.set_ylabel(vertical.title.text or "")
    if figure.layout.xaxis.type == "log":
        axes.set_xscale("log")
    if vertical.type == "log":
        axes.set_yscale("log")
    if vertical.scaleanchor:
        axes.set_aspect("equal")


def _draw_points(axes: Axes, trace: Any) -> None:
    mode = trace.mode or "lines"
    line = LINES.get(trace.line.dash, "-") if "lines" in mode else ""
    marker = "o" if "markers" in mode else ""
    width = trace.line.width or 1.5
    axes.plot(trace.x, trace.y, linestyle=line, marker=marker, markersize=4, linewidth=width, label=trace.name)


def _draw_bars(axes: Axes, traces: list[Any]) -> None:
    """Bars beside each other where several stand at one category; with errors where a trace has them."""
    if not traces:
        return
    lying = traces[0].orientation == "h"
    places = [trace.y if lying else trace.x for trace in traces]
    names = list(dict.fromkeys(str(place) for some in places for place in some))
    named = any(isinstance(place, str) for some in places for place in some)
    for number, (trace, some) in enumerate(zip(traces, places, strict=True)):
        share = GROUP / len(traces)
        at: Array = np.array([names.index(str(place)) for place in some]) if named else np.asarray(some, float)
        thick: float | Array = share if trace.width is None else np.asarray(trace.width, float)
        at = at + (number - (len(traces) - 1) / 2) * share if named else at
        error = trace.error_x if lying else trace.error_y
        ends = None if error.array is None else _ends(error)
        if lying:
            axes.barh(at, trace.x, thick, label=trace.name, xerr=ends)
        else:
            axes.bar(at, trace.y, thick, label=trace.name, yerr=ends)
    if named and lying:
        axes.set_yticks(range(len(names)), names)
    elif named:
        axes.set_xticks(range(len(names)), names, rotation=45 if len(names) > 6 else 0)


def _ends(error: Any) -> Array:
    """Lengths of the error bars below and above, shape (2, n)."""
    above = np.asarray(error.array, float)
    below = above if error.arrayminus is None else np.asarray(error.arrayminus, float)
    return np.stack([below, above])
