"""The bench's own drive against the published numbers it was not fitted to (Jia 2021, Table 2), and its spectrum."""

import numpy as np
import pytest

from hdopt.bench.geometry import ARCMIN, RATIO, BaseErrors, kinematic_error

DEG = np.pi / 180
PAPER = {
    "axis": (0.010, 45 * DEG),
    "axis_tilts": (0.2 * DEG, 0.2 * DEG),
    "wg": (0.005, 45 * DEG),
    "wg_tilts": (0.1 * DEG, 0.1 * DEG),
    "cs": (0.002, 0.0),
    "fs": (0.002, 0.0),
}


# The paper rounds to 0.01 and samples every 10 deg over 80 turns; per-tooth arrays add up to 2e-4 of an amplitude.
@pytest.mark.parametrize(
    ("change", "published"),
    [
        ({}, 1.3290),
        ({"wg_tilts": (0.05 * DEG, 0.1 * DEG)}, 1.24),
        ({"wg_tilts": (0.15 * DEG, 0.1 * DEG)}, 1.43),
        ({"axis": (0.012, 45 * DEG)}, 1.38),
        ({"wg": (0.005, 90 * DEG)}, 1.25),
        ({"cs": (0.003, 0.0)}, 1.42),
        ({"fs": (0.001, 0.0)}, 1.22),
    ],
)
def test_peak_to_peak_on_the_papers_grid(change, published):
    theta = np.arange(0, 80 * 360 + 1, 10) * DEG
    error = kinematic_error(BaseErrors.from_polar(**{**PAPER, **change}), theta) / ARCMIN
    assert np.ptp(error) == pytest.approx(published, abs=0.007)


def test_base_spectrum_holds_the_papers_orders_and_nothing_between_them():
    theta = np.arange(80 * 256) * 2 * np.pi / 256
    error = kinematic_error(BaseErrors.from_polar(**PAPER), theta) / ARCMIN
    amplitude = 2 * np.abs(np.fft.rfft(error)) / error.size
    order = np.arange(amplitude.size) / RATIO
    assert amplitude[np.argmin(np.abs(order - 3))] == pytest.approx(0.07, abs=0.01)
    # Everything is periodic over one relative turn with lines at m + n/N, n small: midway between orders it is empty.
    between = (order > 0.2) & (np.abs(order % 1 - 0.5) < 0.25)
    assert amplitude[between].max() < 0.003
    for named in (1 / RATIO, 1, 2, 2 * (1 + 1 / RATIO), 2 * (1 + 1 / (2 * RATIO))):
        assert amplitude[np.argmin(np.abs(order - named))] > 5 * amplitude[between].max(), named
