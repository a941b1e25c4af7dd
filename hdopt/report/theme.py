"""How every figure looks: one Plotly template, one palette, one scale a kind of quantity.

The colours are those of Okabe and Ito (2008), which people with the common kinds of colour blindness can tell apart,
in an order that keeps neighbours apart in grey as well; the sequential scale has steadily falling lightness.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import plotly.graph_objects as go

FONT = '"Segoe UI", "Helvetica Neue", Roboto, "Liberation Sans", Arial, sans-serif'

INK = "#1f2933"
MUTED = "#5f6b7a"
GRID = "#e6e9ee"
AXIS = "#9aa5b1"
PAPER = "#ffffff"

BLUE = "#0072b2"
VERMILLION = "#d55e00"
GREEN = "#009e73"
PURPLE = "#b5558a"
SKY = "#56b4e9"
ORANGE = "#e69f00"
GREY = "#7b8794"
PALETTE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, GREY)

SEQUENTIAL = (
    (0.0, "#f4f9fb"),
    (0.2, "#cfe5ec"),
    (0.4, "#94c6d8"),
    (0.6, "#4f9dbf"),
    (0.8, "#1f6f9f"),
    (1.0, "#0b3c68"),
)
"""For a quantity that has one end: light is small, dark is large."""

DIVERGING = (
    (0.0, "#0b5a8f"),
    (0.25, "#6fb1d6"),
    (0.5, "#f5f6f7"),
    (0.75, "#eda876"),
    (1.0, "#b34700"),
)
"""For a quantity that has a middle, such as a difference: blue below, vermillion above."""

HEIGHT = 400
"""Height of a figure that asks for none, px."""


def faded(colour: str, opacity: float) -> str:
    """`colour` '#rrggbb' as an rgba() of the given `opacity`, 0 to 1, for fills and bands."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity:g})"


_AXIS = {
    "automargin": True,
    "gridcolor": GRID,
    "linecolor": AXIS,
    "showline": True,
    "ticks": "outside",
    "ticklen": 4,
    "tickcolor": AXIS,
    "zeroline": False,
    "title": {"font": {"size": 13, "color": MUTED}, "standoff": 10},
    "hoverformat": ".4~g",
    "minor": {"showgrid": False},
}
_COLOUR_BAR = {
    "outlinewidth": 0,
    "thickness": 12,
    "ticklen": 4,
    "tickcolor": AXIS,
    "title": {"side": "right", "font": {"size": 13, "color": MUTED}},
}


def template() -> go.layout.Template:
    """The template that `hdopt.report.html` gives to every figure of a report."""
    import plotly.graph_objects as go

    polar_axis = {"gridcolor": GRID, "linecolor": AXIS, "tickcolor": AXIS}
    sequential = [list(stop) for stop in SEQUENTIAL]
    return go.layout.Template(
        layout={
            "font": {"family": FONT, "size": 13, "color": INK},
            "colorway": list(PALETTE),
            "colorscale": {"sequential": sequential, "diverging": [list(stop) for stop in DIVERGING]},
            "paper_bgcolor": PAPER,
            "plot_bgcolor": PAPER,
            "margin": {"l": 64, "r": 16, "t": 12, "b": 52},
            "hovermode": "closest",
            "hoverlabel": {
                "bgcolor": PAPER,
                "bordercolor": AXIS,
                "font": {"family": FONT, "size": 13, "color": INK},
                "align": "left",
                "namelength": -1,
            },
            "legend": {
                "orientation": "h",
                "x": 0,
                "xanchor": "left",
                "y": 1.02,
                "yanchor": "bottom",
                "bgcolor": "rgba(0,0,0,0)",
                "title": {"font": {"color": MUTED}},
            },
            "xaxis": _AXIS,
            "yaxis": _AXIS,
            "polar": {"bgcolor": PAPER, "radialaxis": polar_axis, "angularaxis": polar_axis},
            "bargap": 0.35,
            "bargroupgap": 0.08,
            "annotationdefaults": {"font": {"size": 12, "color": MUTED}, "showarrow": False},
            "shapedefaults": {"line": {"color": MUTED, "width": 1}},
            "separators": ".\u202f",
        },
        data={
            "scatter": [{"line": {"width": 2, "simplify": False}, "marker": {"size": 7, "colorbar": _COLOUR_BAR}}],
            "bar": [{"marker": {"line": {"width": 0}}}],
            "heatmap": [{"colorscale": sequential, "colorbar": _COLOUR_BAR}],
            "contour": [{"colorscale": sequential, "colorbar": _COLOUR_BAR}],
            "histogram": [{"marker": {"line": {"width": 0}}}],
        },
    )


def figure(x_title: str = "", y_title: str = "", height: int = HEIGHT, **layout: object) -> go.Figure:
    """An empty figure in the report's style, `height` px high, its axes titled `x_title` and `y_title`; `layout` goes
    to Plotly's `update_layout`."""
    import plotly.graph_objects as go

    made = go.Figure(layout={"template": template()})
    made.update_layout(height=height, **layout)
    made.update_xaxes(title_text=x_title)
    made.update_yaxes(title_text=y_title)
    return made
