"""The diagnosis on a page: the verdict, what held-out data say of it, where the mismatch lives, what cannot be told."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from hdopt.report import Figure, Item, KeyFigures, Report, Section, Table, Text
from hdopt.report.cells import NAMES, UNITS
from hdopt.report.sections.diagnosis_residual import extended_name, plain_numbers, residual_section
from hdopt.report.sections.words import in_sentence, label, short
from hdopt.report.theme import BLUE, GREEN, GREY, figure
from hdopt.words import listed

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis
    from hdopt.effects.estimate import Parameter

WAVE = re.compile(r"(amplitude|phase)_(\d+)_(?:um|deg|arcmin)$")
LISTED_WAVES = 6
"""Waves up to which an effect's amplitudes and phases stand in the table; more are drawn."""

NUMBERS = {"value": ".4g", "low": ".4g", "high": ".4g", "error": NAMES, "parameter": NAMES, "nuisance": NAMES}


def diagnosis_report(diagnosis: Diagnosis, names: Sequence[str]) -> Report:
    """One page on a `diagnosis`; `names` are those of the recordings, for its heading."""
    sections = [
        verdict_section(diagnosis),
        proof_section(diagnosis),
        residual_section(diagnosis),
        limits_section(diagnosis),
    ]
    return Report("Diagnosis", f"Recordings: {', '.join(names)}", tuple(sections), diagnosis.to_dict())


def verdict_section(diagnosis: Diagnosis) -> Section:
    """The verdict of a `diagnosis`: each effect with its size and parameters, what else it could be, what to measure
    next."""
    import pandas as pd

    key_figures = {"Verdict": diagnosis.verdict}
    for found in diagnosis.effects:
        name = f"{label(found.id)}, confidence {100 * found.confidence:.0f} %"
        key_figures[name] = f"{short(found.where['rms_arcmin'])} arcmin rms"
    if diagnosis.where is not None:
        key_figures["Size"] = f"{short(diagnosis.where['rms_arcmin'])} arcmin rms"
        key_figures["Lives mostly in"] = str(diagnosis.where["domain"])
    items: list[Item] = [KeyFigures(key_figures)]
    for ids in diagnosis.ambiguous_with:
        alone = " alone" if set(ids) < {found.id for found in diagnosis.effects} else ""
        items.append(Text(f"As good an explanation: {listed([in_sentence(label(name)) for name in ids])}{alone}."))
    if diagnosis.where is not None and diagnosis.where["orders_per_input_turn"]:
        orders = listed([f"{order:g}" for order in diagnosis.where["orders_per_input_turn"]])
        items.append(Text(f"Its strongest orders are {orders} cycles per input turn."))
    if diagnosis.separating_test:
        items.append(Text(f"What to measure next: {diagnosis.separating_test}."))
    drawn = {found.id: waves_of(found.parameters) for found in diagnosis.effects}
    rows = [
        {"effect": label(found.id)} | parameter_row("parameter", name, parameter)
        for found in diagnosis.effects
        for name, parameter in found.parameters.items()
        if len(drawn[found.id]) <= LISTED_WAVES or not WAVE.match(name)
    ]
    if rows:
        items.append(Table("diagnosis-parameters", "Parameters, with 95 % intervals", pd.DataFrame(rows), "", NUMBERS))
    items += [
        waves_figure(found.id, waves) for found in diagnosis.effects if len(waves := drawn[found.id]) > LISTED_WAVES
    ]
    if diagnosis.confounded:
        items += confounded_items(diagnosis)
    return Section("diagnosis", "Verdict", tuple(items), diagnosis.says)


def waves_of(parameters: Mapping[str, Parameter]) -> dict[int, Parameter]:
    """The amplitudes among an effect's parameters that are numbered by waves a turn."""
    found = {name: WAVE.match(name) for name in parameters}
    return {int(match[2]): parameters[name] for name, match in found.items() if match and match[1] != "phase"}


def waves_figure(effect: str, waves: Mapping[int, Parameter]) -> Figure:
    """The amplitudes of an effect's waves with their intervals: as a table they would fill a page."""
    import plotly.graph_objects as go

    unit = next(iter(waves.values())).unit
    chart = figure("waves a turn", f"amplitude [{unit}]", height=280)
    sizes = list(waves.values())
    chart.add_trace(
        go.Bar(
            x=list(waves),
            y=[p.value for p in sizes],
            error_y={
                "type": "data",
                "array": [p.high - p.value for p in sizes],
                "arrayminus": [min(p.value - p.low, p.value) for p in sizes],
                "color": GREY,
            },
            marker_color=BLUE,
        )
    )
    chart.update_yaxes(range=[0, 1.5 * max(p.value for p in sizes)])
    note = (
        "Bars end at the fitted value, lines at its 95 % interval: where that reaches zero, this recording cannot tell "
        "the wave from others. Phases are among the numbers of this report."
    )
    return Figure(f"diagnosis-waves-{effect}", f"{label(effect)}: its waves", chart, note)


def parameter_row(heading: str, name: str, parameter: Parameter) -> dict[str, object]:
    """One row of a table of parameters: `name` in the column `heading`, then value, interval and unit of the
    `parameter`; a pure number has no unit to show, an angle of which nothing is known no numbers."""
    unit = "" if parameter.unit == "1" else UNITS.get(parameter.unit, parameter.unit)
    p = parameter
    value, low, high = (None, None, None) if p.undefined else (p.value, p.low, p.high)
    return {heading: name, "value": value, "low": low, "high": high, "unit": unit}


def confounded_items(diagnosis: Diagnosis) -> list[Table | Text]:
    """What could be mistaken for the effects that a `diagnosis` found, and what would part them."""
    import pandas as pd

    tie = diagnosis.evidence.settings.verdict.tie
    table = Table(
        "diagnosis-confounded",
        "What could be mistaken for it",
        pd.DataFrame(
            {
                "found": [label(pair.effect) for pair in diagnosis.confounded],
                "could be": [label(pair.other) for pair in diagnosis.confounded],
                "imitates": [pair.imitates for pair in diagnosis.confounded],
                "angle [deg]": [pair.angle_deg for pair in diagnosis.confounded],
                "log evidence apart": [pair.evidence_apart for pair in diagnosis.confounded],
            }
        ),
        "Imitates: share of the found effect's power that the other could take over. Angle: the smallest between their "
        f"columns. Where the log evidence apart is below {tie:g}, this recording does not tell them apart by their "
        "shape: only how likely each is beforehand speaks for the one found.",
        {"imitates": ".1%", "angle [deg]": ".1f", "log evidence apart": ".0f"},
    )
    separating = {label(pair.effect): pair.separating for pair in diagnosis.confounded}
    return [table, *(Text(f"To tell {in_sentence(name)} apart: {test}.") for name, test in separating.items())]


HELD_OUT_BARS = {
    "chosen without these turns": "Chosen without these turns: a fifth of all or more, hidden from every stage, "
    "predicted by what the others alone led to.",
    "fitted without these turns": "Fitted without these turns: what the search on all turns found, where the others "
    "alone prefer it to that.",
    "placebo": "Placebo: the best other effect of the catalogue.",
    "generic basis": "Generic basis: smooth curves and sines without physics.",
    "noise floor": "Noise floor: what is left with a generic basis beside the best explanation.",
}
"""What a bar of the held-out errors means, by its name; the others say it themselves."""


def proof_section(diagnosis: Diagnosis) -> Section:
    """Held-out error (arcmin rms) of base, placebo, generic basis and explanation in a `diagnosis`, over turns and over
    whole conditions."""
    import plotly.graph_objects as go

    fit = diagnosis.fit
    bars = {
        "drive alone": (fit["heldout_rms_base_arcmin"], GREY),
        "placebo": (fit["heldout_rms_placebo_arcmin"], GREY),
        "generic basis": (fit["heldout_rms_generic_arcmin"], GREY),
        "noise floor": (fit["noise_floor_arcmin"], GREEN),
    }
    extended = extended_name(diagnosis)
    if extended:
        bars[extended] = (fit["heldout_rms_extended_arcmin"], BLUE)
    nested = fit["heldout_nested_rms_arcmin"]
    if nested is not None:
        bars["chosen without these turns"] = (nested, BLUE)
    proposed = fit["heldout_proposed_rms_arcmin"]
    if proposed is not None:
        bars["fitted without these turns"] = (proposed, BLUE)
    names = sorted(bars, key=lambda name: bars[name][0])
    lengths = [bars[name][0] for name in names]
    chart = figure("rms error on held-out turns [arcmin]", height=280)
    chart.add_trace(
        go.Bar(
            x=lengths,
            y=names,
            orientation="h",
            marker_color=[bars[name][1] for name in names],
            text=[short(length) for length in lengths],
            textposition="outside",
            cliponaxis=False,
        )
    )
    chart.update_xaxes(range=[0, 1.15 * max(lengths)], exponentformat="none")
    meanings = [meaning for name, meaning in HELD_OUT_BARS.items() if name in bars]
    note = " ".join(["Every bar is the error on whole input turns that the last fit did not see.", *meanings])
    items: list[Item] = [Figure("diagnosis-heldout", "Held-out error", chart, note)]
    if diagnosis.each_condition:
        items.append(conditions_figure(diagnosis))
    before, after = fit["heldout_rms_base_arcmin"], fit["heldout_rms_extended_arcmin"]
    alone = fit["heldout_nested_rms_base_arcmin"]
    if nested is not None and alone is not None:
        before, after = alone, nested
    change = (
        f"What was found takes the held-out error from {short(before)} to {short(after)} arcmin rms. "
        if diagnosis.effects and extended
        else ""
    )
    intro = f"{change}Chance of a false alarm over the whole catalogue: {fit['false_alarm_p']:.3g}."
    return Section("diagnosis-proof", "Does it hold on data the fit never saw?", tuple(items), intro)


def conditions_figure(diagnosis: Diagnosis) -> Figure:
    """Error (arcmin rms) on each operating condition of a `diagnosis`, predicted from the others."""
    import plotly.graph_objects as go

    names = list(diagnosis.each_condition)
    chart = figure("condition left out", "rms error on it [arcmin]")
    extended = extended_name(diagnosis)
    for index, (name, colour) in enumerate([("drive alone", GREY)] + ([(extended, BLUE)] if extended else [])):
        values = [errors[index] for errors in diagnosis.each_condition.values()]
        chart.add_trace(go.Bar(x=names, y=values, name=name, marker_color=colour))
    chart.update_layout(barmode="group")
    note = (
        "Each condition is predicted by the model refitted to the others, which is harder than a turn among its like: "
        "a wrong explanation may fit turns and fail here. A recording that was zeroed anew keeps its own zero."
    )
    return Figure("diagnosis-conditions", "Conditions left out", plain_numbers(chart), note)


def limits_section(diagnosis: Diagnosis) -> Section:
    """The drive's errors as a `diagnosis` fitted them, what the recording leaves open, and what it would not have
    shown."""
    import pandas as pd

    items: list[Item] = []
    base = [parameter_row("error", name, parameter) for name, parameter in diagnosis.base.parameters.items()]
    if base:
        caption = "With 95 % intervals."
        if any(parameter.undefined for parameter in diagnosis.base.parameters.values()):
            caption += " A direction without a number is open: its error may be nil."
        if diagnosis.base.open_combinations:
            caption += f" The recording leaves open: {'; '.join(diagnosis.base.open_combinations)}."
        items.append(Table("diagnosis-base", "The drive's errors as fitted", pd.DataFrame(base), caption, NUMBERS))
    beside = [parameter_row("nuisance", name, parameter) for name, parameter in diagnosis.nuisances.items()]
    if beside:
        caption = "Fitted beside every model and never named, with 95 % intervals; drift and warp from end to end."
        items.append(Table("diagnosis-nuisances", "Nuisances", pd.DataFrame(beside), caption, NUMBERS))
    if diagnosis.below_detection:
        limits = sorted(diagnosis.below_detection.items(), key=lambda item: item[1])
        items.append(
            Table(
                "diagnosis-detection",
                "What would have been seen",
                pd.DataFrame(
                    {
                        "effect": [label(name) for name, _ in limits],
                        "from [arcmin rms]": [short(limit) for _, limit in limits],
                    }
                ),
                "The smallest size of each other effect that this recording would have shown.",
            )
        )
    lacking = diagnosis.evidence.lacking
    if lacking:
        frame = pd.DataFrame({"effect": [label(name) for name in lacking], "needs": list(lacking.values())})
        items.append(Table("diagnosis-lacking", "What could not be seen at all", frame))
    told = tuple(f"{name} cannot" for name in lacking)
    items += [Text(f"Note: {warning}.") for warning in diagnosis.warnings if not warning.startswith(told)]
    return Section("diagnosis-limits", "What the recording cannot tell", tuple(items))
