"""The scorer on made-up answers, against results worked out by hand."""

import hashlib
import json

import pytest
from scipy.stats import binom

from hdopt.bench import thresholds
from hdopt.bench.marking import check_answer, covered, credit, improvement
from hdopt.bench.score import main, read, score
from hdopt.bench.scores import Rate


def key(name="k", family="single", effects=("resonance",), severity=0.5, **more):
    return {
        "id": name,
        "family": family,
        "effects": list(effects),
        "severity": severity,
        "outside": "",
        "trouble": "",
        "variants": ["v"],
        "noise_rms_arcmin": 0.03,
        "unexplained_rms_arcmin": 0.04,
        "detectable": bool(effects),
        "separable": True,
        "rivals": [],
        "parameters": {},
    } | more


def said(verdict, *effects, others=(), confidence=0.9, fit=None, parameters=None):
    return {
        "schema": 1,
        "verdict": verdict,
        "effects": [{"id": e, "confidence": confidence, "parameters": parameters or {}} for e in effects],
        "ambiguous_with": [list(other) for other in others],
        "fit": fit or {},
    }


def test_clopper_pearson_bound_solves_its_own_equation():
    rate = Rate(8, 300)
    # The bound is the rate at which seeing 8 or fewer has a probability of 5 %.
    assert binom.cdf(8, 300, rate.upper_bound) == pytest.approx(0.05, abs=1e-9)
    assert Rate(0, 300).upper_bound == pytest.approx(1 - 0.05 ** (1 / 300))  # closed form for none
    assert Rate(8, 300).upper_bound < 0.05 < Rate(10, 300).upper_bound
    assert Rate(5, 5).upper_bound == 1.0 and Rate(0, 5).interval[0] == 0.0
    low, high = rate.interval
    assert binom.sf(7, 300, low) == pytest.approx(0.025, abs=1e-9)
    assert binom.cdf(8, 300, high) == pytest.approx(0.025, abs=1e-9)


@pytest.mark.parametrize(
    ("answer", "truth", "points"),
    [
        (said("named", "resonance"), key(), 1.0),
        (said("named", "resonance", "hysteresis"), key(), 0.0),
        (said("named", "hysteresis"), key(), 0.0),
        (said("adequate"), key(), 0.0),
        (said("unknown"), key(), 0.0),
        (said("ambiguous", "hysteresis", others=[["resonance"]]), key(separable=False), 0.5),
        (said("ambiguous", "resonance", others=[["hysteresis"], ["lost_motion"]]), key(separable=False), 1 / 3),
        (said("ambiguous", "resonance", others=[["hysteresis"]]), key(separable=True), 0.0),
        (said("ambiguous", "resonance", others=[["resonance"]]), key(separable=True), 1.0),
        (said("ambiguous", "lost_motion", others=[["hysteresis"]]), key(separable=False), 0.0),
        (said("named", "hysteresis", "resonance"), key(effects=("resonance", "hysteresis")), 1.0),
        (said("named", "resonance"), key(effects=("resonance", "hysteresis")), 0.0),
        (said("adequate"), key(family="nothing", effects=()), 1.0),
        (said("insufficient"), key(family="nothing", effects=()), 1.0),
        (said("unknown"), key(family="nothing", effects=()), 0.0),
        (said("unknown"), key(family="unknown", effects=(), outside="mains"), 1.0),
        (said("adequate"), key(family="unknown", effects=(), outside="mains"), 0.0),
        (said("named", "resonance"), key(family="unknown", effects=(), outside="mains"), 0.0),
        (said("adequate"), key(family="decoy", detectable=False), 1.0),
        (said("named", "resonance"), key(family="decoy", detectable=False), 1.0),
        (said("named", "hysteresis"), key(family="decoy", detectable=False), 0.0),
        (said("unknown"), key(family="decoy", detectable=False), 0.0),
        (said("adequate"), key(family="decoy", detectable=True), 0.0),
    ],
)
def test_credit(answer, truth, points):
    assert check_answer(answer) == ""
    got, reason = credit(answer, truth)
    assert got == pytest.approx(points)
    assert bool(reason) == (points < 1)


@pytest.mark.parametrize(
    ("answer", "problem"),
    [
        (None, "no answer"),
        ({}, "schema is not 1"),
        (said("perhaps"), "verdict 'perhaps' is none of adequate"),
        (said("named"), "named, but no effect given"),
        (said("ambiguous", "resonance"), "no other explanation"),
        (said("named", "gremlins"), "no such effect: 'gremlins'"),
        (said("named", "resonance", confidence=97), "confidence of resonance is 97"),
    ],
)
def test_answers_outside_the_contract_are_told_apart(answer, problem):
    assert problem in check_answer(answer)


def test_improvement_is_the_oracles_share_by_hand():
    # Oracle: base sqrt(0.04^2 + 0.03^2) = 0.05, extended 0.03: a gain of 40 %.
    def gain(base, extended):
        fit = {"heldout_rms_base_arcmin": base, "heldout_rms_extended_arcmin": extended}
        return improvement(said("named", "resonance", fit=fit), key())

    assert gain(0.05, 0.03) == (pytest.approx(1.0), False)
    assert gain(0.05, 0.04) == (pytest.approx(0.5), False)  # 20 % of 40 %, and 0.01 of 0.02
    assert gain(0.10, 0.04) == (pytest.approx(0.5), False)  # a bad base to mend earns nothing
    assert gain(0.04, 0.03) == (pytest.approx(0.625), False)  # 25 % of 40 %
    assert gain(0.05, 0.05) == (pytest.approx(0.0), False)
    assert gain(0.05, 0.02) == (1.0, True)  # below 0.8 of the noise: not to be believed
    assert improvement(said("adequate"), key()) == (0.0, False)


@pytest.mark.parametrize(
    ("name", "low", "high", "truth", "inside"),
    [
        ("stiffness_1", 29800, 32300, 31000, True),
        ("stiffness_1", 29800, 30900, 31000, False),
        ("delay_s", -0.0012, -0.0008, 0.001, True),
        ("delay_s", -0.0012, -0.0008, 0.002, False),
        ("angle_deg", 355, 365, 2, True),
        ("angle_deg", -5, 5, 358, True),
        ("angle_deg", -5, 5, 10, False),
        ("coefficient_arcmin_per_k", 0.01, 0.02, -0.015, False),
    ],
)
def test_intervals(name, low, high, truth, inside):
    assert covered({"low": low, "high": high}, name, {"value": truth}) is inside


def test_a_small_proof_by_hand():
    stiffness = {"value": 31000.0, "unit": "Nm/rad", "identifiable": True}
    knee = {"value": 14.0, "unit": "Nm", "identifiable": False}
    windup = {"torsional_windup": {"stiffness_1": stiffness, "knee_1": knee}}
    keys = [
        *[key(f"n{i}", "nothing", (), 0.0) for i in range(4)],
        key("s1", effects=("torsional_windup",), severity=0.1, parameters=windup),
        key("s2", effects=("torsional_windup",), severity=0.5, parameters=windup),
        key("s3", severity=1.0, separable=False, rivals=["hysteresis"]),
        key("p1", "pair", ("hysteresis", "resonance"), 1.0),
        key("u1", "unknown", (), 0.5, outside="mains", detectable=True),
        key("u2", "unknown", (), 0.5, outside="hub slip", detectable=True),
        key("d1", "decoy", (), 0.0, trouble="gaps"),
    ]
    good = {"heldout_rms_base_arcmin": 0.05, "heldout_rms_extended_arcmin": 0.03}
    hits = {"stiffness_1": {"value": 1, "low": 30000, "high": 32000}, "knee_1": {"value": 1, "low": 0, "high": 1}}
    misses = {"stiffness_1": {"value": 1, "low": 10000, "high": 20000}}
    answers = {
        "n0": said("adequate"),
        "n1": said("insufficient"),
        "n2": said("named", "hysteresis", confidence=0.6),
        # n3 has no answer: it counts as a false alarm
        "s1": said("named", "torsional_windup", confidence=0.97, parameters=misses),
        "s2": said("named", "torsional_windup", confidence=0.97, parameters=hits, fit=good),
        "s3": said("ambiguous", "hysteresis", others=[["resonance"]], confidence=0.6),
        "p1": said("named", "hysteresis", "resonance", confidence=0.97, fit=good),
        "u1": said("unknown"),
        "u2": said("named", "resonance", confidence=0.55),
        "d1": said("adequate"),
    }
    scores = score(answers, keys)
    assert (scores.false_alarms.hits, scores.false_alarms.n) == (2, 4)
    assert scores.insufficient.hits == 1
    assert (scores.decoy_false_alarms.hits, scores.decoy_false_alarms.n) == (0, 1)
    assert scores.exact == {0.1: (1.0, 1), 0.5: (1.0, 1), 1.0: (0.75, 2)}
    assert scores.exact_gate == (pytest.approx(2.5 / 3), 3)
    assert scores.exact_ceiling == pytest.approx(2.5 / 3)  # s3 can honestly have no more than a half
    assert scores.exact_by_effect["resonance"] == (0.75, 2)
    assert (scores.unknown_recall.hits, scores.unknown_named.hits, scores.unknown_named.n) == (1, 1, 2)
    assert scores.improvement == (pytest.approx(0.5), 4)  # 0, 1, 0, 1
    assert (scores.coverage.hits, scores.coverage.n) == (1, 2)  # the knee is beyond the test
    # 0.5-0.7: 0.6, 0.6, 0.55, none right (0.6 is wrong for s3: its first effect is not there); 0.95-0.99: four right.
    assert [(b.right.hits, b.right.n) for b in scores.reliability] == [(0, 3), (4, 4)]
    assert scores.calibration_error == pytest.approx((3 * 1.75 / 3 + 4 * 0.03) / 7)
    assert {case.id for case in scores.failed} == {"n2", "n3", "s3", "u2"}
    assert scores.invalid == ("n3: no answer",)
    assert not scores.passed
    gate = scores.to_frame()
    assert list(gate.index[gate["passed"]]) == []
    text = scores.summary()
    for name in ("n2", "u2", "false alarm", "named what is outside the catalogue", "no answer"):
        assert name in text


def test_the_gate_can_be_passed_and_every_criterion_can_fail():
    kinds = [f"kind {i}" for i in range(thresholds.UNKNOWN_KINDS)]
    keys = [key(f"n{i}", "nothing", (), 0.0) for i in range(thresholds.NOTHING_CASES)]
    keys += [key(f"s{i}", severity=s) for i, s in enumerate(thresholds.SEVERITIES * 5)]
    keys += [key(f"u{i}", "unknown", (), 0.5, outside=kinds[i % len(kinds)]) for i in range(thresholds.UNKNOWN_CASES)]
    good = {"heldout_rms_base_arcmin": 0.05, "heldout_rms_extended_arcmin": 0.03}
    right = {"nothing": said("adequate"), "unknown": said("unknown")}
    right["single"] = said("named", "resonance", confidence=0.99, fit=good)
    answers = {k["id"]: right[k["family"]] for k in keys}
    assert score(answers, keys).passed

    def fails(changed, kept=keys):
        gate = score(answers | changed, kept).to_frame()
        return set(gate.index[~gate["passed"]])

    assert fails({f"n{i}": said("unknown") for i in range(12)}) == {"false-alarm rate, upper bound"}
    assert "unknown physics named" in fails({f"u{i}": said("named", "resonance", confidence=0.99) for i in range(5)})
    missed = {f"s{i}": said("adequate", fit=good) for i in range(20)}
    assert any(name.startswith("exact set") for name in fails(missed))
    poor = {"heldout_rms_base_arcmin": 0.05, "heldout_rms_extended_arcmin": 0.045}
    weak = {f"s{i}": said("named", "resonance", confidence=0.99, fit=poor) for i in range(20)}
    assert fails(weak) == {"median held-out improvement over the oracle's"}
    shy = {f"s{i}": said("named", "resonance", confidence=0.6, fit=good) for i in range(20)}
    assert fails(shy) == {"calibration error of confidences"}
    assert "enough cases" in fails({}, keys[1:])


def test_keys_that_were_changed_after_sealing_are_refused(tmp_path, capsys):
    text = json.dumps({"schema": 1, "seed": 0, "keys": [key("case-0001", "nothing", (), 0.0)]})
    (tmp_path / "sealed").mkdir()
    (tmp_path / "answers").mkdir()
    (tmp_path / "sealed" / "keys.json").write_text(text)
    (tmp_path / "keys.sha256").write_text(hashlib.sha256(text.encode()).hexdigest() + "\n")
    (tmp_path / "answers" / "case-0001.json").write_text(json.dumps(said("adequate")))
    answers, keys = read(tmp_path)
    assert score(answers, keys).false_alarms.hits == 0
    assert main(["--dir", str(tmp_path)]) == 1  # one case is no proof
    assert "enough cases" in capsys.readouterr().out
    (tmp_path / "sealed" / "keys.json").write_text(text.replace("nothing", "unknown"))
    with pytest.raises(ValueError, match="is not what was sealed"):
        read(tmp_path)
