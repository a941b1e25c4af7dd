"""Steps about the one drive in [errors]: its kinematic error over a relative turn, its orders, its lag."""

from __future__ import annotations

from hdopt.kinematics import peak_to_peak_arcmin
from hdopt.kinematics.lag import lag as lag_of
from hdopt.kinematics.waveform import relative_turn
from hdopt.report.sections.lag import lag_section
from hdopt.report.sections.orders import spectrum_section
from hdopt.report.sections.waveform import waveform_section
from hdopt.spectrum import model_orders, order_spectrum
from hdopt.steps import Context, StepResult, requirement_arcmin
from hdopt.study import Study

SAMPLES_PER_TURN = 720
PAPER_ORDERS = ("1/N", "1", "2", "2(1+1/2N)", "2(1+1/N)")
"""The orders that Jia 2021, Table 6 names."""


def waveform(study: Study, context: Context) -> StepResult:
    """Kinematic error over one full relative turn."""
    theta, error = relative_turn(study.drive, study.errors, SAMPLES_PER_TURN)
    converged = float(peak_to_peak_arcmin(study.drive, study.errors))
    required = requirement_arcmin(study)
    section = waveform_section(theta, error, peak_to_peak_arcmin=converged, requirement_arcmin=required)
    return StepResult((section,), {"peak_to_peak_arcmin": converged, "required_arcmin": required})


def orders(study: Study, context: Context) -> StepResult:
    """Amplitudes at the model's orders."""
    ratio = study.drive.geometry.ratio
    theta, error = relative_turn(study.drive, study.errors, SAMPLES_PER_TURN)
    named = model_orders(ratio)
    spectrum = order_spectrum(theta, error, [order.order for order in named])
    section = spectrum_section(
        spectrum.orders,
        spectrum.amplitudes,
        [order.symbol for order in named],
        [order.origin for order in named],
        ratio,
        kinds=[
            "Named in Jia 2021, Table 6" if order.symbol in PAPER_ORDERS else "Beyond Table 6: the driving zone changes"
            for order in named
        ],
    )
    amplitudes = zip(named, spectrum.amplitudes, strict=True)
    return StepResult((section,), {order.symbol: float(amplitude) for order, amplitude in amplitudes})


def lag(study: Study, context: Context) -> StepResult:
    """Lag at reversal over one full relative turn, with the clearances it is made of."""
    theta, error = relative_turn(study.drive, study.errors, SAMPLES_PER_TURN)
    whole = lag_of(study.drive, study.errors, theta, error)
    parts = {"Tooth backlash": whole.backlash_arcmin, "Cross-slide": whole.cross_slide_arcmin}
    shown = {name: values for name, values in parts.items() if values.any()}
    section = lag_section(theta, whole.total_arcmin, shown, whole.interference)
    return StepResult((section,), whole.to_dict())
