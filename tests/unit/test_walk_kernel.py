"""The compiled extremes of drives with effects: against the base's own, and against brute force."""

from dataclasses import replace

import numpy as np
import pytest
from cases import random_errors

from hdopt.drive.errors import ERROR_NAMES, DriveErrors
from hdopt.effects.declared import Shaft
from hdopt.kinematics.extremes import extremes_arcmin
from hdopt.kinematics.waveform import full_turn
from hdopt.simulation import EffectValues, Operation
from hdopt.simulation.batch import matrix_peak_to_peak_arcmin, tabulate
from hdopt.simulation.model import ExtendedModel
from hdopt.study import load_study

STUDY = load_study(drive="csf-25-80")


def drives(times, count, seed):
    """Rows of errors up to `times` those of the shipped drive, in any direction."""
    rng = np.random.default_rng(seed)
    sizes = np.abs(STUDY.errors.to_matrix().ravel())
    turned = np.array([name.endswith(("direction", "phase")) for name in ERROR_NAMES])
    tilted = np.array(["tilt" in name for name in ERROR_NAMES])
    share = rng.uniform(0, 1, (count, len(sizes)))
    share[:, tilted] = rng.uniform(-1, 1, (count, tilted.sum()))
    rows = times * sizes * share
    rows[:, turned] = rng.uniform(0, 2 * np.pi, (count, turned.sum()))
    return rows


MISSED = [166, 507, 58, 581, 286, 184, 523, 168, 67, 48]
"""Of 600 random drives (seed 5), those whose least a walk with 40 candidates missed: up to 1.5e-3 arcmin at the shipped
tolerances, 1.5e-2 at three times them."""


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_extremes_at_changes_of_rim_are_met(times):
    """To 1e-7 arcmin of the closed form's own extremes, which are found another way: what parabolas over a sixteenth of
    a degree leave. The exact geometry differs from the closed form by up to 2e-3 at these errors.
    """
    random = random_errors(600, seed=5, scale=times).to_matrix()
    rows = np.concatenate([drives(times, 30, 11), random[MISSED], random[:60]])
    found = matrix_peak_to_peak_arcmin(STUDY.drive, rows, tabulate(STUDY.drive, [], Operation()))
    for value, row in zip(found, rows, strict=True):
        low, high = extremes_arcmin(STUDY.drive, DriveErrors(*row), "closed form")
        assert value == pytest.approx(high - low, abs=1e-7)


EFFECTS = {
    "none": ([], 1e-4),
    "every input turn": ([EffectValues("circular_spline_lobing", {"lobes": 6}, (0.001, 0.0005))], 1e-4),
    "every output turn": (
        [EffectValues("encoder_output_eccentricity", {"shaft": Shaft.OUTPUT, "orders": (1,)}, (0.1, 0.05))],
        1e-4,
    ),
    "every tooth": ([EffectValues("tooth_mesh", {"sidebands": (0,)}, (0.02, 0.01))], 3e-4),
}
"""Effects, and how far (arcmin) the kernel may be from a scan: the scan, at 0.008 deg, is 1e-4 short of a kink of
2 arcmin/rad; the table's 32 places in a period of the teeth dim their sine by 0.5 % at either end."""
PLACES, NEAR, FINE = 1440, 8e-3, 32
"""Places of a turn of the dense scan; how near to the least, arcmin, a place is looked at again, with so many more."""


def dense_least(function, theta, values):
    """Least of `function` by brute force: around every place of the scan that is near the least of `values`."""
    near = theta[values < values.min() + NEAR]
    step = theta[1] - theta[0]
    return min(function((near[:, None] + step * np.linspace(-1, 1, 2 * FINE + 1)).ravel()).min(), values.min())


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("times", [1.0, 3.0])
def test_extremes_with_effects_are_those_of_a_dense_scan(name, times):
    """Neither missed nor made up."""
    effects, within = EFFECTS[name]
    model = ExtendedModel(STUDY.drive, DriveErrors(), tuple(effects), Operation(), geometry="closed form")
    theta = full_turn(STUDY.drive, PLACES)
    rows = random_errors(600, seed=5, scale=times).to_matrix()[MISSED[:2]]
    found = matrix_peak_to_peak_arcmin(STUDY.drive, rows, tabulate(STUDY.drive, effects, Operation()))
    for value, row in zip(found, rows, strict=True):
        of_drive = replace(model, errors=DriveErrors(*row))
        values = of_drive.waveform(theta)
        low = dense_least(of_drive.waveform, theta, values)
        high = -dense_least(lambda x, m=of_drive: -m.waveform(x), theta, -values)
        assert value == pytest.approx(high - low, abs=within)
