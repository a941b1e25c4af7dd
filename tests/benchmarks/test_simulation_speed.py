"""What effects cost a stack: the compiled kernels against the base's. `make benchmark` prints ratios of one run."""

import pytest
from cases import drive, random_errors

from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin as base_peak_to_peak_arcmin
from hdopt.simulation import EffectValues, Operation
from hdopt.simulation.batch import stacked_peak_to_peak_arcmin, tabulate

pytestmark = [pytest.mark.slow, pytest.mark.benchmark(group="peak-to-peak of 1000 drives with effects, one thread")]

EFFECTS = {
    "lobing": EffectValues("circular_spline_lobing", {"lobes": 6}, (0.001, 0.0005)),
    "tooth mesh": EffectValues("tooth_mesh", {"sidebands": (0,)}, (0.02, 0.01)),
}


@pytest.mark.parametrize("name", EFFECTS)
def test_with_an_effect(benchmark, request, name):
    matrix = random_errors(20 if request.config.getoption("benchmark_disable") else 1000, seed=0).to_matrix()
    added = tabulate(drive(), [EFFECTS[name]], Operation())
    found = benchmark(stacked_peak_to_peak_arcmin, drive(), matrix, added, 1.0)
    assert (found > 0).all()


def test_without(benchmark, request):
    matrix = random_errors(20 if request.config.getoption("benchmark_disable") else 1000, seed=0).to_matrix()
    assert (benchmark(base_peak_to_peak_arcmin, drive(), matrix) > 0).all()
