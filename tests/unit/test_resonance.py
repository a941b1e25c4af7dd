"""The resonance of a joint that carries its output's inertia, against its equation of motion solved on its own."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hdopt.drive.geometry import ARCMIN
from hdopt.effects import EFFECTS
from hdopt.effects._oscillator import relative_responses
from hdopt.effects.conditions import Conditions
from hdopt.effects.resonance import Foot

RATIO, FREQUENCY, DAMPING = 80.0, 4.0, 0.06
W = 2 * math.pi * FREQUENCY


def angle(time, start):
    """Input angle (rad), speed and acceleration: from `start` rad/s up by 30 rad/s within the second second."""
    u = np.clip(time - 1.0, 0.0, 1.0)
    speed = start + 30 * (3 * u**2 - 2 * u**3)
    theta = start * time + 30 * (u**3 - u**4 / 2) + 30 * np.maximum(time - 2.0, 0.0)
    return theta, speed


def error(theta):
    """Kinematic error of the drive itself, rad at the output, and its slope by the input angle."""
    return 0.3 * ARCMIN * np.sin(2 * theta + 0.4), 0.6 * ARCMIN * np.cos(2 * theta + 0.4)


def conditions_of(time, theta, speed):
    n = len(time)
    one = np.zeros(n, np.int64)
    return Conditions(
        ratio=RATIO,
        theta=theta,
        output=theta / RATIO,
        direction=np.ones(n),
        travel=np.zeros(n),
        first=np.ones(n, bool),
        record=one,
        piece=one,
        time=time,
        speed=speed,
        torque=None,
        temperature=None,
    )


def recorded(time, start, share):
    """Recorded error (arcmin) of an inertia on a spring whose foot moves by theta/N less the error; `share` of the
    damping acts on the output's own speed. Before the record the foot moved steadily."""

    def motion(t, state):
        theta, speed = angle(np.array(t), start)
        own, slope = error(theta)
        foot, foot_speed = theta / RATIO - own, (1 / RATIO - slope) * speed
        position, rate = state
        force = W**2 * (foot - position) + 2 * DAMPING * W * ((1 - share) * (foot_speed - rate) - share * rate)
        return [rate, float(force)]

    theta, _ = angle(time, start)
    steady = -share * 2 * DAMPING / W * start / RATIO - error(theta[0])[0]
    begin = [steady, start / RATIO]
    solved = solve_ivp(motion, (time[0], time[-1]), begin, t_eval=time, rtol=1e-10, atol=1e-14, max_step=2e-3)
    return (theta / RATIO - solved.y[0]) / ARCMIN


@pytest.mark.parametrize("start", [0.0, 12.0])
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_change_of_speed_swings_the_joint_as_its_equation_says(start, share):
    """The clock's 1/40 of a period keeps waves within 2 %; before it settles, the first second is left out."""
    time = np.arange(0, 5, 2.5e-3)
    theta, speed = angle(time, start)
    conditions = conditions_of(time, theta, speed)
    own = error(theta)[0] / ARCMIN
    shape = {"frequency_hz": FREQUENCY, "damping_ratio": DAMPING, "foot": Foot.WHOLE_MOTION}
    term = EFFECTS["resonance"].term(conditions, shape, own)
    added = term.columns @ np.array([1.0, share])
    truth = recorded(time, start, share) - own
    late = time > 1.0
    assert np.ptp(truth[late]) > 3.0  # the change of speed, not the error of 0.6 arcmin, makes most of it
    assert np.std((added - truth)[late]) < 0.02 * np.std(truth[late])
    alone = EFFECTS["resonance"].term(conditions, {**shape, "foot": Foot.ERROR}, own).columns @ np.array([1.0, share])
    assert np.std((alone - truth)[late]) > 0.5 * np.std(truth[late])


def test_at_a_steady_acceleration_the_output_lags_by_a_over_w_squared():
    time = np.arange(0, 20, 5e-3)
    acceleration = 2.0
    theta = 5.0 * time + acceleration * time**2 / 2
    conditions = conditions_of(time, theta, 5.0 + acceleration * time)
    shape = {"frequency_hz": FREQUENCY, "damping_ratio": DAMPING, "foot": Foot.WHOLE_MOTION}
    term = EFFECTS["resonance"].term(conditions, shape, np.zeros(len(time)))
    settled = term.columns[time > 15.0, 0]
    # The start's slope is that of its first five rows, 0.01 s late: 2e-2 of 5 s of acceleration, a thousandth here.
    np.testing.assert_allclose(settled, acceleration / RATIO / W**2 / ARCMIN, rtol=1e-2)


def test_a_steady_speed_does_not_swing():
    time = np.arange(0, 5, 5e-3)
    conditions = conditions_of(time, 20.0 * time, np.full(len(time), 20.0))
    shape = {"frequency_hz": FREQUENCY, "damping_ratio": DAMPING, "foot": Foot.WHOLE_MOTION}
    columns = EFFECTS["resonance"].term(conditions, shape, np.zeros(len(time))).columns
    np.testing.assert_allclose(columns[:, 0], 0.0, atol=1e-9)
    drag = 2 * DAMPING / W * 20.0 / RATIO / ARCMIN
    np.testing.assert_allclose(columns[:, 1], drag, rtol=1e-9)


@pytest.mark.parametrize("damping", [0.02, 0.3])
def test_a_foot_that_sets_off_leaves_a_swing_at_the_damped_frequency(damping):
    """The oscillator's step response, to rounding: would catch a swing that damping does not slow."""
    time = np.arange(0, 2, 5e-3)
    conditions = conditions_of(time, 20.0 * time, np.full(len(time), 20.0))
    rate = 3.0
    found = relative_responses(conditions, (rate * time)[:, None], FREQUENCY, damping, np.eye(2))[:, 0]
    free, decay = W * math.sqrt(1 - damping**2), np.exp(-damping * W * time)
    sine, cosine = decay * np.sin(free * time), decay * np.cos(free * time)
    np.testing.assert_allclose(found[:, 0], -rate / free * sine, atol=1e-10)
    np.testing.assert_allclose(
        found[:, 1], -2 * damping * rate / W * (1 - cosine - damping * W / free * sine), atol=1e-10
    )
