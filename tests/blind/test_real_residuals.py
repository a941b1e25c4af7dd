"""What is put on a real residual has the size it is said to have, and prolonging keeps the residual's colour."""

import numpy as np
import pytest

from hdopt.bench import loops
from hdopt.bench.geometry import ARCMIN, RATIO
from hdopt.bench.real_residuals import ON_REAL_MOTION, RealResidual, on_real_motion, on_simulated_drive, prolonged


@pytest.fixture
def stroke():
    """Eight strokes of half a turn of a gear of 7, with coloured noise of 1.5 arcmin."""
    rng = np.random.default_rng(5)
    there = np.pi * (1 - np.cos(np.linspace(0, np.pi, 400))) / 2
    angle = np.tile(np.r_[there, there[::-1]], 8)
    noise = 1.5 * loops.first_order_noise(rng.standard_normal(angle.size), 0.8)
    return RealResidual(np.arange(angle.size) / 330, angle, noise, 7.0)


def error_arcmin(table, ratio):
    return np.deg2rad(table.input_angle_deg / ratio - table.output_angle_deg).to_numpy() / ARCMIN


@pytest.mark.parametrize("effect", ON_REAL_MOTION)
def test_an_effect_has_its_severity(stroke, effect):
    bare = error_arcmin(on_real_motion(stroke, "", 0.0, np.random.default_rng(1)), stroke.ratio)
    np.testing.assert_allclose(np.abs(bare), np.abs(stroke.residual), atol=1e-6)
    table = on_real_motion(stroke, effect, 0.5, np.random.default_rng(1))
    wave = error_arcmin(table, stroke.ratio) - bare
    assert np.std(wave) == pytest.approx(0.5 * stroke.rms, rel=1e-6)
    # Both directions differ by it: that is what the three share.
    forward = np.gradient(stroke.input_angle) > 0
    assert abs(wave[forward].mean() - wave[~forward].mean()) > np.std(wave)


def test_prolonging_keeps_the_colour(stroke):
    series = prolonged(stroke.residual, 60_000, np.random.default_rng(2))
    assert np.std(series) == pytest.approx(1)
    # AR(1) of 0.8, less the joints of one block in a hundred samples.
    assert np.corrcoef(series[1:], series[:-1])[0, 1] == pytest.approx(0.79, abs=0.02)


def test_the_drive_holds_what_is_asked_for(stroke):
    args = (stroke.residual, "encoder_input_eccentricity", 1.0)
    (noisy,) = on_simulated_drive(*args, 0.2, np.random.default_rng(6))[:1]
    (clean,) = on_simulated_drive(*args, 0.0, np.random.default_rng(6))[:1]
    noise = np.std(error_arcmin(noisy, RATIO) - error_arcmin(clean, RATIO))
    whole = np.std(error_arcmin(clean, RATIO))
    # Base and effect are equally large, and the noise is a fifth of either.
    assert noise == pytest.approx(0.2 * whole / np.sqrt(2), rel=0.15)
