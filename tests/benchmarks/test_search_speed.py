"""Designs evaluated a second, and the same with the exact geometry. Ratios within one run.

`make benchmark` prints both rows; the ratio of their means is the gain.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from hdopt.drive.geometry import Structure
from hdopt.kinematics.extremes import extremes_arcmin
from hdopt.optimize.design_space import Combination
from hdopt.optimize.objectives import Point
from hdopt.study import load_study
from hdopt.workflow.search_setup import setup_of

pytestmark = pytest.mark.slow

TWO_DISK = Combination("two_disk", Structure.AUTOMATIC)


@cache
def problem(objective: str):
    return setup_of(load_study("csf-25-80-design-trade"), seed=1).problem(TWO_DISK, objective)


def exact_error(at: Point) -> tuple[float, np.ndarray]:
    """Peak-to-peak by the exact geometry and its slopes by central differences: what a search without the envelope
    would have to do."""

    def span(design) -> float:
        return float(np.ptp(extremes_arcmin(design.drive, at.trade.errors, "exact")))

    return span(at.design), at.slopes(span)


@pytest.mark.benchmark(group="one design with slopes")
def test_envelope(benchmark):
    at = problem("peak_to_peak_arcmin")
    rng = np.random.default_rng(1)
    at.evaluate(np.full(at.n, 0.5))  # compiled before the clock runs
    found = benchmark(lambda: at.evaluate(0.3 + 0.4 * rng.random(at.n)))
    assert found.finite


@pytest.mark.benchmark(group="one design with slopes")
def test_exact_geometry(benchmark):
    at = problem("peak_to_peak_arcmin")
    u = np.full(at.n, 0.45)
    point = at.point(at.values(u))
    value, slopes = benchmark.pedantic(lambda: exact_error(point), rounds=1)
    found = at.evaluate(u)
    # The envelope knows no gaps between phases (a few 1e-3 arcmin) and is of second order.
    assert found.objective == pytest.approx(value, abs=0.01)
    top = found.piece_slopes[found.pieces.argmax()] / at._ranges[1]
    assert top == pytest.approx(slopes, abs=0.03 * np.abs(slopes).max())


@pytest.mark.benchmark(group="one design with slopes, 99.73 % quantile of 2048 drives")
def test_quantile(benchmark):
    at = problem("peak_to_peak_quantile_arcmin")
    rng = np.random.default_rng(1)
    at.evaluate(np.full(at.n, 0.5))
    assert benchmark(lambda: at.evaluate(0.3 + 0.4 * rng.random(at.n))).finite
