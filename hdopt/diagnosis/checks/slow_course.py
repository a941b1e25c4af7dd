"""Several slow effects against one smooth course of time.

A record of one pass over little more than an output turn meets few angles of the output twice. There an eccentric
output encoder, a drift and a ratio that is off are three smooth curves, which together bend to any other, as to a power
of the time, of which no more than a parabola shows. Each alone has a form of its own; where a polynomial of the time
tells what they tell together, and with fewer coefficients, that form has not shown.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.checks.slow_wander import is_slow
from hdopt.diagnosis.inference.catalogue import SCALE, is_effect
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import HALF, TINY
from hdopt.effects.conditions import Conditions
from hdopt.effects.term import Term


def told_by_a_course(fit: Fit, inflation: float) -> float:
    """By how much log evidence a polynomial of the time, of fewer coefficients, explains better than all slow terms of
    `fit` together, in noise rougher by `inflation`; 0 where none does, where only one of its terms is slow or none of
    these is an effect, and where nobody knows the time.
    """
    slow = [i for i, term in enumerate(fit.terms) if term.columns is not None and is_slow(fit, i)]
    rows = fit.problem.rows
    if len(slow) < 2 or not any(is_effect(fit.terms[i].effect) for i in slow) or rows.time is None:
        return 0.0
    probe = FitProbe(fit, keep=[i for i in range(len(fit.terms)) if i not in slow])
    terms = [fit.terms[i] for i in slow]
    freedom = sum(term.freedom for term in terms)
    each = math.log(fit.problem.weighed_rows)

    def evidence(gain: float, coefficients: int) -> float:
        return HALF * (gain / inflation - coefficients * each)

    own = evidence(probe.gain(_as_term(np.column_stack([fit.columns_of(term) for term in terms]))), freedom)
    degrees = range(1, freedom)
    gains = probe.gains_of_parts(_as_term(course_of_time(rows, freedom - 1)), [range(degree) for degree in degrees])
    best = max(evidence(gain, degree) for gain, degree in zip(gains, degrees, strict=True))
    return max(0.0, best - own - math.log(len(degrees)))


def course_of_time(rows: Conditions, degree: int) -> Array:
    """Polynomials of the time since each recording of `rows` began, of the first to this `degree`, (n, degree): those
    of Legendre on the longest recording."""
    elapsed = rows.known_time.copy()
    for record in range(rows.records):
        own = rows.record == record
        elapsed[own] -= elapsed[own].min()
    along = 2 * elapsed / max(float(elapsed.max()), TINY) - 1
    return np.asarray(np.polynomial.legendre.legvander(along, degree)[:, 1:])


def _as_term(columns: Array) -> Term:
    """`columns` (n, k) as they are: a scale is no error of a reading, and has no shape."""
    return Term(SCALE, {}, columns=columns)
