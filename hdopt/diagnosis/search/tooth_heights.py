"""A mesh whose every tooth has a height of its own, fitted inside the larger-zone rule.

A flank's form is as high as its tooth is worn or cut: heights that differ at random from tooth to tooth have waves of
every number round the rim. Their slow part, and the mean of the form over a pitch, lift the driving zone as the base
does, so that no sidebands of the mesh hold them. The heights come in as waves round the rim, a few at first, each step
from where the one before it ended, until every tooth is free.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.fit import Fit, evaluate, refine
from hdopt.diagnosis.numerical import HALF, TINY
from hdopt.effects.met import ToothForms
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Term


def fit_heights(start: Fit, term: Term) -> Fit:
    """The fit with a height of every tooth from `start`, a drive with what stands beside the mesh; `term` has the form
    of the teeth, all alike. Its last term has the heights that were found as its shape, of an rms of 1, and their
    size as its coefficient.
    """
    forms = _forms_of(term)
    teeth, settings = len(forms.heights), start.problem.settings
    steps = (*settings.high_order.height_waves, *[teeth] * settings.high_order.height_rounds)
    beside = [replace(one, steps={}) for one in start.terms]
    own, fit = np.array([float(forms.heights.mean())]), start
    for waves in steps:
        basis = waves_round(teeth, waves)
        own = np.r_[own, np.zeros(basis.shape[1] - len(own))]
        free = replace(term, met=replace(_forms_of(term), heights=basis), steps={})
        weights = fit.coefficients[: len(beside)]
        fit = evaluate(fit.problem, fit.errors, fit.offsets, [*beside, free], [*weights, own])
        fit = refine(fit, settings.base.full_iterations, move_shapes=False)
        weights, own = fit.coefficients[:-1], fit.coefficients[-1]
        heights = basis @ own
        size = max(float(np.sqrt(np.mean(heights**2))), TINY)
        shape = {**term.shape, "heights": tuple(map(float, heights / size))}
        term = fit.problem.explanations[term.effect].term(fit.problem.rows, shape)
        fit = evaluate(fit.problem, fit.errors, fit.offsets, [*beside, term], [*weights, np.array([size])])
        fit = refine(fit, settings.high_order.skew_iterations)
        term, own = fit.terms[-1], own * (fit.coefficients[-1][0] / size)
    return fit


def waves_round(teeth: int, waves: int) -> Array:
    """Heights of so many `teeth` by their mean and up to so many `waves` round the rim, (teeth, q): q is 2 waves + 1,
    or every tooth's own where that is more than there are.
    """
    most = min(waves, teeth // 2)
    angle = (np.arange(teeth, dtype=np.float64) + HALF) * (2 * np.pi / teeth)
    basis = np.hstack([np.ones((teeth, 1)), sine_columns(angle, range(1, most + 1))]) if most else np.ones((teeth, 1))
    # Half as many waves as teeth have one phase alone: where the teeth stand at the crests.
    return np.delete(basis, -1, axis=1) if 2 * most == teeth else basis


def _forms_of(term: Term) -> ToothForms:
    if not isinstance(term.met, ToothForms):
        raise TypeError(f"a term of {term.effect} has no form of single teeth")
    return term.met
