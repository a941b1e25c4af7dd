"""What a set of terms pays: an encoder's cycles, sets of which one is in the other, terms that must win clearly."""

import numpy as np
import pytest

from hdopt.diagnosis.effect import Term
from hdopt.diagnosis.price import CLEAR_WIN, DISCREPANCY, OTHER_KIND, TWICE, Beside, is_cycle_of, price


def encoder(lines, output=0.0):
    return Term("encoder_interpolation", {"lines": float(lines), "output": output}, columns=np.zeros((4, 2)))


def term(effect, **more):
    return Term(effect, {}, columns=np.zeros((4, 2)), **more)


def paid(terms, gain=0.0, beside=()):
    return price(terms, 100.0, gain, 1.0, Beside(tuple(beside)))


def test_the_first_cycle_of_an_encoder_that_was_found_costs_no_effect_again():
    assert is_cycle_of(encoder(16), [encoder(32)])
    assert not is_cycle_of(encoder(16), [encoder(33)])
    assert not is_cycle_of(encoder(16), [encoder(32, output=1.0)])
    assert not is_cycle_of(term("circular_spline_lobing"), [encoder(32)])
    assert paid([encoder(16)], beside=[encoder(32)]) < paid([encoder(16)], beside=[encoder(33)])


def test_two_of_which_one_is_in_the_other_pay_for_it():
    pair = [term("cs_tooth_harmonics"), term("circular_spline_lobing")]
    other = [term("cs_tooth_harmonics"), term("fs_tooth_harmonics")]
    assert paid(pair) - paid(other) == pytest.approx(TWICE)


def test_a_doubtful_term_must_win_clearly():
    plain, doubtful = term("hysteresis"), term("hysteresis", doubtful=True)
    assert paid([doubtful], gain=1000.0) - paid([plain], gain=1000.0) == pytest.approx(0.5 * CLEAR_WIN * 1000.0)


def test_what_was_taken_out_to_the_last_digit_leaves_little_to_name():
    """Lines that were counted reach no other order; a pulse's shape may be wrong, by a part of its power."""
    own = paid([term("encoder_input_eccentricity")], gain=100.0)
    lines = price([term("encoder_input_eccentricity")], 100.0, 100.0, 1.0, Beside((encoder(320),), 1e6))
    pulse = price([term("encoder_input_eccentricity")], 100.0, 100.0, 1.0, Beside((term("local_tooth_defect"),), 1e6))
    assert lines == pytest.approx(own + 0.5 * OTHER_KIND * 1e6)
    assert pulse == pytest.approx(own + 0.5 * DISCREPANCY * (1e6 + 100.0))
