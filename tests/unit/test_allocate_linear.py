"""Allocation of linear stacks from study files: units, the yield that the rule is for, and the verdict."""

import math
import re
from statistics import NormalDist

import numpy as np
import pytest

from hdopt.allocation.spread import truncated_std
from hdopt.cli import main
from hdopt.errors import HdoptError
from hdopt.study import Study, load_study
from hdopt.workflow import allocate_linear
from hdopt.workflow.allocate import allocate


def stack_of(tmp_path, dimensions, *, gap=0.1, unit="mm", rule="rss", more="", verify_n=2**14) -> Study:
    """A study of a linear stack with a `gap` tolerance, verified by `verify_n` samples."""
    path = tmp_path / "one.toml"
    path.write_text(
        f'[study]\ntitle = "one"\n[linear_stack]\nunit = "{unit}"\ngap_tolerance = {gap}\n{more}\n'
        f"[linear_stack.dimensions]\n{dimensions}\n"
        f'[allocate]\nrule = "{rule}"\ncompare = false\nverify_n = {verify_n}\n',
        encoding="utf-8",
    )
    return load_study(path)


GRADES = (
    'cost = { model = "table", system = "iso286", nominal_mm = 20, '
    'grades = [{ grade = "IT6", cost = 5 }, { grade = "IT8", cost = 2 }] }'
)


def test_grades_of_a_stack_in_micrometres(tmp_path):
    """By hand, 40 um in all: IT6 (13 um, cost 5) leaves b 27 um at 100/27, 8.70 in all; IT8 (33 um, cost 2) leaves 7 um
    at 100/7, 16.29. Fault caught: IT8 taken as 0.033 um, which leaves b nearly everything."""
    b = 'b = { tolerance = 20, cost = { model = "power", b = 100, k = 1 } }'
    found = allocate(
        stack_of(tmp_path, f"a = {{ tolerance = 21, {GRADES} }}\n{b}", gap=40, unit="um", rule="worst_case")
    )
    assert found.errors["a"].grade == "IT6"
    assert found.errors["a"].tolerance == pytest.approx(13, rel=1e-9)
    assert found.errors["b"].tolerance == pytest.approx(27, rel=1e-6)
    assert found.total_cost == pytest.approx(5 + 100 / 27, rel=1e-6)


def test_grades_of_a_stack_in_no_unit_of_length(tmp_path):
    """Fault caught: grades in mm taken for a unit that nobody can convert; and a message that does not name the
    dimension."""
    with pytest.raises(HdoptError, match=r"cost of a: .* this tolerance is in 'furlong', which is no length"):
        allocate(stack_of(tmp_path, f"a = {{ tolerance = 21, {GRADES} }}", gap=40, unit="furlong"))


def by_root_sum_square(tmp_path, sigmas, required):
    """Two alike dimensions of cost 1/t under a gap of 0.1, so that both get the same tolerance."""
    cost = 'cost = { model = "reciprocal", b = 1 }'
    rows = "\n".join(f"{name} = {{ tolerance = 0.03, sigmas = {sigmas}, {cost} }}" for name in "ab")
    return allocate(stack_of(tmp_path, rows, more=f"required_yield = {required}", verify_n=2**20))


@pytest.mark.parametrize(
    ("sigmas", "required", "quantile"), [(3.0, 0.9973, 3.0), (1.0, 0.9973, 3.0), (3.0, 0.99999, 4.417173)]
)
def test_root_sum_square_holds_for_the_yield_asked_for(tmp_path, sigmas, required, quantile):
    """sqrt(2) (z/sigmas) t = 0.1 with the two-sided normal quantile z (0.99999: 4.417173, from tables); 3 sigma and
    0.9973 are the classical rule. Fault caught: t alone in the sum, whatever the yield and the sigmas, which left
    99.8 % where 99.999 % were asked for.
    """
    found = by_root_sum_square(tmp_path, sigmas, required)
    assert found.errors["a"].tolerance == pytest.approx(0.1 / math.sqrt(2) * sigmas / quantile, rel=2e-6)
    assert found.status == "optimal"
    assert found.verified_yield.value >= required


@pytest.mark.parametrize("required", [0.9, 0.9973])
def test_root_sum_square_leaves_room_for_the_verification(tmp_path, required):
    """Six sigma within the tolerances: nothing is truncated, and the yield of z itself is that asked for, so that every
    other verification fell short. By hand: z is that of the yield plus 3 sqrt(y (1 - y)/2^20). Fault caught: no room.
    """
    found = by_root_sum_square(tmp_path, 6.0, required)
    quantile = NormalDist().inv_cdf((1 + required + 3 * math.sqrt(required * (1 - required)) / 1024) / 2)
    assert found.errors["a"].tolerance == pytest.approx(0.1 / math.sqrt(2) * 6 / quantile, rel=1e-6)
    assert found.status == "optimal"


def test_the_spread_of_a_truncated_normal_dimension():
    """1 - 2 c phi(c)/(2 Phi(c) - 1): 0.539560 for c = 1 (0.291125 its square), next to 1 for 6. Fault caught: a
    truncation that is left out or taken twice."""
    density = math.exp(-0.5) / math.sqrt(2 * math.pi)
    by_hand = math.sqrt(1 - 2 * density / (2 * NormalDist().cdf(1) - 1))
    assert truncated_std(np.array([1.0, 6.0])) == pytest.approx([by_hand, 1.0], rel=1e-6)


def test_a_rule_that_misses_the_yield_is_no_optimum(tmp_path, monkeypatch, capsys):
    """A rule that counts half of every spread: one and a half standard deviations keep the gap, 87 % or so. Fault
    caught: "optimal" and exit status 0 above a line that says that the requirement is missed."""
    monkeypatch.setattr(allocate_linear, "spread_factors", lambda sigmas, required_yield: np.full(len(sigmas), 0.5))
    by_root_sum_square(tmp_path, 3.0, 0.9973)
    with pytest.raises(SystemExit, match="^1$"):
        main(["allocate", str(tmp_path / "one.toml")])
    said = capsys.readouterr().out
    assert "not verified" in said and "optimal:" not in said and ": optimal" not in said
    assert "note: the rss rule's tolerances do not reach the yield: its lower bound is 0.8" in said
    assert "requirement missed" in said


def test_a_rule_that_cannot_be_met_stands_beside_the_one_that_can(tmp_path):
    """Held parts of 0.06 each: 0.12 in the worst case, more than 0.1, and 0.0849 by root sum square. Fault caught: no
    answer at all where the rule beside the one asked for has none."""
    rows = 'a = { tolerance = 0.03, cost = { model = "reciprocal", b = 1 } }\n'
    study = stack_of(tmp_path, rows + "b = { tolerance = 0.06 }\nc = { tolerance = 0.06 }")
    found = allocate(study, compare=True)
    outcomes = {outcome.rule: outcome for outcome in found.comparison}
    assert found.errors["a"].tolerance == pytest.approx(math.sqrt(0.1**2 - 2 * 0.06**2), rel=1e-6)
    assert outcomes["worst_case"].note.startswith(
        "infeasible: the requirement 0.1 cannot be met by the worst case rule"
    )
    assert outcomes["worst_case"].modelled == pytest.approx(0.12)


def test_a_yield_that_takes_many_samples_is_compared_with_as_many(tmp_path):
    """0.99999 takes 368,887 samples for its interval. Fault caught: the rules beside each other by 262,144 whatever the
    yield, which was refused, and with it the answer."""
    rows = 'a = { tolerance = 0.03, cost = { model = "reciprocal", b = 1 } }'
    study = stack_of(tmp_path, rows, more="required_yield = 0.99999", verify_n=2**19)
    assert [outcome.rule for outcome in allocate(study, compare=True).comparison] == ["present", "worst_case", "rss"]


POINTS = 'cost = { model = "piecewise", points = [[0.01, 10], [0.03, 4]] }'
TABLE = 'cost = { model = "table", grades = [{ grade = "A", tolerance = 0.01, cost = 10 }] }'


def test_what_is_finer_than_the_cost_data_has_an_unknown_cost_and_a_yield(tmp_path, capsys):
    """Present tolerances of 2 um where points and grades begin at 10. Fault caught: the first point's cost for the one,
    nan for the other; and no yield of the present tolerances on the screen because their cost is unknown."""
    study = stack_of(tmp_path, f"a = {{ tolerance = 0.002, {POINTS} }}\nb = {{ tolerance = 0.002, {TABLE} }}")
    found = allocate(study, compare=True)
    present = found.comparison[0]
    assert [math.isnan(found.errors[name].present_cost) for name in "ab"] == [True, True]
    assert (present.conforming.value, present.note) == (1.0, "cost unknown: a, b finer than the cost data")
    assert "present cost unknown: a, b finer than the cost data" in found.notes
    assert {outcome.note for outcome in found.comparison[1:]} == {""}
    with pytest.raises(SystemExit, match="^0$"):
        main(["allocate", str(tmp_path / "one.toml"), "--compare"])
    said = capsys.readouterr().out
    assert re.search(r"^  present +cost +unknown  yield 1\.00000 .* cost unknown: a, b finer", said, re.MULTILINE)
    assert "nan" not in said


def test_present_tolerances_far_finer_than_the_cost_data(tmp_path):
    """A thousandth of the points' first, beside a grade. By hand: a may be 0.1 - 0.01 = 0.09, more than its last point:
    4 + 10. Fault caught: a first guess at the cost outside its data, where it is unknown, which no solver takes."""
    study = stack_of(
        tmp_path, f"a = {{ tolerance = 1e-5, {POINTS} }}\nb = {{ tolerance = 1e-5, {TABLE} }}", rule="worst_case"
    )
    assert allocate(study).total_cost == pytest.approx(14.0, rel=1e-6)
