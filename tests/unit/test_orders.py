"""Order amplitudes by least squares, and what a record is too short to separate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hdopt
from hdopt.errors import HdoptError
from hdopt.recordings.orders import error_growth, inseparable_groups, model_orders, order_spectrum

ORDERS = [
    order.order
    for order in model_orders(80)
    if order.symbol not in ("2/N", "1-1/N", "2-1/N", "3+1/N", "4(1+1/2N)", "5+1/N")
]


def turns(n, per_turn=100):
    return np.arange(n * per_turn) * 2 * np.pi / per_turn


@given(
    amplitudes=st.lists(st.floats(0.01, 1), min_size=3, max_size=3),
    phases=st.lists(st.floats(-3, 3), min_size=3, max_size=3),
)
def test_known_sinusoids_are_found_at_exact_orders(amplitudes, phases):
    theta, orders = turns(80), (1 / 80, 2.0, 2.025)
    signal = 0.3 + sum(a * np.cos(o * theta - p) for a, p, o in zip(amplitudes, phases, orders, strict=True))
    found = order_spectrum(theta, signal, orders)
    assert found.amplitudes == pytest.approx(amplitudes)
    assert found.phases == pytest.approx(phases)
    assert found.mean == pytest.approx(0.3)
    assert found.residual_rms < 1e-9


@pytest.mark.parametrize("structure", ["integral", "automatic", "one_way_major", "one_way_minor"])
def test_no_order_of_a_hundredth_of_the_whole_is_left_out(structure):
    """All multiples of 1/N over a whole relative turn, where they are orthogonal: what `ke` does not list of the base
    case is below a hundredth of the peak-to-peak. Fault caught: a harmonic of the beat left out (2/N: 0.015 arcmin).
    """
    found = hdopt.kinematic_error(hdopt.load_study("csf-25-80", [f"wave_generator.structure={structure}"]))
    turns = round((found.theta[1] - found.theta[0]) * len(found.theta) / (2 * np.pi))
    assert turns == 80
    amplitudes = 2 * np.abs(np.fft.rfft(found.waveform_arcmin)) / len(found.theta)
    listed = [round(order["order"] * turns) for order in found.orders]
    unlisted = np.delete(amplitudes, [0, *listed])
    assert unlisted.max() < 0.01 * found.peak_to_peak_arcmin


def test_one_output_turn_separates_what_shorter_records_confound():
    trio = (2.0, 2.0125, 2.025)
    assert error_growth(turns(80), trio) == pytest.approx(np.ones(3))
    assert error_growth(turns(20), trio).max() == pytest.approx(10.3, abs=0.1)
    assert error_growth(turns(10), trio).max() == pytest.approx(43.3, abs=0.2)
    assert inseparable_groups(turns(80), ORDERS) == ()
    assert inseparable_groups(turns(20), ORDERS) == (trio,)
    assert (2.0, 2.0125, 2.025) in inseparable_groups(turns(10), ORDERS)


def test_error_growth_is_the_standard_error_met_in_simulation():
    theta, trio, rng = turns(20), (2.0, 2.0125, 2.025), np.random.default_rng(0)
    found = [order_spectrum(theta, rng.normal(size=theta.size), trio) for _ in range(200)]
    cosines = np.array([f.amplitudes * np.cos(f.phases) for f in found]).std(axis=0)
    alone = np.sqrt(2 / theta.size)
    # A standard deviation of 200 draws is known to 5 %; growth is the larger of cosine and sine.
    assert (cosines < 1.2 * alone * error_growth(theta, trio)).all()
    assert cosines.max() > 0.5 * alone * error_growth(theta, trio).max()


@pytest.mark.parametrize(
    ("theta", "orders", "message"),
    [
        (turns(1, 10), ORDERS, "10 samples cannot carry 10 orders; at least 22 are needed"),
        (turns(1) / 1e6, (2.0, 2.025), "cannot tell these orders apart: 2, 2.025; leave some out"),
        (turns(1), (2.0, 2.0), "all different"),
        (turns(1), (0.0,), "above 0"),
    ],
)
def test_records_that_cannot_carry_the_orders_are_refused(theta, orders, message):
    with pytest.raises(HdoptError, match=message):
        order_spectrum(theta, np.zeros_like(theta), orders)


def test_angles_and_signal_must_match():
    with pytest.raises(HdoptError, match=r"angles have shape \(100,\), the signal \(99,\)"):
        order_spectrum(turns(1), np.zeros(99), (1.0,))


def test_what_the_orders_leave_is_an_rms():
    """A sine of 0.3 beside the order that is fitted: 0.3/sqrt 2 over ten whole turns."""
    theta = np.arange(3600) * 2 * np.pi / 360
    found = order_spectrum(theta, 0.5 * np.cos(2 * theta) + 0.3 * np.sin(5 * theta) + 1.0, [2.0])
    assert found.residual_rms == pytest.approx(0.3 / np.sqrt(2))
    assert found.mean == pytest.approx(1.0)


def test_neighbours_lie_within_a_cycle_of_the_record():
    """Twenty turns tell 2 and 2.06, more than a cycle apart, and not 2 and 2.005. Nine orders of six tenths of a cycle
    each hang together: what they do to each other grows with their number."""
    theta = np.arange(20 * 100) * 2 * np.pi / 100
    assert inseparable_groups(theta, [2.06, 2.0]) == ()
    assert inseparable_groups(theta, [2.0, 2.005]) == ((2.0, 2.005),)
    many = [2.0 + 0.03 * k for k in range(9)]
    assert error_growth(theta, many).max() > 3
    assert inseparable_groups(theta, many) == (tuple(many),)
