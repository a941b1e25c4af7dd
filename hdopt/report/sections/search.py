"""The trade report: the chosen wave generator, the fronts it was chosen from, its price, and how sure the choice is."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any  # Any: values of JSON

import pandas as pd

from hdopt.optimize.design_space import VARIABLES
from hdopt.optimize.objectives import NOMINAL, QUANTITIES, ROBUST, Quantity, find_quantity
from hdopt.optimize.records import DesignRecord, Front, SearchResult, Verification
from hdopt.optimize.summary import (
    NOT_MODELLED,
    break_evens,
    nearest_boundary,
    number,
    ring_share,
    structure_costs,
    weighed,
)
from hdopt.optimize.views import DesignMap, Rings, TradeViews
from hdopt.report import Figure, Item, KeyFigures, Points, Section, Table, Text
from hdopt.report.cells import UNITS, significant
from hdopt.report.sections.design_map import Design, design_map, words_on_limits
from hdopt.report.sections.design_map import Limit as MapLimit
from hdopt.report.sections.profiles import profiles_section
from hdopt.report.sections.regions import region_items
from hdopt.report.sections.words import in_sentence, label
from hdopt.report.theme import GREY, INK, PALETTE, PAPER, VERMILLION, faded, figure
from hdopt.words import counted, listed

if TYPE_CHECKING:
    import plotly.graph_objects as go


DASHES = {"integral": "dash", "automatic": "solid", "one_way_major": "dashdot", "one_way_minor": "dot"}
AXES = ("pressure_angle_deg", "width_mm", "module_mm", "deflection_ratio", "wrap_angle_deg")
PARALLEL = (
    NOMINAL,
    ROBUST,
    "flank_pressure_mpa",
    "bending_stress_mpa",
    "carrying_teeth",
    "bearing_life_h",
    "lag_arcmin",
)
Axis = tuple[str, str, str, Callable[[DesignRecord], float | None]]
"""Of parallel coordinates: key, title, unit, and how to read it from a design."""

CURVES = 6
"""Combinations with a curve of their own in the figure of a front."""
LINES = 30
"""Designs with a line of their own in parallel coordinates."""
NIL = 1e-6
"""A quantity below this share of the baseline's is nil: what a limit at zero leaves of rounding."""
CHANGED = 5e-4
"""A quantity that differs by less than this share is called unchanged."""


def trade_sections(
    result: SearchResult,
    views: TradeViews,
    checked: Verification,
    file: str,
) -> tuple[Section, ...]:
    """All sections of the trade report, in reading order.

    `result` is that of the search, `views` its map and rings, `checked` its best design checked by other means;
    `file` is the name of the chosen design's study file.
    """
    return (
        chosen_section(result, file),
        *(front_section(result, front) for front in result.fronts),
        designs_section(result),
        map_section(result, views.design_map),
        rings_section(result, views.rings),
        confidence_section(result, checked),
    )


def name_of(design: DesignRecord) -> str:
    """Profile and structure of a `design`: 'Two-disk, integral'."""
    return f"{label(design.profile)}, {in_sentence(label(design.structure))}"


def hover(design: DesignRecord) -> str:
    """All of a `design` for a hover label: its variables and quantities, a line each, as HTML."""
    lines = [f"<b>{name_of(design)}</b>"]
    lines += [f"{VARIABLES[k][0]} {number(v, VARIABLES[k][1])}" for k, v in design.variables.items()]
    shown = [key for key in PARALLEL if key in design.quantities]
    lines += [f"{QUANTITIES[k].title} {number(design.quantities[k], QUANTITIES[k].unit)}" for k in shown]
    return "<br>".join(lines)


def chosen_section(result: SearchResult, file: str, key: str = "trade-chosen") -> Section:
    """The best design of a `result` against the study's own drive: what it gains and pays, what holds it, and every
    combination at its own best. `file` is the name of its study file, `key` begins the keys of the tables."""
    best, baseline = result.best, result.baseline
    objective = find_quantity(result.objective)
    after, before = best.quantities[result.objective], baseline.quantities[result.objective]
    values = {objective.title: number(after, objective.unit), "Baseline": number(before, objective.unit)}
    values |= {VARIABLES[k][0]: number(v, VARIABLES[k][1]) for k, v in best.variables.items() if k != "module_mm"}
    held = [in_sentence(p["title"]) for p in result.active if "bound" not in p["kind"]]
    at_bound = [in_sentence(p["title"]) for p in result.active if "bound" in p["kind"]]
    others = sorted(
        (d for d in result.combinations if d.feasible and d.name != best.name),
        key=lambda d: weighed(result, d),
    )
    costs = " (with what structures cost)" if result.setup.trade.structure_costs else ""
    why = f"{name_of(best)} has the least {in_sentence(objective.title)}{costs} of all designs that keep every limit"
    if others:
        next_best = others[0]
        gap = weighed(result, next_best) / weighed(result, best) - 1
        why += f"; the next combination, {in_sentence(name_of(next_best))}, is {100 * gap:.2g} % above it"
    why += f". It is held by {listed(held)}. " if held else ". "
    if at_bound:
        why += f"At a bound of its range is {listed(at_bound)}: the table says what that costs."
    else:
        why += "No variable lies at a bound of its range: the limits set the optimum, not the search's own box."
    return Section(
        key,
        "The chosen wave generator",
        (
            KeyFigures(values),
            Text(why),
            Table(f"{key}-against-baseline", "Chosen against baseline", _against_baseline(result)),
            Table(
                f"{key}-prices",
                "What holds the design, and what giving way would be worth",
                pd.DataFrame([_price_row(price) for price in result.active]),
                "From the multipliers at the optimum: the fall of the objective for one unit more room.",
            ),
            Table(f"{key}-combinations", "Every profile and structure at its own best", _combinations(result)),
            *_not_modelled(result),
        ),
        f"{name_of(best)}: {number(after, objective.unit)} instead of {number(before, objective.unit)}. "
        f"Its study file is {file}.",
    )


def _not_modelled(result: SearchResult) -> tuple[Item, ...]:
    """What no formula knows, and how much of it would change the structure that `result` chose."""
    words = []
    if gaps := break_evens(result):
        structure = in_sentence(label(result.best.structure))
        more = "a further" if result.setup.trade.structure_costs else "worth"
        worth = _in_words("; ".join(gaps))
        words.append(f"The structure ({structure}) stays the choice until what it costs is {more} {worth}.")
    if costs := structure_costs(result):
        words.append(f"{_in_words(costs[:1].upper() + costs[1:])}.")
    if share := ring_share(result.baseline):
        words.append(f"Of the drive as it is: {share}.")
    unknown = [f"{what[:1].upper()}{what[1:]}." for what in NOT_MODELLED]
    return Text("Not modelled, and to be weighed beside the tables:"), Points((*unknown, *words))


def _in_words(says: str) -> str:
    """What is said of structures by their keys, in words; an example of the study file stays as it is written."""
    prose, brace, example = says.partition("{")
    for structure in DASHES:
        prose = re.sub(rf"\b{structure}\b", in_sentence(label(structure)).replace(", ", " on the "), prose)
    prose = prose.replace("search.trade.structure_cost_percent", "`search.trade.structure_cost_percent`")
    return f"{prose}`{brace}{example}`" if brace else prose


def _against_baseline(result: SearchResult) -> pd.DataFrame:
    rows = []
    best, baseline = result.best, result.baseline
    rows.append(("Profile", label(baseline.profile), label(best.profile), "", ""))
    rows.append(("Structure", label(baseline.structure), label(best.structure), "", ""))
    for key, value in best.variables.items():
        title, unit = VARIABLES[key]
        before = baseline.variables.get(key)
        rows.append((title, number(before, unit) if before is not None else "–", number(value, unit), "", ""))
    for key, value in best.quantities.items():
        quantity, before = QUANTITIES[key], baseline.quantities[key]
        if key == "width_mm":
            continue
        value = 0.0 if abs(value) < NIL * abs(before) else value
        share = value / before - 1 if before else 0.0
        if abs(share) < CHANGED:
            verdict = "unchanged"
        elif key == "ratio":
            verdict = ""
        else:
            verdict = "improved" if (share < 0) == quantity.small_is_good else "paid"
        change = "" if verdict == "unchanged" else f"{100 * share:+.1f} %".replace("-", "−")
        unit = UNITS.get(quantity.unit, quantity.unit)
        rows.append((quantity.title, number(before, unit), number(value, unit), change, verdict))
    return pd.DataFrame(rows, columns=["what", "baseline", "chosen", "change", "verdict"])


def _price_row(price: Mapping[str, Any]) -> dict[str, str]:
    return {
        "what": price["title"],
        "kind": price["kind"],
        "at": number(price["at"], price["unit"]),
        "one unit is worth": f"{price['per_unit']:.3g} arcmin per {price['unit'] or 'unit'}",
        "one per cent is worth": f"{0.01 * abs(price['at']) * price['per_unit']:.2g} arcmin" if price["at"] else "–",
    }


def _combinations(result: SearchResult) -> pd.DataFrame:
    rows = []
    order = sorted(result.combinations, key=lambda d: (not d.feasible, d.quantities[result.objective]))
    for design in order:
        row: dict[str, object] = {"profile": label(design.profile), "structure": label(design.structure)}
        row |= {key: design.variables.get(key) for key in AXES}
        row |= {key: design.quantities.get(key) for key in (NOMINAL, ROBUST) if key in design.quantities}
        row["keeps all limits"] = "yes" if design.feasible else "; ".join(design.broken_limits)
        rows.append(row)
    return pd.DataFrame(rows)


def front_section(result: SearchResult, front: Front) -> Section:
    """One `front` of a `result`: each combination's own, the designs no other beats, baseline and chosen design."""
    key = f"trade-front-{'robust' if front.objective == ROBUST else 'nominal'}"
    x_quantity, y_quantity = find_quantity(front.second), find_quantity(front.objective)
    made = figure(_axis(x_quantity), _axis(y_quantity), height=520)
    profiles = list(dict.fromkeys(d.profile for designs in front.by_combination.values() for d in designs))
    for designs in _nearest(front):
        first = designs[0]
        colour = PALETTE[profiles.index(first.profile)]
        made.add_scatter(
            x=[d.quantities[front.second] for d in designs],
            y=[d.quantities[front.objective] for d in designs],
            mode="lines",
            name=name_of(first),
            line={"color": colour, "width": 1.5, "dash": DASHES[first.structure]},
            text=[hover(d) for d in designs],
            hovertemplate="%{text}<extra></extra>",
        )
    made.add_scatter(
        x=[d.quantities[front.second] for d in front.designs],
        y=[d.quantities[front.objective] for d in front.designs],
        mode="markers",
        name="No design beats these",
        marker={"size": 11, "color": "rgba(0,0,0,0)", "line": {"color": INK, "width": 1.5}},
        text=[hover(d) for d in front.designs],
        hovertemplate="%{text}<extra></extra>",
    )
    for name, design, symbol in (("Baseline", result.baseline, "x"), ("Chosen", result.best, "star")):
        made.add_scatter(
            x=[design.quantities[front.second]],
            y=[design.quantities[front.objective]],
            mode="markers",
            name=name,
            marker={"size": 15, "symbol": symbol, "color": VERMILLION, "line": {"color": PAPER, "width": 1.5}},
            text=[hover(design)],
            hovertemplate=f"{name}<br>%{{text}}<extra></extra>",
        )
    bounds = _shade_limits(made, result, front)
    how = "under the tolerances" if front.objective == ROBUST else "for the errors of the study"
    return Section(
        key,
        f"Front {how}",
        (
            Figure(
                f"{key}-figure",
                f"{y_quantity.title} against {in_sentence(x_quantity.title)}",
                made,
                "Down and to the left is better. Ringed designs are beaten by no other; hover for the whole design. "
                f"{_left_out(front)}The limit on {in_sentence(x_quantity.title)} is left out here, all others hold."
                f"{bounds}",
            ),
        ),
        f"{counted(len(front.designs), 'design')} that no other beats; hypervolume {front.hypervolume:.4g} "
        f"(arcmin {x_quantity.unit}) below ({front.reference[0]:.3g}, {front.reference[1]:.3g}).",
    )


def _nearest(front: Front) -> list[list[DesignRecord]]:
    """The combinations of a `front` that come nearest to it, at most `CURVES` of them: more curves cannot be told
    apart. Ranked by the least objective that each reaches."""
    curves = [list(designs) for designs in front.by_combination.values() if designs]
    return sorted(curves, key=lambda designs: min(d.quantities[front.objective] for d in designs))[:CURVES]


def _left_out(front: Front) -> str:
    curves = sum(1 for designs in front.by_combination.values() if designs)
    if curves <= CURVES:
        return ""
    drawn = f"Of {curves} combinations the {CURVES} with the least error have a curve"
    return f"{drawn}; all are in [[trade-chosen-combinations]]. "


def _shade_limits(made: go.Figure, result: SearchResult, front: Front) -> str:
    """Draw the limits on both axes of a `front` and shade where they are broken; the sentence that says so."""
    limits = {limit.quantity: limit for limit in result.setup.limits()}
    found = False
    for quantity, axis in ((front.second, "x"), (front.objective, "y")):
        limit = limits.get(quantity)
        if limit is None:
            continue
        found = True
        shown = [d.quantities[quantity] for designs in _nearest(front) for d in designs]
        shown += [d.quantities[quantity] for d in (*front.designs, result.baseline, result.best)]
        room = 0.06 * (max(shown) - min(shown) or 1.0)
        low, high = min(shown) - room, max(shown) + room
        ends = (low, limit.bound) if limit.at_least else (limit.bound, high)
        if ends[0] >= ends[1]:
            continue
        shade: dict[str, Any] = {"fillcolor": faded(VERMILLION, 0.1), "line_width": 0, "layer": "below"}
        line: dict[str, Any] = {"line": {"color": VERMILLION, "width": 1.5, "dash": "dash"}}
        if axis == "x":
            made.add_vrect(*ends, **shade)
            made.add_vline(limit.bound, **line)
        else:
            made.add_hrect(*ends, **shade)
            made.add_hline(limit.bound, **line)
        made.update_layout({f"{axis}axis": {"range": [low, high]}})
    return " Shaded is where it is broken." if found else ""


def _axis(quantity: Quantity) -> str:
    return f"{quantity.title} [{quantity.unit}]"


def designs_section(result: SearchResult, key: str = "trade-designs") -> Section:
    """Parallel coordinates of all designs of the fronts of a `result`, the baseline and the chosen one among them;
    `key` names the section."""
    found = [d for front in result.fronts for designs in front.by_combination.values() for d in designs]
    shown = list({(d.name, tuple(d.variables.items())): d for d in found}.values())
    every = [*shown, result.baseline, result.best]
    axes = [(k, VARIABLES[k][0], VARIABLES[k][1], lambda d, k=k: d.variables.get(k)) for k in AXES]
    axes += [
        (k, QUANTITIES[k].title, QUANTITIES[k].unit, lambda d, k=k: d.quantities.get(k))
        for k in PARALLEL
        if all(k in d.quantities for d in every)
    ]
    axes = [axis for axis in axes if _varies([axis[-1](design) for design in every])]
    drawn = _thinned(shown, result.objective)
    made = _parallel(axes, drawn, result)
    fewer = (
        f"Drawn are {len(drawn)} of {len(shown)}, evenly from the least error to the largest. "
        if len(drawn) < len(shown)
        else ""
    )
    return Section(
        key,
        "All designs",
        (
            Figure(
                f"{key}-parallel",
                "Every design of the fronts over its variables and what comes of them",
                made,
                f"{fewer}Each line is a design, each axis runs from its least to its largest value; what never "
                "varies has none. A line without a "
                "wrap angle passes below that axis. Hover for the whole design.",
            ),
        ),
        f"{counted(len(shown), 'design')}, the baseline and the chosen one.",
    )


def _varies(values: Sequence[float | None]) -> bool:
    """Whether `values` differ by more than their four digits show."""
    known = [value for value in values if value is not None]
    return bool(known) and max(known) - min(known) > CHANGED * max(map(abs, known))


def _thinned(designs: list[DesignRecord], objective: str) -> list[DesignRecord]:
    """At most `LINES` of the `designs`, evenly over their rank by the `objective`, both ends among them."""
    ranked = sorted(designs, key=lambda design: design.quantities.get(objective, design.quantities[NOMINAL]))
    if len(ranked) <= LINES:
        return ranked
    return [ranked[round(i * (len(ranked) - 1) / (LINES - 1))] for i in range(LINES)]


def _parallel(axes: Sequence[Axis], shown: list[DesignRecord], result: SearchResult) -> go.Figure:
    every = [*shown, result.baseline, result.best]
    ranges = []
    for _, _, _, read in axes:
        values = [v for d in every if (v := read(d)) is not None]
        ranges.append((min(values), max(values)) if values else (0.0, 1.0))

    def places(design: DesignRecord) -> list[float]:
        found = []
        for (_, _, _, read), (low, high) in zip(axes, ranges, strict=True):
            value = read(design)
            found.append(-0.08 if value is None else (value - low) / (high - low) if high > low else 0.5)
        return found

    made = figure("", "", height=460, hovermode="closest", meta={"narrow_height": 620})
    positions = list(range(len(axes)))
    profiles = list(dict.fromkeys(d.profile for d in shown))
    named: set[str] = set()
    for design in shown:
        colour = PALETTE[profiles.index(design.profile)]
        made.add_scatter(
            x=positions,
            y=places(design),
            mode="lines",
            name=label(design.profile),
            legendgroup=design.profile,
            showlegend=design.profile not in named,
            line={"color": faded(colour, 0.4), "width": 1.2},
            text=[hover(design)] * len(axes),
            hovertemplate="%{text}<extra></extra>",
        )
        named.add(design.profile)
    for name, design, colour, dash in (
        ("Baseline", result.baseline, GREY, "dash"),
        ("Chosen", result.best, INK, "solid"),
    ):
        made.add_scatter(
            x=positions,
            y=places(design),
            mode="lines+markers",
            name=name,
            line={"color": colour, "width": 3, "dash": dash},
            text=[hover(design)] * len(axes),
            hovertemplate=f"{name}<br>%{{text}}<extra></extra>",
        )
    made.update_xaxes(
        tickvals=positions,
        ticktext=[
            f"{title}<br>{significant(low)}–{significant(high)} {UNITS.get(unit, unit)}".rstrip()
            for (_, title, unit, _), (low, high) in zip(axes, ranges, strict=True)
        ],
        tickangle=-35,
        showgrid=True,
    )
    made.update_yaxes(visible=False, range=[-0.12, 1.06])
    return made


def map_section(result: SearchResult, seen: DesignMap, key: str = "trade-map") -> Section:
    """Peak-to-peak over pressure angle and width about the chosen design of a `result`, as `seen` on a grid, with the
    lines of its limits; `key` names the section."""
    limits = [MapLimit(str(limit), grid, limit.bound, limit.at_least) for limit, grid in seen.limits]
    chosen, baseline = result.best.variables, result.baseline.variables
    made = design_map(
        seen.width_mm,
        seen.pressure_angle_deg,
        seen.peak_to_peak_arcmin,
        ("WG width [mm]", "Pressure angle [deg]", "arcmin"),
        [
            Design("chosen", chosen["width_mm"], chosen["pressure_angle_deg"]),
            Design("baseline's place", baseline["width_mm"], baseline["pressure_angle_deg"]),
        ],
        limits,
    )
    return Section(
        key,
        "Pressure angle and width, with what limits them",
        (
            Figure(
                f"{key}-figure",
                f"{seen.title} over pressure angle and width, all else as chosen",
                made,
                "The error falls toward the lower left; the lines are where a limit is just kept. The baseline stands "
                "at its own pressure angle and width, but the map is of the chosen design. "
                f"{words_on_limits(limits)}{_off_the_map(result, seen)}",
            ),
        ),
        "Fewer degrees and less width always lower the error; the lines show what stops them.",
    )


def _off_the_map(result: SearchResult, seen: DesignMap) -> str:
    """Which limits that hold the design of a `result` have no line on the map as `seen`: they do not depend on it."""
    drawn = {limit.quantity for limit, _ in seen.limits}
    held = {price["title"] for price in result.active if "bound" not in price["kind"]}
    titles = [find_quantity(limit.quantity).title for limit in result.setup.limits() if limit.quantity not in drawn]
    names = [in_sentence(title) for title in titles if title in held]
    if not names:
        return ""
    said = listed(names)
    return f" {said[:1].upper()}{said[1:]} hold{'s' if len(names) == 1 else ''} the design too, everywhere here alike."


def rings_section(result: SearchResult, rings: Rings) -> Section:
    """Curvature change along the ring for each profile's own best design in a `result`; `rings` holds their curves."""
    best: dict[str, tuple[tuple[bool, float], DesignRecord]] = {}
    for design in result.combinations:
        rank = (not design.feasible, design.quantities[result.objective])
        if design.profile not in best or rank < best[design.profile][0]:
            best[design.profile] = (rank, design)
    keys = ("bending_stress_mpa", "bending_safety", "contact_angle_deg", "carrying_angle_deg", "flank_pressure_mpa")
    rows = []
    for profile, (_, design) in best.items():
        row: dict[str, object] = {"profile": profile}
        row |= {k: design.variables.get(k) for k in ("deflection_ratio", "wrap_angle_deg")}
        row |= {k: design.quantities[k] for k in keys if k in design.quantities}
        rows.append(row)
    return profiles_section(
        rings.phi,
        rings.deflection_mm,
        rings.curvature_change_per_mm,
        rings.radius_mm,
        pd.DataFrame(rows),
        key="trade-profiles",
    )


NOT_FOLLOWED = (
    "Where the choice holds was not asked for: regions = true in [search] of the study, or --set search.regions=true, "
    "follows each constant of the trade to where another choice is the better, in a few times a search's time."
)


FRESH_DRIVES = (
    "The search judges every design by the same drives, so that designs compare; fresh drives, which it never saw, say "
    "how large the quantile is. The interval is that of the fresh ones: the search's own, of fewer drives, may lie "
    "outside it."
)


def confidence_section(result: SearchResult, checked: Verification, key: str = "trade-confidence") -> Section:
    """The choice of a `result` as `checked` by other means, and the regions of the trade's constants in which it holds,
    or how to ask for them; `key` names the section."""
    regions = result.regions
    said = nearest_boundary(regions) if regions else "the choice, checked by other means"
    return Section(
        key,
        "How sure the choice is",
        (
            KeyFigures(_checked_figures(checked)),
            *([Text(FRESH_DRIVES)] if checked.fresh is not None else []),
            *(region_items(result.best, regions, key) if regions else (Text(NOT_FOLLOWED),)),
            Text(
                f"First-order optimality holds to {result.optimality_residual:.1e} of the objective's slope. "
                f"Algorithms: {result.algorithm}; {counted(result.evaluations, 'design')} evaluated, "
                f"{result.impossible} of them impossible; stopped because: {result.stopped_because}."
            ),
        ),
        f"{said[:1].upper()}{said[1:]}.",
    )


def _checked_figures(checked: Verification) -> dict[str, str]:
    values = {
        "Exact geometry": f"{checked.exact_arcmin:.4f} arcmin",
        "Compiled kernel": f"{checked.kernel_arcmin:.4f} arcmin",
    }
    fresh = checked.fresh
    if fresh is None:
        return values
    values |= {
        f"{100 * fresh.quantile:g} % quantile, fresh drives": f"{fresh.quantile_arcmin:.4f} arcmin",
        "Its 95 % interval": f"{fresh.low:.4f} to {fresh.high:.4f} arcmin",
    }
    if fresh.searched_arcmin is not None:
        values["The same, drives of the search"] = f"{fresh.searched_arcmin:.4f} arcmin"
    return values
