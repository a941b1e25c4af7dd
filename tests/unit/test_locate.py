"""Where a residual lives: no domain holds more than there is."""

import numpy as np
import pandas as pd

from hdopt.diagnosis.checks.localization import locate
from hdopt.diagnosis.inference.fit import FitProblem, evaluate, refine
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
