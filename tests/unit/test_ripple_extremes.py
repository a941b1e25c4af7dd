"""Extremes of a waveform with a ripple that its coarse grid does not resolve."""

import numpy as np

from hdopt.simulation.extremes import RIPPLE_POINTS, _lowest_with_ripple
from hdopt.simulation.model import ExtendedModel
from hdopt.study import load_study

ORDER, SIZE = 400.0, 0.05


def test_the_lowest_of_a_ripple_is_found_to_the_step_that_is_looked_at():
    """Slow waves with a ripple, at forty phases: what is missed is at most what a step of a period over RIPPLE_POINTS
    leaves of a sine, and of slow waves nothing to speak of. Faults caught: a period that is longer or shorter than the
    ripple's, offsets to one side only, one candidate of two."""
    theta = np.arange(720) * 2 * np.pi / 720
    step = 2 * np.pi / RIPPLE_POINTS
    worst = 0.0
    for phase in np.linspace(0, 2 * np.pi, 40, endpoint=False):

        def function(x, phase=phase):
            return np.sin(2 * x + 0.3) + SIZE * np.sin(ORDER * x + phase)

        fine = np.arange(2_000_000) * 2 * np.pi / 2_000_000
        off = _lowest_with_ripple(function, theta, function(theta), ORDER) - function(fine).min()
        worst = max(worst, off)
        assert off > -1e-6
    assert worst <= 1.05 * SIZE * (1 - np.cos(step / 2))


def test_without_a_direction_the_pass_is_forward():
    """Fault caught: a default that is another direction, or none."""
    study = load_study(drive="csf-25-80")
    model = ExtendedModel(study.drive, study.errors, (), study.operation)
    theta = np.linspace(0, 6, 50)
    np.testing.assert_array_equal(model.waveform(theta), model.waveform(theta, 1.0))
