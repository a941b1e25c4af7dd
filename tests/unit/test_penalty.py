"""What a set of terms pays: an encoder's cycles, sets of which one is in the other, terms that must win clearly."""

import numpy as np
import pytest

from hdopt.diagnosis.search.penalty import Scale, SubtractedTerms, is_cycle_of, penalty
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects.declared import Shaft
from hdopt.effects.met import Spline, Waves
from hdopt.effects.term import Term

COSTS = DEFAULT.penalty


def encoder(lines, shaft=Shaft.INPUT):
    return Term("encoder_interpolation", {"lines": lines, "shaft": shaft}, columns=np.zeros((4, 2)))


def term(effect, **more):
    return Term(effect, {}, columns=np.zeros((4, 2)), **more)


def paid(terms, gain=0.0, beside=()):
    return penalty(terms, gain, Scale(100.0, subtracted=SubtractedTerms(tuple(beside))))


def test_the_first_cycle_of_an_encoder_that_was_found_costs_no_effect_again():
    assert is_cycle_of(encoder(16), [encoder(32)])
    assert not is_cycle_of(encoder(16), [encoder(33)])
    assert not is_cycle_of(encoder(16), [encoder(32, Shaft.OUTPUT)])
    assert not is_cycle_of(term("circular_spline_lobing"), [encoder(32)])
    assert paid([encoder(16)], beside=[encoder(32)]) < paid([encoder(16)], beside=[encoder(33)])


def test_two_of_which_one_is_in_the_other_pay_for_it():
    pair = [term("cs_tooth_harmonics"), term("circular_spline_lobing")]
    other = [term("cs_tooth_harmonics"), term("fs_tooth_harmonics")]
    assert paid(pair) - paid(other) == pytest.approx(COSTS.one_in_the_other)


def test_waves_of_both_splines_teeth_pay_once_for_bending():
    """Teeth of both splines with an error each: the second's waves pay for what they could make of the first's misfit,
    and not for being waves as well. A stiff term beside them is charged as alike, and so is another that bends.
    """

    def teeth(effect, spline, count=COSTS.many_coefficients // 2):
        return Term(effect, {}, met=Waves(spline, tuple(range(2, 2 + count))))

    circular = teeth("cs_tooth_harmonics", Spline.CIRCULAR)
    flexspline = teeth("fs_tooth_harmonics", Spline.FLEX)
    mesh = Term("tooth_mesh", {}, columns=np.zeros((4, COSTS.many_coefficients)))
    for pair, inexact in [
        ([circular], 1),
        ([circular, flexspline], 2),
        ([circular, teeth("fs_tooth_harmonics", Spline.FLEX, 2)], 2),
        ([circular, flexspline, term("bearing_pass")], 3),
        ([circular, mesh], 3),
    ]:
        own = sum(one.width * np.log(100.0) / 2 + COSTS.effect_cost for one in pair)
        assert paid(pair, gain=1e4) == pytest.approx(own + inexact * COSTS.discrepancy * 1e4 / 2)


def test_a_doubtful_term_must_win_clearly():
    plain, doubtful = term("hysteresis"), term("hysteresis", doubtful=True)
    assert paid([doubtful], gain=1000.0) - paid([plain], gain=1000.0) == pytest.approx(0.5 * COSTS.clear_win * 1000.0)


def test_what_was_taken_out_to_the_last_digit_leaves_little_to_name():
    """Lines that were counted reach no other order; a pulse's shape may be wrong, by a part of its power."""
    own = paid([term("encoder_input_eccentricity")], gain=100.0)
    after_lines = Scale(100.0, subtracted=SubtractedTerms((encoder(320),), 1e6))
    after_pulse = Scale(100.0, subtracted=SubtractedTerms((term("local_tooth_defect"),), 1e6))
    lines = penalty([term("encoder_input_eccentricity")], 100.0, after_lines)
    pulse = penalty([term("encoder_input_eccentricity")], 100.0, after_pulse)
    assert lines == pytest.approx(own + 0.5 * COSTS.other_kind * 1e6)
    assert pulse == pytest.approx(own + 0.5 * COSTS.discrepancy * (1e6 + 100.0))
