"""Several slow effects against one smooth course of time."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from test_cross_validation import TURN, rows_of

from hdopt.diagnosis.checks.slow_course import course_of_time, told_by_a_course
from hdopt.diagnosis.inference.catalogue import SCALE, explanations
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.effects.declared import Shaft

RATIO, RATE, SIGMA = 80.0, 60, 0.02
ECCENTRIC = ("encoder_output_eccentricity", {"shaft": Shaft.OUTPUT, "orders": (1,)})


def fitted(shape, turns, *effects, time=True, locked=False):
    """The least-squares fit of `effects` to an error of this `shape` (of the time from 0 to 1, and the rows) over so
    many input turns, one way, in noise of `SIGMA`."""
    rows = rows_of(np.zeros(turns * RATE))
    theta = np.arange(len(rows)) * TURN / RATE
    seconds = theta / 2 + 7.0
    rows = replace(
        rows, ratio=RATIO, theta=theta, output=theta / RATIO, time=seconds if time else None, locked=locked,
        block=np.arange(len(rows)) // RATE,
    )  # fmt: skip
    along = (seconds - seconds[0]) / np.ptp(seconds)
    error = shape(along, rows) + np.random.default_rng(4).normal(0, SIGMA, len(rows))
    rows = replace(rows, error=error)
    problem = FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, SIGMA))
    terms = [explanations()[name].term(rows, shape) for name, shape in effects]
    columns = np.column_stack([problem.nuisance, *(term.columns for term in terms)])
    found = np.linalg.lstsq(columns, error, rcond=None)[0]
    ends = np.cumsum([1, *(term.width for term in terms)])
    parts = [found[a:b] for a, b in pairwise(ends)]
    return evaluate(problem, np.zeros(0), found[:1], terms, parts)


def power(along, rows):
    return 0.4 * along**1.8


def eccentric(along, rows):
    return 0.05 * np.sin(rows.output + 0.4) + 0.1 * along


@pytest.mark.parametrize(
    ("shape", "turns", "told"),
    [(power, 100, True), (eccentric, 100, False), (eccentric, 10, True)],
)
def test_a_course_tells_what_several_slow_effects_bend_to(shape, turns, told):
    """A power of the time over 1.25 output turns: a parabola of two coefficients tells it, the sine and the slope that
    stand for it have three. A true sine beside a true slope is told by no parabola, unless the record is an eighth of
    an output turn. Faults caught: coefficients that cost nothing, a course of as many, the gain of one effect alone.
    """
    evidence = told_by_a_course(fitted(shape, turns, ECCENTRIC, (SCALE, {})), 1.0)
    assert (evidence > 2.0) is told
    assert evidence >= 0.0


def test_a_course_pays_for_what_it_gains():
    """By sums of squares: what line and parabola leave against what sine and slope leave, half of log n for each
    coefficient less, and log 2 for two courses tried; gains of some 1e5 are solved with a ridge of 1e-8. Fault caught:
    a line that is paid for, and a parabola's gain."""
    fit = fitted(power, 100, ECCENTRIC, (SCALE, {}))
    rows = fit.problem.rows
    n, along = len(rows), rows.time - rows.time[0]

    def left(*columns):
        matrix = np.column_stack([np.ones(n), *columns])
        return np.sum((rows.error - matrix @ np.linalg.lstsq(matrix, rows.error, rcond=None)[0]) ** 2) / SIGMA**2 / 2

    own = left(np.sin(rows.output), np.cos(rows.output), rows.theta) + 3 * np.log(n) / 2
    courses = [left(*(along**k for k in range(1, degree + 1))) + degree * np.log(n) / 2 for degree in (1, 2)]
    assert told_by_a_course(fit, 1.0) == pytest.approx(own - min(courses) - np.log(2), abs=0.01)


def test_noise_that_is_rougher_tells_less():
    """Fault caught: the inflation forgotten."""
    fit = fitted(eccentric, 10, ECCENTRIC, (SCALE, {}))
    assert told_by_a_course(fit, 4.0) != told_by_a_course(fit, 1.0)


@pytest.mark.parametrize(
    ("effects", "known"),
    [
        ([ECCENTRIC], {}),
        ([(SCALE, {}), ("_skew", {})], {}),
        ([ECCENTRIC, (SCALE, {})], {"time": False}),
        ([ECCENTRIC, (SCALE, {})], {"locked": True}),
        ([ECCENTRIC, ("encoder_input_eccentricity", {"shaft": Shaft.INPUT, "orders": (1,)})], {}),
    ],
    ids=["one alone", "no effect", "no time", "locked", "one slow"],
)
def test_where_no_course_is_asked(effects, known):
    """Faults caught: a single effect held against any curve; nuisances alone called an unknown effect; an effect that
    comes every turn taken for a slow one."""
    assert told_by_a_course(fitted(power, 100, *effects, **known), 1.0) == 0.0


def test_time_counts_from_the_start_of_each_recording():
    """Fault caught: a second recording that goes on where the first one ended."""
    rows = rows_of(np.zeros(2 * RATE))
    first, second = np.linspace(0, 4, RATE), np.linspace(0, 3, RATE)
    rows = replace(rows, time=np.r_[first, 100 + second], record=np.repeat([0, 1], RATE))
    along = np.r_[first, second] / 2 - 1
    np.testing.assert_allclose(course_of_time(rows, 2), np.column_stack([along, (3 * along**2 - 1) / 2]))
