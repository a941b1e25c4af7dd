"""Drawing the verdict: the rules' conclusion, with the numbers that belong to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.checks.assessment import Evidence
from hdopt.diagnosis.checks.localization import locate
from hdopt.diagnosis.inference.base_fit import base_estimate, beat_warning, beyond_tolerances, far_errors
from hdopt.diagnosis.inference.catalogue import NEW_ZERO, SKEW, is_effect
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.nuisance import estimated, notes
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.orientation import Orientation
from hdopt.diagnosis.verdict.diagnosis import Diagnosis, FitNumbers
from hdopt.diagnosis.verdict.facts import find, varying_contact
from hdopt.diagnosis.verdict.named_effect import NamedEffect
from hdopt.diagnosis.verdict.rules import rule_for
from hdopt.effects import EFFECTS
from hdopt.effects.declared import Quantity

MICRO = 1e6
"""Millionths in one."""
LOCATE_SEED = 0
"""Seed of the sign flips that say where a residual lives."""


def draw_verdict(evidence: Evidence, warnings: tuple[str, ...]) -> Diagnosis:
    """The verdict on the `evidence`, with the `warnings` that reading the recordings gave."""
    findings = find(evidence)
    rule = rule_for(findings.facts)
    conclusion = rule.consequence(findings)
    selection = evidence.selection
    across = evidence.across_conditions
    model = selection.best.fit if findings.facts.named else selection.base
    told = {*taken_up(evidence), *(found.id for found in conclusion.effects)}
    return Diagnosis(
        verdict=conclusion.verdict,
        rule=rule.name,
        effects=conclusion.effects,
        ambiguous_with=conclusion.ambiguous_with,
        separating_test=conclusion.separating_test,
        base=base_estimate(model),
        fit=fit_numbers(evidence),
        below_detection={
            name: limit for name, limit in evidence.below_detection.items() if is_effect(name) and name not in told
        },
        warnings=(
            *warnings,
            *notes(model, evidence.nuisances),
            *orientation_notes(evidence.orientation),
            *scale_notes(evidence),
            *skew_notes(evidence),
            *zero_notes(evidence),
            *contact_notes(evidence),
            *base_notes(model),
            *prior_notes(conclusion.effects),
            *beat_notes(evidence),
            *taken_up_notes(evidence),
            *(f"{name} cannot be seen here: it needs {need}" for name, need in evidence.lacking.items()),
        ),
        says=conclusion.says,
        where=conclusion.where,
        located=tuple(locate(FitProbe(selection.base), np.random.default_rng(LOCATE_SEED))),
        confounded=conclusion.confounded,
        each_condition=across.each if across is not None else {},
        nuisances=estimated(model, evidence.nuisances),
        evidence=evidence,
    )


def fit_numbers(evidence: Evidence) -> FitNumbers:
    """The numbers behind the verdict, as in the JSON's `fit`. `evidence` is that of the diagnosis."""
    across, nested, proposed = evidence.across_conditions, evidence.nested, evidence.proposed
    return {
        "heldout_rms_base_arcmin": evidence.drive_alone.rms,
        "heldout_rms_extended_arcmin": evidence.extended_held_out.rms,
        "heldout_rms_generic_arcmin": evidence.generic_held_out.rms,
        "heldout_rms_placebo_arcmin": evidence.placebo_held_out.rms,
        "heldout_nested_rms_base_arcmin": nested.drive_alone if nested is not None else None,
        "heldout_nested_rms_arcmin": nested.extended if nested is not None else None,
        "heldout_proposed_rms_arcmin": proposed.extended if proposed is not None else None,
        "heldout_conditions_rms_base_arcmin": across.base if across is not None else None,
        "heldout_conditions_rms_extended_arcmin": across.extended if across is not None else None,
        "noise_floor_arcmin": evidence.noise_floor,
        "false_alarm_p": evidence.false_alarm_p,
    }


def orientation_notes(orientation: Orientation) -> tuple[str, ...]:
    """What must be said of the way the angles count (`orientation`)."""
    if orientation.turned:
        return (
            "both angles count the other way round than the model's: the recording was turned round; the drive's own "
            "errors are those of the turned counting, effects' phases and angles those of the recording as given",
        )
    if orientation.decided_by == "convention":
        return (
            "the recording does not say which way its angles count, and they were taken as they are; tell from the "
            "bench whether a positive input angle turns the drive as the model's does",
        )
    return ()


def scale_notes(evidence: Evidence) -> tuple[str, ...]:
    """What the `evidence` says of a ratio or gain that is off."""
    scale = evidence.scale
    if scale is None or not scale.found:
        return ()
    if scale.input_gain != 1:
        return (
            f"the input angle counts {scale.input_gain:.6g} times too far: the error grows with it, and the drive's "
            "own error fits only where the angle is corrected; it was corrected, check the input encoder's counts and "
            "any gear before it",
        )
    return (
        f"the error grows with the angle as if the ratio were {scale.ratio:.6g} in place of {evidence.rows.ratio:g}, "
        f"or the output encoder's gain {scale.gain:.6g}; check both (a slow warming at one speed would look the same)",
    )


def skew_notes(evidence: Evidence) -> tuple[str, ...]:
    """What the `evidence` says of two clocks that run apart."""
    rates = [float(rate) for (rate,) in _coefficients(evidence, SKEW)]
    return tuple(
        f"the output's clock runs {rate * MICRO:.3g} millionths {'slow' if rate > 0 else 'fast'} against the input's: "
        "the delay between them grows steadily; sample both by one clock"
        for rate in rates
    )


def zero_notes(evidence: Evidence) -> tuple[str, ...]:
    """What the `evidence` says of recordings that begin with a zero of their own."""
    return tuple(
        "the output's zero lies off the first recording's, as where it was set anew or the clamping gave way: "
        + ", ".join(f"{off:.3g} arcmin in recording {i}" for i, off in enumerate(one, 2))
        for one in _coefficients(evidence, NEW_ZERO)
    )


def contact_notes(evidence: Evidence) -> tuple[str, ...]:
    """What the `evidence` says of a k_e that varies round the input's turn."""
    waves = varying_contact(evidence.selection.best.fit)
    if not waves:
        return ()
    said = ", ".join(f"{100 * share:.2g} % at {k} a turn" for k, share in enumerate(waves, 1))
    return (
        f"the drive's own error grows and shrinks with the input angle, as where k_e varies round its turn: {said}",
    )


def _coefficients(evidence: Evidence, effect: str) -> list[Array]:
    """Those of what is called `effect` in the best set of the `evidence`, [] where it is not in it."""
    fit = evidence.selection.best.fit
    return [c for term, c in zip(fit.terms, fit.coefficients, strict=True) if term.effect == effect]


def base_notes(model: Fit) -> tuple[str, ...]:
    """A base of `model` outside the tolerances of its study, or of its kind, or far outside the latter."""
    if listed := far_errors(model):
        return (
            f"the fitted drive lies far outside the tolerances of its kind ({listed}): check drive, ratio and units",
        )
    settings = model.problem.settings.base
    outside = beyond_tolerances(model, settings.surely_outside, of_study=True)
    if not outside:
        return ()
    whose = "its study" if {one.name for one in outside} & dict(settings.stated_tolerances).keys() else "its kind"
    return (
        f"the fitted drive lies outside the tolerances of {whose} ({', '.join(map(str, outside))}): measure that "
        "error itself; an input encoder off its centre can look the same, and turned against its shaft tells",
    )


def taken_up(evidence: Evidence) -> list[str]:
    """Effects that would not have been seen if they made all of the error recorded: the drive's own errors make the
    same, as a tilted wave generator does of an eccentric input encoder. `evidence` is that of the diagnosis.
    """
    most = float(np.std(evidence.rows.error))
    hidden = [name for name, limit in evidence.below_detection.items() if limit > most]
    return [name for name in hidden if is_effect(name) and name not in evidence.selection.best.effects]


def taken_up_notes(evidence: Evidence) -> tuple[str, ...]:
    """What is said of those that the drive's own errors would take up. `evidence` is that of the diagnosis."""
    most = float(np.std(evidence.rows.error))
    return tuple(
        f"{name} cannot be seen here: of a size that made the whole error ({most:.2g} arcmin rms) the drive's own "
        "errors would take it up"
        for name in taken_up(evidence)
    )


def prior_notes(effects: Sequence[NamedEffect]) -> tuple[str, ...]:
    """Parameters of the `effects` said whose whole interval lies outside of where real drives and benches have them."""
    notes = []
    for found in effects:
        for one in EFFECTS[found.id].flat_declared():
            parameter = found.parameters.get(one.name) if isinstance(one, Quantity) else None
            if parameter is None or not isinstance(one, Quantity) or one.prior is None:
                continue
            low, high = one.prior
            if parameter.low > high or parameter.high < low:
                notes.append(
                    f"{found.id}: {one.name} {parameter.value:.3g} {parameter.unit} lies outside of what drives and "
                    f"benches have ({low:g} to {high:g}): check units, columns, signs and ratio before you believe it"
                )
    return tuple(notes)


def beat_notes(evidence: Evidence) -> tuple[str, ...]:
    """What the record's length leaves open between circular spline and flexspline, of a harmonic drive. `evidence`
    is that of the diagnosis.
    """
    problem = evidence.selection.base.problem
    if evidence.rows.locked or problem.base is None:
        return ()
    warning = beat_warning(evidence.rows, problem.settings.base)
    return () if warning is None else (warning,)
