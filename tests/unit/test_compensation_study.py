"""The two oracles of compensation's bench: one knows all, the other what a function of both angles can hold."""

import numpy as np
import pytest

from hdopt.bench import cases
from hdopt.bench.signal_chain import read_error
from hdopt.studies.compensation import error_of_angles


def drawn_with(effect):
    spec = cases.Spec("single" if effect else "nothing", 5, (effect,) if effect else (), 1.0)
    return cases.simulate(spec, np.random.default_rng([5, 7]))


@pytest.mark.parametrize("effect", ["", "encoder_input_eccentricity"])
def test_what_both_angles_hold_is_left_to_the_oracle(effect):
    drawn = drawn_with(effect)
    last = len(drawn.plans) - 1
    assert error_of_angles(drawn, last) == pytest.approx(read_error(drawn.setups[last], drawn.hidden), abs=1e-15)


def test_a_drift_with_the_temperature_is_not():
    """Would catch an oracle that a table is held to and that knows the temperature."""
    drawn = drawn_with("thermal_drift")
    last = len(drawn.plans) - 1
    setup = drawn.setups[last]
    missed = read_error(setup, drawn.hidden) - error_of_angles(drawn, last)
    centred = setup.run.body_k - setup.run.body_k.mean()
    assert np.ptp(missed) > 0.1 * np.ptp(read_error(setup, drawn.hidden))
    assert missed == pytest.approx(centred * (centred @ missed) / (centred @ centred), abs=1e-12)


def test_balls_are_not():
    drawn = drawn_with("bearing_pass")
    last = len(drawn.plans) - 1
    setup = drawn.setups[last]
    assert error_of_angles(drawn, last) == pytest.approx(read_error(setup), abs=1e-15)
    assert np.ptp(read_error(setup, drawn.hidden) - read_error(setup)) > 0.1 * np.ptp(read_error(setup))
