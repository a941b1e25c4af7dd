"""The diagnosis on a page: verdict, before and after, where the residual lives, what held-out turns say."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdopt.diagnosis.verdict import TIE
from hdopt.recording import TURN
from hdopt.recording_sync import synchronous_average
from hdopt.report import Figure, KeyFigures, Report, Section, Table, Text
from hdopt.report.theme import BLUE, GREY, VERMILLION, figure

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict import Diagnosis


def diagnosis_report(diagnosis: Diagnosis, names: Sequence[str]) -> Report:
    """One page on a diagnosis."""
    sections = [verdict_section(diagnosis), proof_section(diagnosis), residual_section(diagnosis)]
    return Report("Diagnosis", f"Recordings: {', '.join(names)}", tuple(sections), diagnosis.to_dict())


def verdict_section(diagnosis: Diagnosis) -> Section:
    """The verdict, each effect with its parameters, what to measure next, the base's errors."""
    import pandas as pd

    items = [KeyFigures({"Verdict": diagnosis.verdict} | {f.id: f"{f.confidence:.2f}" for f in diagnosis.effects})]
    for found in diagnosis.effects:
        items.append(Text(found.says))
    if diagnosis.separating_test:
        items.append(Text(f"What to measure next: {diagnosis.separating_test}."))
    rows = [
        {"effect": found.id, "parameter": name, "value": p.value, "low": p.low, "high": p.high, "unit": p.unit}
        for found in diagnosis.effects
        for name, p in found.parameters.items()
    ]
    formats = {"value": ".4g", "low": ".4g", "high": ".4g"}
    if rows:
        items.append(Table("diagnosis-parameters", "Parameters, with 95 % intervals", pd.DataFrame(rows), "", formats))
    confounded = [
        {
            "found": pair.effect,
            "could be": pair.other,
            "imitates": pair.imitates,
            "angle": pair.angle_deg,
            "log evidence apart": pair.evidence_apart,
            "what would separate them": pair.separating,
        }
        for pair in diagnosis.confounded
    ]
    if confounded:
        caption = (
            "Imitates: share of the found effect's power that the other could take over. "
            f"Angle: smallest one between the two. Below a log evidence of {TIE:g} this recording does not tell them "
            "apart by their shape."
        )
        items.append(
            Table(
                "diagnosis-confounded",
                "What could be mistaken for it",
                pd.DataFrame(confounded),
                caption,
                {"imitates": ".1%", "angle": ".1f", "log evidence apart": ".1f"},
            )
        )
    base = [
        {"error": name, "value": p.value, "low": p.low, "high": p.high, "unit": p.unit}
        for name, p in diagnosis.base.parameters.items()
    ]
    if base:
        open_ones = "; ".join(diagnosis.base.open_combinations)
        caption = f"The recording leaves open: {open_ones}." if open_ones else ""
        items.append(Table("diagnosis-base", "The drive's errors as fitted", pd.DataFrame(base), caption, formats))
    if diagnosis.warnings:
        items.append(Text("Notes: " + "; ".join(diagnosis.warnings) + "."))
    return Section("diagnosis", "What was left out", tuple(items), diagnosis.says)


def proof_section(diagnosis: Diagnosis) -> Section:
    """Held-out error of base, explanation, placebo and generic basis."""
    import plotly.graph_objects as go

    fit = diagnosis.fit
    bars = {
        "base": fit["heldout_rms_base_arcmin"],
        "placebo": fit["heldout_rms_placebo_arcmin"],
        "extended": fit["heldout_rms_extended_arcmin"],
        "generic basis": fit["heldout_rms_generic_arcmin"],
        "noise floor": fit["noise_floor_arcmin"],
    }
    chart = figure("", "rms error on held-out turns [arcmin]")
    chart.add_trace(go.Bar(x=list(bars), y=list(bars.values()), marker_color=[GREY, GREY, BLUE, GREY, GREY]))
    note = (
        "Every bar is the error on whole input turns that the fit did not see. The placebo is the best other effect "
        "of the catalogue; the generic basis is free of physics."
    )
    items = [Figure("diagnosis-heldout", "Held-out error", chart, note)]
    if diagnosis.each_condition:
        items.append(conditions_figure(diagnosis))
    return Section(
        "diagnosis-proof",
        "Does it hold on turns the fit never saw?",
        tuple(items),
        f"Chance of a false alarm over the whole catalogue: {fit['false_alarm_p']:.3g}.",
    )


def conditions_figure(diagnosis: Diagnosis) -> Figure:
    """Error on each operating condition, predicted from the others."""
    import plotly.graph_objects as go

    names = list(diagnosis.each_condition)
    chart = figure("condition left out", "rms error on it [arcmin]")
    for index, (label, colour) in enumerate((("base", GREY), ("extended", BLUE))):
        values = [errors[index] for errors in diagnosis.each_condition.values()]
        chart.add_trace(go.Bar(x=names, y=values, name=label, marker_color=colour))
    chart.update_layout(barmode="group")
    note = (
        "Each condition is predicted by the model refitted to the others, which is harder than a turn among its like: "
        "a wrong explanation may fit turns and fail here. A recording that was zeroed anew keeps its own zero."
    )
    return Figure("diagnosis-conditions", "Conditions left out", chart, note)


def residual_section(diagnosis: Diagnosis) -> Section:
    """Residual before and after, over one input turn and by order, and its size by domain."""
    import pandas as pd
    import plotly.graph_objects as go

    selection = diagnosis.evidence.selection
    base, best = selection.base, selection.best.fit
    samples = base.problem.samples
    items = []
    if not samples.locked:
        turn = figure("input angle [deg]", "mean over turns [arcmin]")
        for name, fit, colour in (("before", base, VERMILLION), ("after", best, BLUE)):
            angle, mean, _ = synchronous_average(samples.theta, fit.residual, TURN)
            turn.add_trace(go.Scatter(x=np.degrees(angle), y=mean, name=name, line={"color": colour}))
        items.append(Figure("diagnosis-turn", "Residual over one input turn", turn, "Averaged over all turns."))
        from hdopt.diagnosis.probe import FitProbe

        orders = np.arange(0, min(20.0, 0.4 * samples.rows_per_turn), 0.25 / max(samples.span_turns, 1.0))
        spectrum = figure("cycles per input turn", "amplitude [arcmin]")
        for name, fit, colour in (("before", base, VERMILLION), ("after", best, BLUE)):
            amplitude = FitProbe(fit).spectrum(orders)
            spectrum.add_trace(go.Scatter(x=orders, y=amplitude, name=name, line={"color": colour}))
        items.append(Figure("diagnosis-spectrum", "Residual by order", spectrum, "Before and after the explanation."))
        path = figure("output angle since the last reversal [deg]", "residual [arcmin]")
        if samples.reverses:
            for direction, colour in ((1, VERMILLION), (-1, BLUE)):
                rows = (samples.direction == direction) & ~samples.first
                if rows.sum() > 20:
                    order = np.argsort(samples.travel[rows])
                    parts = np.array_split(order, min(80, len(order)))
                    x = [samples.travel[rows][p].mean() for p in parts]
                    y = [base.residual[rows][p].mean() for p in parts]
                    name = "forward" if direction > 0 else "backward"
                    path.add_trace(go.Scatter(x=x, y=y, name=name, line={"color": colour}))
            items.append(Figure("diagnosis-reversal", "Residual after reversals", path, "Before the explanation."))
    for name, title, values in (
        ("torque", "torque [Nm]", samples.torque),
        ("speed", "input speed [rad/s]", samples.speed),
        ("temperature", "temperature [deg C]", samples.temperature),
        ("time", "time [s]", samples.time),
    ):
        if values is None or np.std(values) == 0:
            continue
        chart = figure(title, "residual [arcmin]")
        order = np.argsort(values)
        parts = np.array_split(order, min(100, len(order)))
        for label, fit, colour in (("before", base, VERMILLION), ("after", best, BLUE)):
            chart.add_trace(
                go.Scatter(
                    x=[values[p].mean() for p in parts],
                    y=[fit.residual[p].mean() for p in parts],
                    name=label,
                    line={"color": colour},
                )
            )
        items.append(
            Figure(f"diagnosis-{name}", f"Residual over {name}", chart, "Means of a hundredth of the rows each.")
        )
    located = pd.DataFrame([location.to_dict() for location in diagnosis.located])
    if len(located):
        items.append(
            Table(
                "diagnosis-located",
                "Where the residual of the base lives",
                located,
                "p: chance that noise alone looks like this, by sign flips of whole turns.",
                {"rms_arcmin": ".4f", "p": ".3f"},
            )
        )
    return Section("diagnosis-residual", "Where the mismatch lives", tuple(items))
