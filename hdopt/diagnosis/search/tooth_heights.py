"""A mesh whose every tooth has a height of its own, fitted inside the larger-zone rule.

A flank's form is as high as its tooth is worn or cut: heights that differ at random from tooth to tooth have waves of
every number round the rim. Their slow part, and the mean of the form over a pitch, lift the driving zone as the base
does, so that no sidebands of the mesh hold them. The heights come in as waves round the rim, a few at first, each step
from where the one before it ended, until every tooth is free. At last single teeth are tried at other heights.
Where all of this leaves more than noise, other drives are drawn beside the free heights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.base_fit import drawn, with_offsets
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, evaluate
from hdopt.diagnosis.numerical import HALF, TINY
from hdopt.effects.met import ToothForms
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Term
from hdopt.kinematics.cartesian import CARTESIAN_NAMES
from hdopt.parallel.shared_memory import each

OF_TWO_SIGNS = tuple(
    i for i, name in enumerate(CARTESIAN_NAMES) if " tilt " in name or name.endswith("along its minor axis")
)
"""Errors of a drive of which the record shows the larger of two signs at any place: the rims', which lift either edge,
and what moves the wave generator across its major axis."""


def fit_heights(start: Fit, term: Term) -> Fit:
    """The fit with a height of every tooth from `start`, a drive with what stands beside the mesh; `term` has the form
    of the teeth, all alike. Its last term has the heights that were found as its shape, over their usual size,
    and that size as its coefficient.
    """
    forms = _forms_of(term)
    teeth, settings = len(forms.heights), start.problem.settings.high_order
    own, fit = np.array([float(forms.heights.mean())]), start
    beside = len(start.terms)
    for waves in (*settings.height_waves, *[teeth] * settings.height_rounds):
        basis = waves_round(teeth, waves)
        own = np.r_[own, np.zeros(basis.shape[1] - len(own))]
        fit = _with_heights(fit, beside, term, basis, own)
        term = fit.terms[-1]
        own = np.linalg.lstsq(basis, heights_of(fit), rcond=None)[0]
    return _single_teeth_mended(fit)


def of_other_drives(fit: Fit, rng: np.random.Generator) -> Fit:
    """A fit with a height of every tooth as `fit` has, its last term, from other drives and other skews of the form,
    drawn by `rng`: the one of them that leaves least, or `fit`.

    Heights of single teeth take up what a wrong drive leaves, so that no step leads from one minimum to the next. They
    differ most in the tilts and in what lies along the minor axis, of which the record shows the larger of two signs at
    any place (Jia 2021, Eqs. (16)-(32), to first order); every second start draws these alone, the others the whole
    drive. With the skew held, the heights of all teeth and the drive come down together in some steps.
    """
    settings = fit.problem.settings.high_order
    beside, forms = len(fit.terms) - 1, _forms_of(fit.terms[-1])
    held = held_but_driven(fit.terms[:beside])
    alike = np.full(len(forms.heights), usual(heights_of(fit)))
    every = np.eye(len(alike))

    def begun(number: int) -> tuple[Array, float]:
        errors, other = fit.errors.copy(), drawn(fit.problem, rng)
        of_two_signs = list(OF_TWO_SIGNS)
        errors[of_two_signs] = other[of_two_signs]
        return other if number % 2 else errors, float(rng.uniform(-settings.drawn_skew, settings.drawn_skew))

    def come_down(start: tuple[Array, float]) -> tuple[Fit, Term]:
        errors, skew = start
        skewed = replace(fit.terms[-1], shape={**fit.terms[-1].shape, "skew": skew})
        free = replace(skewed, met=replace(forms, heights=every, skew=skew), steps={})
        there = evaluate(fit.problem, errors, fit.offsets, [*held, free], [*fit.coefficients[:beside], alike])
        base = fit.problem.settings.base
        return refine(with_offsets(there), base.start_iterations, base.start_tolerance), skewed

    def mended(found: tuple[Fit, Term]) -> Fit:
        there, skewed = found
        whole = evaluate(there.problem, there.errors, there.offsets, *_of_heights(there, skewed, heights_of(there)))
        return _single_teeth_mended(refine(whole, settings.skew_iterations))

    found = each(come_down, [begun(number) for number in range(settings.other_drives)])
    best = sorted(found, key=lambda one: one[0].objective)[: settings.other_drives_kept]
    return min([fit, *each(mended, best)], key=lambda one: one.objective)


def _single_teeth_mended(fit: Fit) -> Fit:
    """`fit` with single teeth at other heights, its last term, as long as that leaves less."""
    settings, beside = fit.problem.settings.high_order, len(fit.terms) - 1
    teeth = len(heights_of(fit))
    basis = waves_round(teeth, teeth)
    for _ in range(settings.height_rounds):
        if (heights := single_teeth_tried(fit)) is None:
            break
        own = np.asarray(np.linalg.solve(basis, heights), np.float64)
        again = _with_heights(fit, beside, fit.terms[-1], basis, own)
        if again.objective >= fit.objective:
            break
        fit = again
    return fit


def _with_heights(fit: Fit, beside: int, term: Term, basis: Array, own: Array) -> Fit:
    """The fit from `fit` with its first terms (`beside` of them) and a mesh like `term`, whose heights are those of a
    `basis` (teeth, q) from the coefficients `own` (q,) on: at first with the form as it is, then with these heights and
    a free form.
    """
    settings = fit.problem.settings
    others = held_but_driven(fit.terms[:beside])
    free = replace(term, met=replace(_forms_of(term), heights=basis), steps={})
    fit = evaluate(fit.problem, fit.errors, fit.offsets, [*others, free], [*fit.coefficients[:beside], own])
    fit = refine(fit, settings.base.full_iterations)
    heights = basis @ fit.coefficients[-1]
    fit = evaluate(fit.problem, fit.errors, fit.offsets, *_of_heights(fit, term, heights))
    return refine(fit, settings.high_order.skew_iterations)


def held_but_driven(terms: Sequence[Term]) -> list[Term]:
    """`terms` at the shapes that they have, but for those of what the drive's motion swings: these were found beside
    the motion without the mesh."""
    return [one if is_driven(one) else replace(one, steps={}) for one in terms]


def _of_heights(fit: Fit, term: Term, heights: Array) -> tuple[list[Term], list[Array]]:
    """The terms of `fit` and their coefficients with a mesh like `term` of these `heights` (teeth,) mm as the last."""
    size = usual(heights)
    shape = {**term.shape, "heights": tuple(map(float, heights / size))}
    mesh = fit.problem.explanations[term.effect].term(fit.problem.rows, shape)
    return [*fit.terms[:-1], mesh], [*fit.coefficients[:-1], np.array([size])]


def usual(heights: Array) -> float:
    """The median size of these `heights` (teeth,), above 0: a tooth that hardly ever drives may be told any height."""
    return max(float(np.median(np.abs(heights))), TINY)


def heights_of(fit: Fit) -> Array:
    """The height of every tooth (teeth,) mm of the mesh that is the last term of `fit`."""
    return np.asarray(_forms_of(fit.terms[-1]).heights @ fit.coefficients[-1])


def single_teeth_tried(fit: Fit) -> Array | None:
    """Heights (teeth,) mm with which single teeth of `fit` leave clearly less, or None where none does. A tooth that
    is told too low while it takes the load from the other zone only now and then does not drive in the model at all:
    no slope leads a fit to its height. Each is tried at a few parts of their usual size, those of either half of the
    rim at once, since both zones never stand on the same half.
    """
    forms, settings = _forms_of(fit.terms[-1]), fit.problem.settings.high_order
    heights, teeth = heights_of(fit), len(forms.heights)
    tooth = np.array([forms.places(angle)[0] for angle in fit.met_angles[forms.spline]])
    size = usual(heights)
    best, gained = heights.copy(), np.full(teeth, settings.tooth_gain * fit.problem.noise.sigma**2)
    for half in (np.arange(teeth) < teeth // 2, np.arange(teeth) >= teeth // 2):
        for part in settings.tooth_parts:
            tried = np.where(half, part * size, heights)
            other = evaluate(fit.problem, fit.errors, fit.offsets, *_of_heights(fit, fit.terms[-1], tried))
            less = fit.residual**2 - other.residual**2
            gain = np.bincount(tooth[0], less, teeth) + np.bincount(tooth[1], less, teeth)
            better = half & (gain > gained)
            best[better], gained[better] = tried[better], gain[better]
    chosen = _apart(np.flatnonzero(best != heights), gained, teeth)
    if not len(chosen):
        return None
    heights[chosen] = best[chosen]
    return heights


def _apart(found: Index, gained: Array, teeth: int) -> Index:
    """Of the teeth that were `found` those whose rows no other explains better, by what each `gained` (teeth,): rows
    that one tooth explains are gained by its neighbours and by those that the other zone meets meanwhile, too."""
    half = teeth // 2
    taken: set[int] = set()
    chosen = []
    for one in sorted(found.tolist(), key=lambda one: -gained[one]):
        if one % half not in taken:
            chosen.append(one)
            taken |= {(one + step) % half for step in (-1, 0, 1)}
    return np.array(chosen, np.int64)


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
