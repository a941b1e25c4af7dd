"""Where a residual lives: no domain holds more than there is."""

import numpy as np
import pandas as pd
import pytest
from test_cross_validation import RATE, noisy, rows_of, without_base

from hdopt.diagnosis.checks.localization import locate
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.nuisance import nuisances_for
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather


def test_half_a_turn_holds_no_more_than_its_residual():
    """Sines of twelve whole orders on half a turn are nearly one another, and nearly what is free there anyway."""
    rng = np.random.default_rng(0)
    theta = np.tile(np.r_[np.linspace(0, np.pi, 1000), np.linspace(np.pi, 0, 1000)], 3)
    error = 0.3 * np.sin(6 * theta) + rng.normal(0, 0.1, len(theta))
    table = pd.DataFrame(
        {
            "time_s": np.arange(len(theta)) * 0.01,
            "input_angle_deg": np.degrees(theta),
            "output_angle_deg": np.degrees(theta) / 7.2 - error / 60,
        }
    )
    samples = gather([recording_from_table(table, 7.2)])
    problem = FitProblem(samples, None, nuisances_for(samples, None).columns(samples), Noise.white(samples, 0.1))
    start = evaluate(problem, np.zeros(0), np.zeros(problem.nuisance.shape[1]), (), ())
    fit = refine(start)
    for location in locate(FitProbe(fit), rng):
        assert location.rms_arcmin < np.std(fit.residual)


def test_noise_lives_nowhere():
    """By sign flips of whole turns the chance of noise is as often above a half as below it."""
    chances = [found.p for found in locate(FitProbe(without_base(noisy(30))), np.random.default_rng(0))]
    assert len(chances) > 2
    assert np.mean(chances) > 0.15


def test_a_wave_lives_in_its_domain():
    theta = np.arange(30 * RATE) * 2 * np.pi / RATE
    rows = rows_of(0.2 * np.sin(3 * theta) + np.random.default_rng(1).normal(0, 0.02, len(theta)))
    first = locate(FitProbe(without_base(rows)), np.random.default_rng(0))[0]
    assert first.domain == "integer order"
    assert first.rms_arcmin == pytest.approx(0.2 / np.sqrt(2), rel=0.05)
    assert first.p <= 0.005
