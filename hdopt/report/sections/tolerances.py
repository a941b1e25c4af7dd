"""Tolerances in a report: what they give, which of them matter, and what they should be."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any  # Any: Plotly's dictionaries and traces, which have no types

import numpy as np

from hdopt.report import Figure, Item, KeyFigures, Section, Table, Text
from hdopt.report.cells import EACH, NAMES, ROW, in_words, minus
from hdopt.report.sections.words import in_sentence, percent
from hdopt.report.theme import BLUE, GREEN, INK, ORANGE, PURPLE, VERMILLION, faded, figure
from hdopt.words import listed

if TYPE_CHECKING:
    from collections.abc import Iterable

    import pandas as pd
    import plotly.graph_objects as go

    from hdopt.allocation.results import AllocateResult
    from hdopt.tolerance.intervals import IntervalEstimate
    from hdopt.tolerance.results import SobolResult, StackResult
    from hdopt.tolerance.sensitivity import Shapley, Sobol
    from hdopt.tolerance.stack import Stack

JOINTLY = "directions_jointly"
"""The share of a linearised stack that its directions and phases have together."""
NIL_DIRECTIONS = (
    "A direction or phase has little or no share of its own here, because the line averages over it: what all of them "
    "do is the share of the directions jointly. Sobol' indices, where a page has them, count each as an input, so that "
    "one may lead there and be nil here."
)
TURNING = ("direction_deg", "phase_deg")
TURNING_INPUTS = (
    "A direction counts as an input here: it has a part wherever two eccentricities add as vectors, though no "
    "tolerance narrows it."
)
MOST_TICKS = 8
"""Of an axis in powers of two, before every other is left out."""
SMALLEST_SHARE = 0.0005
"""Contributions below this are left out of the figure, not of the table."""


def stack_section(result: StackResult, key: str = "stack") -> Section:
    """Distribution of the response in `result` against its limit, yield and capability, and what contributes; `key`
    names the section."""
    stack, unit, line = result.stack, result.stack.unit, result.stack.linearisation
    conforming, quantile = stack.conforming, stack.required_quantile
    shares = _shares(stack)
    verdict = "keep" if conforming.low >= stack.required_yield else "do not keep"
    most = [in_sentence(in_words(name)) for name in shares["input"][:2]]
    what = "drives" if result.method is not None else "assemblies"
    return Section(
        key,
        "What the tolerances give",
        (
            KeyFigures(_stack_figures(result)),
            Figure(
                f"{key}-distribution",
                "Distribution under the tolerances",
                _distribution(stack),
                f"{stack.n} {what}, {stack.sampling}. The vertical lines are the limit and the quantile of the "
                "required yield with its interval.",
            ),
            Table(
                f"{key}-figures",
                "The distribution in numbers, with 95 % intervals",
                stack.to_frame().reset_index(),
                formats=dict.fromkeys(("value", "low", "high"), ROW),
            ),
            Figure(
                f"{key}-contributions",
                "Contributions to the variance",
                _contributions(shares),
                f"Linearised where {what} are: magnitudes and absolute tilts at their mean, directions and phases "
                f"averaged. The line's spread is {line.std:.4g} {unit}, the real one {stack.std.value:.4g} {unit}; its "
                f"root-sum-square value at the required yield is "
                f"{_off(stack.rss - quantile.value)} {unit} off.",
            ),
            Table(
                f"{key}-contributions-table",
                "Contributions",
                shares,
                NIL_DIRECTIONS if JOINTLY in line.shares else "",
                {"share": ".3f", "input": NAMES, "operating point": EACH, f"slope, {unit} per unit": EACH},
            ),
            *(Text(note) for note in (*stack.notes, *result.notes)),
        ),
        f"As toleranced the {what} {verdict} the requirement: {percent(conforming.value)} stay within "
        f"{stack.limit:g} {unit}, {percent(stack.required_yield)} must. Most comes from {listed(most)}.",
    )


def _off(difference: float) -> str:
    """A `difference` with its sign, to three digits."""
    return minus(f"{difference:+.3g}")


def _stack_figures(result: StackResult) -> dict[str, str]:
    """The few numbers to see first."""
    stack, unit = result.stack, result.stack.unit
    conforming, quantile = stack.conforming, stack.required_quantile
    figures = {
        "Yield": f"{100 * conforming.value:.3f} % ({100 * conforming.low:.3f} to {100 * conforming.high:.3f})",
        "Required": f"{100 * stack.required_yield:.2f} % within {stack.limit:g} {unit}",
        f"Quantile {stack.required_yield:g}": (
            f"{quantile.value:.4g} {unit} ({quantile.low:.4g} to {quantile.high:.4g})"
        ),
        "Beyond the limit": f"{stack.ppm.value:.0f} ppm ({stack.ppm.low:.0f} to {stack.ppm.high:.0f})",
    }
    if stack.ppk is not None:
        figures["Ppk"] = f"{stack.ppk.value:.3f} ({stack.ppk.low:.3f} to {stack.ppk.high:.3f})"
    if result.worst_case is not None:
        worst = result.worst_case
        bound = "" if worst.bound is None else f", proven below {worst.bound:.4g}"
        figures["Worst case found"] = f"{worst.value:.4g} {unit}{bound}"
    if result.tail is not None:
        tail = result.tail
        figures[f"P(above {tail.limit:g} {unit})"] = f"{tail.probability:.3g} ({tail.low:.3g} to {tail.high:.3g})"
    return figures


def _shares(stack: Stack) -> pd.DataFrame:
    """Contributions to the variance, the largest first."""
    import pandas as pd

    line, unit = stack.linearisation, stack.unit
    return pd.DataFrame(
        {
            "input": list(line.shares),
            "share": list(line.shares.values()),
            "operating point": [line.point.get(name) for name in line.shares],
            f"slope, {unit} per unit": [line.slopes.get(name) for name in line.shares],
        }
    ).sort_values("share", ascending=False, ignore_index=True)


def _distribution(stack: Stack) -> go.Figure:
    edges, counts = (np.asarray(part, float) for part in stack.histogram)
    width = np.diff(edges)
    made = figure(f"Response [{stack.unit}]", "Probability density", height=400, bargap=0)
    centres = (edges[:-1] + edges[1:]) / 2
    density = counts / counts.sum() / width
    made.add_bar(
        x=centres,
        y=density,
        width=width,
        name="Sample",
        marker={"color": np.where(centres <= stack.limit, faded(BLUE, 0.75), faded(VERMILLION, 0.85)).tolist()},
        showlegend=False,
    )
    quantile = stack.required_quantile
    top = float(density.max()) * 1.05
    for name, x, colour, dash in (
        (f"Limit {stack.limit:g}", stack.limit, INK, "dash"),
        (f"Quantile {stack.required_yield:g}: {quantile.value:.4g}", quantile.value, VERMILLION, "solid"),
        (f"Root sum square: {stack.rss:.4g}", stack.rss, PURPLE, "dot"),
    ):
        made.add_scatter(
            x=[x, x], y=[0, top], mode="lines", name=name, line={"color": colour, "dash": dash, "width": 1.6}
        )
    made.add_vrect(quantile.low, quantile.high, fillcolor=faded(VERMILLION, 0.2), line_width=0)
    return made


def _contributions(shares: pd.DataFrame) -> go.Figure:
    shown = shares[shares["share"] > SMALLEST_SHARE].iloc[::-1]
    made = figure("Share of the variance [%]", "", height=90 + 30 * len(shown))
    made.add_bar(
        y=[in_words(name) for name in shown["input"]],
        x=100 * shown["share"],
        orientation="h",
        name="Share",
        marker={"color": BLUE},
        showlegend=False,
        text=[f"{100 * share:.1f}" for share in shown["share"]],
        textposition="outside",
        cliponaxis=False,
    )
    made.update_yaxes(showgrid=False, ticks="", showline=False)
    return made


def sobol_section(result: SobolResult, key: str = "sobol") -> Section:
    """Sobol' indices of a `result` with their intervals, how they settle, and the strongest pairs; Shapley effects
    where there are some. `key` names the section."""
    items: list[Item] = []
    most: list[str] = []
    if result.sobol is not None:
        sobol = result.sobol
        most = sorted(sobol.inputs, key=lambda name: -sobol.inputs[name].ST.value)[:2]
        items += [
            Figure(
                f"{key}-indices",
                "First-order and total Sobol' indices",
                _indices(sobol),
                f"{sobol.evaluations} drives; whiskers: {sobol.interval}. What the total index has more than the first "
                "is the input's part in interactions.",
            ),
            _index_table(sobol, key),
            Figure(
                f"{key}-convergence",
                "How the total indices settle",
                _convergence(sobol),
                "Total index over the points a scrambling, with its 95 % band.",
            ),
        ]
        if sobol.second:
            items.append(
                Figure(
                    f"{key}-pairs",
                    "Second-order indices",
                    _pairs(sobol),
                    "Variance that two inputs make together and neither alone. Hover for the interval.",
                )
            )
    if result.shapley is not None:
        shapley = result.shapley
        most = most or sorted(shapley.effects, key=lambda name: -shapley.effects[name].value)[:2]
        items += [
            Figure(
                f"{key}-shapley",
                "Shapley effects",
                _shapley(shapley),
                f"Shares of the variance that sum to 1, correlated or not; {shapley.interval}.",
            ),
            Table(
                f"{key}-shapley-table",
                "Shapley effects",
                shapley.to_frame().reset_index(),
                formats={"Shapley effect": ".3f", "low": ".3f", "high": ".3f", "player": NAMES},
            ),
        ]
    return Section(
        key,
        "Which tolerances matter",
        (*items, *(Text(note) for note in result.notes)),
        f"The spread comes most from {listed([in_sentence(in_words(name)) for name in most])}.",
    )


def _index_table(sobol: Sobol, key: str) -> Table:
    turning = any(name.endswith(TURNING) for name in sobol.inputs)
    frame = sobol.to_frame().reset_index()
    return Table(f"{key}-table", "Sobol' indices", frame, TURNING_INPUTS if turning else "", _index_formats())


def _index_formats() -> dict[str, str]:
    return {f"{index}{end}": ".3f" for index in ("S1", "ST") for end in ("", " low", " high")} | {"name": NAMES}


def _whiskers(estimates: Iterable[IntervalEstimate]) -> dict[str, Any]:
    values = np.array([[e.value, e.low, e.high] for e in estimates])
    return {
        "array": values[:, 2] - values[:, 0],
        "arrayminus": values[:, 0] - values[:, 1],
        "color": INK,
        "thickness": 1,
        "width": 3,
    }


def _indices(sobol: Sobol) -> go.Figure:
    rows = {**sobol.inputs, **sobol.groups}
    names = [in_words(name) for name in rows][::-1]
    made = figure("Sobol' index", "", height=110 + 34 * len(rows), barmode="group")
    for label, colour, estimates in (
        ("Total", ORANGE, [index.ST for index in rows.values()][::-1]),
        ("First order", BLUE, [index.S1 for index in rows.values()][::-1]),
    ):
        made.add_bar(
            y=names,
            x=[e.value for e in estimates],
            error_x=_whiskers(estimates),
            orientation="h",
            name=label,
            marker={"color": colour},
        )
    made.update_yaxes(showgrid=False, ticks="", showline=False)
    return made


def _convergence(sobol: Sobol) -> go.Figure:
    made = figure("Points a scrambling", "Total index", height=420)
    points = np.array(sobol.convergence.points)
    strongest = sorted(sobol.inputs, key=lambda name: -sobol.inputs[name].ST.value)[:6]
    from hdopt.report.theme import PALETTE

    for name, colour in zip(strongest, PALETTE, strict=False):
        value = np.array(sobol.convergence.ST[name])
        half = np.array(sobol.convergence.ST_half_width[name])
        made.add_scatter(
            x=np.concatenate([points, points[::-1]]),
            y=np.concatenate([value - half, (value + half)[::-1]]),
            fill="toself",
            fillcolor=faded(colour, 0.15),
            mode="lines",
            line={"width": 0},
            hoverinfo="skip",
            showlegend=False,
            name=in_words(name),
        )
        made.add_scatter(x=points, y=value, mode="lines+markers", name=in_words(name), line={"color": colour})
    shown = points[:: 1 + len(points) // MOST_TICKS]
    made.update_xaxes(type="log", tickvals=shown, ticktext=[f"{value:.0f}" for value in shown])
    return made


def _pairs(sobol: Sobol) -> go.Figure:
    names = list(sobol.inputs)
    values = np.full((len(names), len(names)), np.nan)
    texts = np.full((len(names), len(names)), "", dtype=object)
    for (a, b), estimate in sobol.second.items():
        for i, j in ((names.index(a), names.index(b)), (names.index(b), names.index(a))):
            values[i, j] = max(estimate.value, 0.0)
            texts[i, j] = f"{estimate.value:.4f} ({estimate.low:.4f} to {estimate.high:.4f})"
    labels = [in_words(name) for name in names]
    made = figure("", "", height=160 + 34 * len(names))
    from hdopt.report.theme import SEQUENTIAL

    made.add_heatmap(
        x=labels,
        y=labels,
        z=values,
        text=texts,
        name="S2",
        colorscale=[list(stop) for stop in SEQUENTIAL],
        colorbar={"title": {"text": "second-order index"}},
        hovertemplate="%{y} and %{x}<br><b>%{text}</b><extra></extra>",
    )
    made.update_yaxes(autorange="reversed", showgrid=False)
    made.update_xaxes(showgrid=False, tickangle=-40)
    return made


def _shapley(shapley: Shapley) -> go.Figure:
    effects = dict(sorted(shapley.effects.items(), key=lambda item: item[1].value))
    made = figure("Shapley effect", "", height=100 + 34 * len(effects))
    made.add_bar(
        y=[in_words(name) for name in effects],
        x=[e.value for e in effects.values()],
        error_x=_whiskers(effects.values()),
        orientation="h",
        marker={"color": BLUE},
        showlegend=False,
        name="Shapley effect",
    )
    made.update_yaxes(showgrid=False, ticks="", showline=False)
    return made


def allocate_section(result: AllocateResult, key: str = "allocate") -> Section:
    """Allocated tolerances in `result`, the rules side by side, and what tightening the requirement costs; `key` names
    the section."""
    sources = sorted({row.source for row in result.errors.values()})
    flags = sorted({row.extrapolated for row in result.errors.values() if row.extrapolated})
    items: list[Item] = [
        KeyFigures(_allocate_figures(result)),
        Table(
            f"{key}-tolerances",
            "Allocated tolerances",
            result.to_frame().reset_index(),
            f"Costs: {listed(sources)}." + "".join(f" Extrapolated: {flag}." for flag in flags),
            {"present tolerance": EACH, "tolerance": EACH, "present cost": ".3f", "cost": ".3f", "error": NAMES},
        ),
    ]
    if result.comparison:
        items += [
            Table(
                f"{key}-rules",
                "The rules side by side",
                _rules(result),
                "Every rule's tolerances, judged by the same stack of the real response.",
                {"cost": ".3f", "yield": ".4f", "low": ".4f", "high": ".4f", "rule": NAMES},
            ),
            Figure(
                f"{key}-comparison",
                "Tolerances by rule",
                _comparison(result),
                "Each tolerance as a multiple of the present one.",
            ),
        ]
    if len(result.cost_curve) > 1:
        items.append(
            Figure(
                f"{key}-curve",
                "What tightening the requirement costs",
                _curve(result),
                "Least cost over the requirement, before the correction by a larger sample that the cost above has "
                "(within about 1 % of the limit); the point is the requirement as it stands.",
            )
        )
    items.append(Text(f"Optimality gap: {result.optimality_gap_reason}."))
    items += [Text(note) for note in result.notes]
    change = result.total_cost - result.present_cost
    return Section(
        key,
        "What the tolerances should be",
        tuple(items),
        f"The {result.rule.replace('_', ' ')} rule {_meets(result)} at a cost of {result.total_cost:.4g}"
        + (f", {abs(change):.3g} {'more' if change > 0 else 'less'} than now." if np.isfinite(change) else "."),
    )


def _meets(result: AllocateResult) -> str:
    if result.accepted:
        return "meets the requirement"
    return f"finds tolerances of which only {100 * result.verified_yield.value:.3f} % are verified,"


def _allocate_figures(result: AllocateResult) -> dict[str, str]:
    check = result.verified_yield
    now = f"{result.present_cost:.4g}" if np.isfinite(result.present_cost) else "not known"
    figures = {
        "Cost": f"{result.total_cost:.4g} (as toleranced now: {now})",
        "Verified yield": f"{100 * check.value:.3f} % ({100 * check.low:.3f} to {100 * check.high:.3f})",
        "Status": result.status,
        "Optimality gap": "not known" if result.optimality_gap is None else f"{100 * result.optimality_gap:.2g} %",
    }
    if result.marginal_cost is not None:
        figures["Marginal cost"] = f"{result.marginal_cost:.4g} per {result.unit}"
    return figures


def _rules(result: AllocateResult) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(
        [
            {
                "rule": outcome.rule,
                "cost": outcome.total_cost,
                "yield": outcome.conforming.value,
                "low": outcome.conforming.low,
                "high": outcome.conforming.high,
                f"quantile at the required yield, {result.unit}": outcome.required_quantile,
                f"response as the rule sees it, {result.unit}": outcome.modelled,
                "note": outcome.note,
            }
            for outcome in result.comparison
        ]
    )


def _comparison(result: AllocateResult) -> go.Figure:
    from hdopt.report.theme import PALETTE

    made = figure("", "Tolerance, multiple of the present one", height=420, barmode="group")
    for outcome, colour in zip(result.comparison, PALETTE, strict=False):
        names = [name for name in result.errors if name in outcome.tolerances]
        made.add_bar(
            x=[in_words(name) for name in names],
            y=[outcome.tolerances[name] / result.errors[name].present for name in names],
            name=outcome.rule.replace("_", " "),
            marker={"color": colour},
        )
    made.add_hline(1.0, line={"color": INK, "width": 1, "dash": "dot"})
    return made


def _curve(result: AllocateResult) -> go.Figure:
    limits, costs = np.array(result.cost_curve).T
    made = figure(f"Requirement [{result.unit}]", "Least cost", height=380)
    made.add_scatter(x=limits, y=costs, mode="lines+markers", name="Least cost", line={"color": BLUE})
    made.add_scatter(
        x=[result.limit],
        y=[result.total_cost],
        mode="markers",
        name="As required",
        marker={"color": GREEN, "size": 11, "symbol": "diamond"},
    )
    return made
