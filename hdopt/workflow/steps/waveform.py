"""Steps about the one drive in [errors]: its kinematic error over a relative turn, its orders, its lag, its effects."""

from __future__ import annotations

from dataclasses import replace

from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.kinematics.waveform import relative_turn
from hdopt.mechanics.lag import lag as lag_of
from hdopt.recordings.orders import ModelOrder, model_orders, order_spectrum
from hdopt.report import Section, Text
from hdopt.report.sections.effects import WAYS, effects_section
from hdopt.report.sections.lag import lag_section
from hdopt.report.sections.orders import spectrum_section
from hdopt.report.sections.waveform import waveform_section
from hdopt.simulation.extremes import peak_to_peak_arcmin as extended_peak_to_peak_arcmin
from hdopt.study import Study
from hdopt.workflow.effect_selection import extended_model, inclusion
from hdopt.workflow.effect_table import effect_table, remarks
from hdopt.workflow.steps import Context, StepResult, requirement_arcmin
from hdopt.workflow.waveform import WaveformResult, converged_extremes_arcmin, extremes_of, resolved, waveform_of

PAPER_ORDERS = ("1/N", "1", "2", "2(1+1/2N)", "2(1+1/N)")
"""The orders that Jia 2021, Table 6 names."""


def words_of(shown: WaveformResult, study: Study) -> str:
    """What a section says above the waveform `shown` of a `study`: which direction it is of, where both count; "" for
    a study without effects."""
    if not study.effects:
        return ""
    says = f"With the effects that the base model leaves out; {WAYS[shown.direction]} motion is shown"
    return f"{says}." if shown.directions == 1 else f"{says}, the peak-to-peak is that of both directions together."


def _with_words(section: Section, words: str) -> Section:
    return replace(section, items=(Text(words), *section.items)) if words else section


def effects(study: Study, context: Context) -> StepResult:
    """What each effect of the `study` adds, and the waveform with and without them; needs nothing of the `context`."""
    model, chosen = extended_model(study), inclusion(study, "all")
    base = converged_peak_to_peak_arcmin(study.drive, study.errors)
    whole = extended_peak_to_peak_arcmin(model)
    rows = effect_table(study, model, chosen, whole, base)
    shown = resolved(model)
    passes = {direction: shown.relative_turn(direction) for direction in model.operation.directions}
    theta = next(iter(passes.values()))[0]
    _, bare = relative_turn(study.drive, study.errors, shown.samples_per_turn)
    others = "structures, profiles, sensitivities and the design map are those of the base model, without effects"
    section = effects_section(
        rows,
        theta,
        bare,
        {direction: values for direction, (_, values) in passes.items()},
        base_peak_to_peak_arcmin=base,
        peak_to_peak_arcmin=whole,
        notes=(*chosen.says, *remarks(model), others),
    )
    results = {
        "method": model.geometry,
        "base_peak_to_peak_arcmin": base,
        "peak_to_peak_arcmin": whole,
        "effects": [dict(row) for row in rows],
    }
    return StepResult((section,), results)


def waveform(study: Study, context: Context) -> StepResult:
    """Kinematic error of the `study` over one full relative turn; needs nothing of the `context`."""
    shown = waveform_of(study)
    low, high = converged_extremes_arcmin(study)
    converged = high - low
    required = requirement_arcmin(study)
    section = waveform_section(
        shown.theta,
        shown.waveform,
        peak_to_peak_arcmin=converged,
        extremes=extremes_of(shown, study),
        requirement_arcmin=required,
    )
    results = {"method": shown.method, "peak_to_peak_arcmin": converged, "required_arcmin": required}
    return StepResult((_with_words(section, words_of(shown, study)),), results)


def orders(study: Study, context: Context) -> StepResult:
    """Amplitudes of the `study` at the model's orders, and at those of the effects; needs nothing of the `context`."""
    shown = waveform_of(study)
    spectrum = order_spectrum(shown.theta, shown.waveform, [order.order for order in shown.orders])
    of_base = {order.symbol for order in model_orders(study.drive.geometry.ratio)}

    def kind(order: ModelOrder) -> str:
        if order.symbol in PAPER_ORDERS:
            return "Named in Jia 2021, Table 6"
        return "Beyond Table 6: the driving zone changes" if order.symbol in of_base else "Left out of the base model"

    section = spectrum_section(
        spectrum.orders,
        spectrum.amplitudes,
        [order.symbol for order in shown.orders],
        [order.origin.replace("_", " ") for order in shown.orders],
        study.drive.geometry.ratio,
        kinds=[kind(order) for order in shown.orders],
    )
    amplitudes = zip(shown.orders, spectrum.amplitudes, strict=True)
    results = {order.symbol: float(amplitude) for order, amplitude in amplitudes}
    return StepResult((_with_words(section, words_of(shown, study)),), results)


def lag(study: Study, context: Context) -> StepResult:
    """Lag of the `study` at reversal over one full relative turn, with the clearances it is made of; needs nothing of
    the `context`."""
    shown = waveform_of(study)
    whole = lag_of(study.drive, study.errors, shown.theta, shown.driven)
    parts = {"Tooth backlash": whole.backlash_arcmin, "Cross-slide": whole.cross_slide_arcmin}
    drawn = {name: values for name, values in parts.items() if values.any()}
    section = lag_section(shown.theta, whole.total_arcmin, drawn, whole.interference)
    return StepResult((section,), whole.to_dict())
