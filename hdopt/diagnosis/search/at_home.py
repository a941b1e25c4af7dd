"""The drive within the tolerances of its kind, in place of one outside them that explains hardly more.

How an eccentricity is shared between the axis and the CS teeth, and what lies along the minor axis, shows little: fits
that leave the same have drives that are far apart. One outside its tolerances stands for physics that is left out only
where none within them would do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hdopt.diagnosis.inference.base_fit import beyond_tolerances, fit_base, is_far
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, evaluate
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.penalty import leaves_nothing


def is_outside_tolerances(fit: Fit) -> bool:
    """Whether the drive in `fit` lies outside the tolerances of its kind: far, or surely."""
    return bool(is_far(fit).any() or beyond_tolerances(fit, fit.problem.settings.base.surely_outside))


def brought_home(fit: Fit, inflation: float, rng: np.random.Generator) -> Fit:
    """`fit`, or where its drive lies outside the tolerances of its kind the best one of its terms beside a drive within
    them, if that leaves hardly more: what noise makes, and what inexact shapes leave, which any drive may take up.
    `inflation` says how much rougher the noise is than its model; drives are drawn by `rng`.
    """
    if not is_outside_tolerances(fit):
        return fit
    home = fitted_within(fit, rng)
    if (free := refine(home)).objective < home.objective and not is_outside_tolerances(free):
        home = free
    more = (home.objective - fit.objective) / home.problem.noise.sigma**2 / inflation
    hardly = fit.problem.settings.search.home_within + left_by_shapes(fit) / inflation
    return fit if more > hardly or is_outside_tolerances(home) else home


def left_by_shapes(fit: Fit) -> float:
    """What the terms of `fit` may leave because their shapes are inexact, in noise variances: a small share of what
    each of these explains beside the others."""
    shapes = [i for i, term in enumerate(fit.terms) if not leaves_nothing(term)]
    explained = sum(FitProbe(fit, keep=fit.all_but(i)).gain(fit.terms[i]) for i in shapes)
    return fit.problem.settings.verdict.other_law_inexact * explained


def fitted_within(fit: Fit, rng: np.random.Generator) -> Fit:
    """The best fit of the terms of `fit` beside a drive within the tolerances of its kind, on the same problem, from
    drives drawn by `rng`."""
    problem = fit.problem
    narrow = replace(problem, prior_scale=problem.prior_scale / problem.settings.base.box_over_tolerance)
    home = refine(fit_base(narrow, rng, problem.settings.base.starts_joint, terms=fit.terms))
    return evaluate(problem, home.errors, home.offsets, home.terms, home.coefficients)
