"""Steps about the one drive in [errors]: its kinematic error over a relative turn, its orders, its lag, its effects."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hdopt.extended.extremes import peak_to_peak_arcmin as extended_peak_to_peak_arcmin
from hdopt.extended_look import driven_waveform, effect_orders, effect_table, remarks
from hdopt.included import extended_model, inclusion
from hdopt.kinematics import peak_to_peak_arcmin
from hdopt.kinematics.lag import lag as lag_of
from hdopt.kinematics.waveform import relative_turn
from hdopt.report import Section, Text
from hdopt.report.sections.effects import WAYS, effects_section
from hdopt.report.sections.lag import lag_section
from hdopt.report.sections.orders import spectrum_section
from hdopt.report.sections.waveform import waveform_section
from hdopt.spectrum import ModelOrder, model_orders, order_spectrum
from hdopt.steps import Context, StepResult, requirement_arcmin
from hdopt.study import Study

Array = NDArray[np.float64]

SAMPLES_PER_TURN = 720
PAPER_ORDERS = ("1/N", "1", "2", "2(1+1/2N)", "2(1+1/N)")
"""The orders that Jia 2021, Table 6 names."""


@dataclass(frozen=True)
class Waveform:
    """A drive's kinematic error (arcmin) over `theta` (rad) of one relative turn, and the part that its zones drive;
    the orders worth a look, and a word on what is shown."""

    theta: Array
    error: Array
    driven: Array
    orders: tuple[ModelOrder, ...]
    says: str = ""


def waveform_of(study: Study) -> Waveform:
    """The base model's waveform, or the extended model's in the first direction of its motion."""
    named = model_orders(study.drive.geometry.ratio)
    if not study.effects:
        theta, error = relative_turn(study.drive, study.errors, SAMPLES_PER_TURN)
        return Waveform(theta, error, error, named)
    model = extended_model(study)
    model = model.with_effects([effect for effect in model.effects if effect not in model.too_fine])
    direction = model.operation.directions[0]
    theta, error = model.relative_turn(direction)
    says = f"With the effects that the base model leaves out; {WAYS[direction]} motion is shown"
    says += "." if len(model.operation.directions) == 1 else ", the peak-to-peak is that of both directions together."
    return Waveform(theta, error, driven_waveform(model, direction), (*named, *effect_orders(model)), says)


def _with_words(section: Section, words: str) -> Section:
    return replace(section, items=(Text(words), *section.items)) if words else section


def effects(study: Study, context: Context) -> StepResult:
    """What each effect adds, and the waveform with and without them."""
    model, chosen = extended_model(study), inclusion(study, "all")
    base = extended_peak_to_peak_arcmin(model.with_effects([]))
    whole = extended_peak_to_peak_arcmin(model)
    rows = effect_table(study, model, chosen, whole, base)
    shown = model.with_effects([effect for effect in model.effects if effect not in model.too_fine])
    passes = {direction: shown.relative_turn(direction) for direction in model.operation.directions}
    theta = next(iter(passes.values()))[0]
    _, bare = relative_turn(study.drive, study.errors, shown.samples_per_turn, "exact")
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
    results = {"base_peak_to_peak_arcmin": base, "peak_to_peak_arcmin": whole, "effects": [dict(row) for row in rows]}
    return StepResult((section,), results)


def waveform(study: Study, context: Context) -> StepResult:
    """Kinematic error over one full relative turn."""
    shown = waveform_of(study)
    if study.effects:
        converged = extended_peak_to_peak_arcmin(extended_model(study))
    else:
        converged = float(peak_to_peak_arcmin(study.drive, study.errors))
    required = requirement_arcmin(study)
    section = waveform_section(shown.theta, shown.error, peak_to_peak_arcmin=converged, requirement_arcmin=required)
    results = {"peak_to_peak_arcmin": converged, "required_arcmin": required}
    return StepResult((_with_words(section, shown.says),), results)


def orders(study: Study, context: Context) -> StepResult:
    """Amplitudes at the model's orders, and at those of the effects."""
    shown = waveform_of(study)
    spectrum = order_spectrum(shown.theta, shown.error, [order.order for order in shown.orders])
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
    return StepResult((_with_words(section, shown.says),), results)


def lag(study: Study, context: Context) -> StepResult:
    """Lag at reversal over one full relative turn, with the clearances it is made of."""
    shown = waveform_of(study)
    whole = lag_of(study.drive, study.errors, shown.theta, shown.driven)
    parts = {"Tooth backlash": whole.backlash_arcmin, "Cross-slide": whole.cross_slide_arcmin}
    drawn = {name: values for name, values in parts.items() if values.any()}
    section = lag_section(shown.theta, whole.total_arcmin, drawn, whole.interference)
    return StepResult((section,), whole.to_dict())
