"""Where a choice holds, drawn: along each constant of the trade, and over two of them at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import pandas as pd

from hdopt.optimize.records import DesignRecord
from hdopt.optimize.region_records import NONE_LEFT, Boundary, ConstantRange, RegionMap, Regions
from hdopt.optimize.summary import number
from hdopt.report import Figure, Table
from hdopt.report.sections.words import in_sentence, label
from hdopt.report.theme import BLUE, GREY, GRID, INK, PALETTE, PAPER, VERMILLION, faded, figure

if TYPE_CHECKING:
    import plotly.graph_objects as go

CHOICE = ("structure", "profile")
HIDDEN = "Constants that change nothing within reach are in the table only."


def region_items(best: DesignRecord, regions: Regions, key: str) -> tuple[Figure | Table, ...]:
    """The figures and the table of `regions` about the `best` design; `key` begins their keys."""
    reach = max((r.highest for r in regions.ranges), default=1.0)
    return (
        Figure(
            f"{key}-figure",
            "How far each constant may go before another choice is the better",
            _bars(regions.ranges),
            "Wide bars: structure and profile stay. Dark bars: today's numbers keep all limits and are within 1 % of "
            "the best; where a limit holds the design, they end at once on one side. Marks: what is chosen beyond. "
            "Followed "
            f"from {1 / reach:.2f} to {reach:g} times each value; boundaries to 0.5 %, by local searches. {HIDDEN}",
        ),
        *(
            Figure(
                f"{key}-map-{place}",
                f"What is chosen over two constants: {drawn.x}; {drawn.y}",
                _map(drawn),
                "The cross is today's choice. Inside the line today's numbers keep all limits. Searched on a coarse "
                "grid, and twice as fine where the choice changes.",
            )
            for place, drawn in enumerate(regions.maps, 1)
        ),
        Table(
            f"{key}-boundaries",
            "Every constant of the trade, its source, and the nearest boundaries",
            pd.DataFrame([_row(constant) for constant in _nearest_first(regions.ranges)]),
            f"In per cent of the constant; a dash: none within reach. Chosen today: {_name(best.name)}.",
        ),
    )


def _name(choice: str) -> str:
    """'two_disk, one_way_major' for reading."""
    return ", ".join(in_sentence(label(part)) for part in choice.split(", "))


def _beyond(boundary: Boundary) -> str:
    known = boundary.becomes if boundary.level == "design" or boundary.becomes == NONE_LEFT else _name(boundary.becomes)
    return f"{boundary.per_cent:+.1f} %: {known}".replace("-", "−", 1)


def _row(constant: ConstantRange) -> dict[str, str]:
    row = {"constant": constant.constant, "value": number(constant.value, constant.unit)}
    for level in (*CHOICE, "design"):
        found = [b for upward in (False, True) if (b := constant.at(level, upward)) is not None]
        row["today's numbers" if level == "design" else level] = "; ".join(map(_beyond, found)) or "–"
    return row | {"source": constant.source}


def _ends(constant: ConstantRange, *levels: str) -> tuple[float, float]:
    """How far the constant may fall and rise, in per cent, before one of `levels` changes."""
    low = [b.factor for level in levels if (b := constant.at(level, False)) is not None]
    high = [b.factor for level in levels if (b := constant.at(level, True)) is not None]
    return 100 * (max(low, default=constant.lowest) - 1), 100 * (min(high, default=constant.highest) - 1)


def _nearest_first(ranges: Sequence[ConstantRange]) -> list[ConstantRange]:
    return sorted(ranges, key=lambda r: (not r.boundaries, min(map(abs, _ends(r, *CHOICE)))))


def _bars(ranges: Sequence[ConstantRange]) -> go.Figure:
    shown = [r for r in _nearest_first(ranges) if r.boundaries]
    made = figure("Change of the constant [%]", "", height=130 + 30 * len(shown), barmode="overlay")
    for name, levels, colour, width in (
        ("structure and profile stay", CHOICE, faded(BLUE, 0.35), 0.7),
        ("today's numbers hold", ("design", *CHOICE), INK, 0.25),
    ):
        ends = [_ends(r, *levels) for r in shown]
        made.add_bar(
            y=[r.constant for r in shown],
            x=[high - low for low, high in ends],
            base=[low for low, _ in ends],
            width=width,
            orientation="h",
            name=name,
            marker={"color": colour},
            text=[f"{low:+.1f} to {high:+.1f} %" for low, high in ends],
            textposition="none",
            hovertemplate="%{y}<br>" + name + ": %{text}<extra></extra>",
        )
    marks = [(r, b) for r in shown for level in CHOICE for b in r.boundaries if b.level == level]
    for what, symbol, colour, among in (
        ("another structure", "diamond", VERMILLION, [m for m in marks if m[1].level == "structure"]),
        ("another profile", "circle", PALETTE[2], [m for m in marks if m[1].level == "profile"]),
    ):
        shown_marks = [m for m in among if m[1].becomes != NONE_LEFT]
        _marks(made, what, symbol, colour, shown_marks)
    lost = {(r.constant, b.factor): (r, b) for r, b in marks if b.becomes == NONE_LEFT}
    _marks(made, NONE_LEFT, "x", GREY, list(lost.values()))
    made.add_vline(x=0, line={"color": INK, "width": 1})
    made.update_yaxes(autorange="reversed")
    return made


def _marks(
    made: go.Figure, name: str, symbol: str, colour: str, marks: Sequence[tuple[ConstantRange, Boundary]]
) -> None:
    if marks:
        made.add_scatter(
            x=[b.per_cent for _, b in marks],
            y=[r.constant for r, _ in marks],
            mode="markers",
            name=name,
            marker={"symbol": symbol, "size": 11, "color": colour, "line": {"color": PAPER, "width": 1}},
            text=[_beyond(b) for _, b in marks],
            hovertemplate="%{y}<br>%{text}<extra></extra>",
        )


def _map(drawn: RegionMap) -> go.Figure:
    made = figure(f"{drawn.x}, times its value", f"{drawn.y}, times its value", height=460)
    colours = [GRID, *(faded(colour, 0.55) for colour in PALETTE)][: len(drawn.choices) + 1]
    count = len(colours)
    scale = [(edge, colour) for i, colour in enumerate(colours) for edge in (i / count, (i + 1) / count)]
    names = [_name(choice) for choice in drawn.choices]
    made.add_heatmap(
        x=drawn.x_factors,
        y=drawn.y_factors,
        z=drawn.chosen,
        zmin=-1.5,
        zmax=count - 1.5,
        colorscale=scale,
        showscale=False,
        text=[[names[k] if k >= 0 else NONE_LEFT for k in row] for row in drawn.chosen],
        hovertemplate="%{x:.3f}, %{y:.3f}<br>%{text}<extra></extra>",
    )
    present = {k for row in drawn.chosen for k in row}
    for k, name in ((-1, NONE_LEFT), *enumerate(names)):
        if k in present:
            marker = {"size": 12, "symbol": "square", "color": colours[k + 1]}
            made.add_scatter(x=[None], y=[None], mode="markers", name=name, marker=marker)
    made.add_contour(
        x=drawn.x_factors,
        y=drawn.y_factors,
        z=drawn.excess,
        contours={"start": 1e-4, "end": 1e-4, "size": 1, "coloring": "none"},
        line={"color": INK, "width": 1.5, "dash": "dash"},
        showscale=False,
        showlegend=True,
        name="today's numbers keep all limits",
        hoverinfo="skip",
    )
    marker = {"size": 13, "symbol": "x", "color": VERMILLION, "line": {"color": PAPER, "width": 1}}
    made.add_scatter(x=[1.0], y=[1.0], mode="markers", name="today", marker=marker, hoverinfo="skip")
    return made
