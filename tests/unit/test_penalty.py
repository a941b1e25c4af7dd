"""What a set of terms pays: an encoder's cycles, sets of which one is in the other, terms that must win clearly."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.inference.base_fit import is_far
from hdopt.diagnosis.search.candidates import weigh
from hdopt.diagnosis.search.penalty import Scale, SubtractedTerms, discrepancy, is_cycle_of, penalty
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
    mesh, bearing = (
        Term(effect, {}, columns=np.zeros((4, COSTS.many_coefficients))) for effect in ("tooth_mesh", "bearing_pass")
    )
    for pair, inexact in [
        ([circular], 1),
        ([circular, flexspline], 2),
        ([circular, teeth("fs_tooth_harmonics", Spline.FLEX, 2)], 2),
        ([circular, flexspline, term("bearing_pass")], 3),
        ([circular, bearing], 3),
        ([circular, mesh], 2 + COSTS.other_kind / COSTS.discrepancy),
    ]:
        own = sum(one.width * np.log(100.0) / 2 + COSTS.effect_cost for one in pair)
        assert paid(pair, gain=1e4) == pytest.approx(own + inexact * COSTS.discrepancy * 1e4 / 2)


def test_sines_that_leave_nothing_pay_as_such_beside_any_other_kind():
    """Beside friction or wind-up two encoders off-centre are two sines still, and so is one beside lines that were
    counted; beside a pulse, whose shape is inexact and lives where sines do, they are not. Would catch an encoder that
    is given up for a drive which its tolerances exclude (3 % of the explained power)."""
    loop, sine, other = (term(name) for name in ("hysteresis", "encoder_input_eccentricity", "output_coupling"))
    pulse, nothing = term("local_tooth_defect"), term("_sine_in_time")
    for terms, share in [
        ([sine, other], COSTS.other_kind),
        ([loop, sine, other], 2 * COSTS.other_kind),
        ([encoder(64), sine], COSTS.other_kind),
        ([pulse, sine, other], 2 * COSTS.discrepancy),
        ([loop, term("lost_motion"), sine, other], COSTS.discrepancy + 2 * COSTS.other_kind),
        ([nothing], 0.0),
        ([loop, sine, nothing], COSTS.other_kind + COSTS.discrepancy),
    ]:
        assert discrepancy(terms) == pytest.approx(share)


def test_a_ripple_among_the_rows_is_of_another_kind_than_what_turns():
    """The misfit of a mesh in rows that hold its waves lies at its own orders, far above a bearing's; one that was
    taken out has left what it does to the zones, which is alike. An encoder's lines leave nothing, and are as all
    sines. Faults caught: a mesh that hides a bearing behind 8 % of its own power, one that was taken out and hides
    nothing."""
    mesh, bearing = term("tooth_mesh"), term("bearing_pass")
    assert discrepancy([mesh, bearing]) == pytest.approx(COSTS.other_kind)
    assert discrepancy([mesh, term("hysteresis"), bearing]) == pytest.approx(2 * COSTS.other_kind)
    assert discrepancy([bearing], subtracted=[mesh]) == pytest.approx(COSTS.discrepancy)
    assert discrepancy([encoder(64), bearing]) == pytest.approx(COSTS.discrepancy)
    assert discrepancy([bearing], subtracted=[term("hysteresis")]) == pytest.approx(COSTS.other_kind)


def test_a_drive_far_outside_its_tolerances_pays_as_an_effect_of_another_kind():
    """It may be given by one error alone; what only comes near costs nothing, and neither does a gear without a base.
    The base alone pays nothing: it is what all is weighed against."""
    model = SimpleNamespace(base="a base", prior=np.array([0.03, 0.02]), settings=DEFAULT)
    model.noise = SimpleNamespace(sigma=0.1)
    scale = Scale(100.0, inflation=2.0)

    def fit(errors, terms=(term("hysteresis"),), problem=model):
        return SimpleNamespace(errors=np.array(errors), terms=terms, problem=problem, objective=30.0)

    near, far = fit([0.041, -0.027]), fit([0.01, -0.029])
    assert list(is_far(near)) == [False, False]
    assert list(is_far(far)) == [False, True]
    assert not is_far(fit([], problem=SimpleNamespace(base=None, settings=DEFAULT))).any()
    base = SimpleNamespace(objective=40.0)
    plain, dear = (weigh(one, base, scale, 5000.0).log_bayes_factor for one in (near, far))
    assert plain - dear == pytest.approx(COSTS.effect_cost + COSTS.other_kind * 5000.0 / 2.0 / 2)
    alone = [weigh(fit(errors, ()), base, scale, 5000.0).log_bayes_factor for errors in ([0.0, 0.0], [0.04, -0.03])]
    assert alone[0] == alone[1]


def test_a_doubtful_term_must_win_clearly():
    plain, doubtful = term("hysteresis"), term("hysteresis", doubtful=True)
    assert paid([doubtful], gain=1000.0) - paid([plain], gain=1000.0) == pytest.approx(0.5 * COSTS.clear_win * 1000.0)


def test_a_term_that_stands_where_another_reaches_must_win_clearly_beside_it():
    """Or taken out of the rows before. Faults caught: doubtful beside anything, or beside none."""
    lines = term("encoder_interpolation", doubtful_beside=("tooth_mesh",))
    mesh, pulse = term("tooth_mesh"), term("local_tooth_defect")

    def doubt(beside, subtracted=()):
        sets = ([lines, *beside], [term("encoder_interpolation"), *beside])
        dear, plain = (paid(terms, gain=1000.0, beside=subtracted) for terms in sets)
        return (dear - plain) / (0.5 * COSTS.clear_win * 1000.0)

    assert [doubt([]), doubt([mesh]), doubt([pulse])] == pytest.approx([0.0, 1.0, 0.0])
    assert doubt([], subtracted=[mesh]) == pytest.approx(1.0)


def test_what_was_taken_out_to_the_last_digit_leaves_little_to_name():
    """Lines that were counted reach no other order; a pulse's shape may be wrong, by a part of its power."""
    own = paid([term("encoder_input_eccentricity")], gain=100.0)
    after_lines = Scale(100.0, subtracted=SubtractedTerms((encoder(320),), 1e6))
    after_pulse = Scale(100.0, subtracted=SubtractedTerms((term("local_tooth_defect"),), 1e6))
    lines = penalty([term("encoder_input_eccentricity")], 100.0, after_lines)
    pulse = penalty([term("encoder_input_eccentricity")], 100.0, after_pulse)
    assert lines == pytest.approx(own + 0.5 * COSTS.other_kind * 1e6)
    assert pulse == pytest.approx(own + 0.5 * COSTS.discrepancy * (1e6 + 100.0))
