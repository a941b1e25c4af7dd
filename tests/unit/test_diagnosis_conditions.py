"""Whole operating conditions left out: which there are, and what a fit of the others says of each."""

from dataclasses import replace

import numpy as np
import pytest

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.inference.conditions import across_conditions, find_conditions, number_levels
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.nuisance import nuisances_for
from hdopt.diagnosis.search.candidates import joint_fit
from hdopt.effects import EFFECTS
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from tests.unit.test_diagnosis import HIDDEN, NOISE, bench


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


def fits(study, records, names, shapes):
    """The base alone, and the base with the effects `names`, on `records`."""
    samples = gather(records)
    base = CartesianModel.of(study.drive)
    problem = FitProblem(samples, base, nuisances_for(samples, base).columns(samples), Noise.white(samples, NOISE))
    errors = to_cartesian(study.errors, base.half_width)
    start = refine(evaluate(problem, errors, np.zeros(problem.nuisance.shape[1]), (), ()))
    terms = [EFFECTS[name].term(samples, shape, start.base_value) for name, shape in zip(names, shapes, strict=True)]
    return start, joint_fit(start, terms) if terms else start


def test_levels_part_at_gaps():
    np.testing.assert_array_equal(number_levels(np.array([3.0, 1.0, 1.05, 2.98, 9.0]), 0.1), [1, 0, 0, 1, 2])
    np.testing.assert_array_equal(number_levels(np.array([5.0]), 0.1), [0])


def test_conditions_are_named_by_what_differs(study):
    """Two records at 1 rad/s and one at 3: two conditions, both directions of a record in one."""
    samples = gather(bench(study, turns=6, speeds=(1.0, 3.0, 1.0)))
    conditions = find_conditions(samples)
    assert conditions.names == ("9.55 r/min", "28.6 r/min")
    np.testing.assert_array_equal(conditions.number, np.array([0, 1, 0])[samples.record])


def test_one_condition_leaves_nothing_to_leave_out(study):
    base, _ = fits(study, bench(study, turns=6), [], [])
    assert across_conditions(base, base) is None


def test_a_delay_predicts_a_speed_it_never_saw(study):
    """Base: the offset of +-a at the speed left out stays. With a delay fitted at the others, no more than seen."""
    records = bench(study, HIDDEN["channel_delay"], turns=20, speeds=(1.0, 2.5, 5.0))
    base, extended = fits(study, records, ["channel_delay"], [{}])
    across = across_conditions(base, extended)
    step = 2e-3 * np.array([1.0, 2.5, 5.0]) / 80 * 10800 / np.pi
    assert list(across.each) == ["9.55 r/min", "23.9 r/min", "47.7 r/min"]
    for record, ((alone, with_delay), size) in enumerate(zip(across.each.values(), step, strict=True)):
        assert alone == pytest.approx(np.hypot(size, NOISE), rel=0.05)
        # One number from 8000 rows: what it costs not to have seen a third of them is far below a percent.
        seen = np.sqrt(np.mean(extended.residual[extended.problem.rows.record == record] ** 2))
        assert with_delay == pytest.approx(seen, rel=0.01)


def test_what_fits_one_condition_alone_is_shown_up(study):
    """Play that grew with speed, fitted as plain play: on turns held out it helps, at a speed left out it fails."""
    records = bench(study, HIDDEN["channel_delay"], turns=20, speeds=(1.0, 9.0))
    base, wrong = fits(study, records, ["lost_motion"], [{"ramp_arcmin": 0.3}])
    across = across_conditions(base, wrong)
    seen = float(np.sqrt(np.mean(wrong.residual**2)))
    assert seen < 0.7 * float(np.sqrt(np.mean(base.residual**2)))
    assert across.extended > 1.3 * seen


def test_a_new_zero_is_taken_from_the_record_itself(study):
    """A recording zeroed anew by 20 arcmin: its own offset is fitted on it, and nothing else."""
    records = bench(study, turns=20, speeds=(1.0, 3.0))
    records[1] = type(records[1])(**{**vars(records[1]), "error_arcmin": records[1].error_arcmin + 20.0})
    base, _ = fits(study, records, [], [])
    assert base.problem.nuisance.shape[1] == 2
    across = across_conditions(base, base)
    assert across.base == across.extended == pytest.approx(NOISE, rel=0.05)


@pytest.mark.slow
def test_the_contract_holds_the_conditions(study):
    records = bench(study, HIDDEN["channel_delay"], turns=8, rate=50, speeds=(1.0, 5.0))
    result = diagnose(records, study.drive).to_dict()
    fit = result["fit"]
    assert fit["heldout_conditions_rms_extended_arcmin"] < 0.2 * fit["heldout_conditions_rms_base_arcmin"]
    assert [each["condition"] for each in result["heldout_conditions"]] == ["9.55 r/min", "47.7 r/min"]


def test_a_torque_sweep_at_a_locked_input_is_one_condition(study):
    """The loading branch lies at other torques than the unloading one; both are one sweep."""
    samples = gather(bench(study, turns=6))
    torque = np.where(samples.direction > 0, 10.0, -10.0)
    turning = replace(samples, torque=torque)
    assert len(find_conditions(turning)) == 2
    assert len(find_conditions(replace(turning, locked=True))) == 1
