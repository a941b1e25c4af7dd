"""Many drives with the same effects: the compiled walk against the reference, and what stacks make of it."""

from dataclasses import replace

import numpy as np
import pytest
from cases import random_errors
from effect_examples import EXAMPLES, OPERATION, toml

from hdopt.drive.errors import DriveErrors
from hdopt.errors import HdoptError
from hdopt.kinematics import peak_to_peak_arcmin as base_peak_to_peak_arcmin
from hdopt.simulation.batch import matrix_peak_to_peak_arcmin, tabulate
from hdopt.simulation.extremes import peak_to_peak_arcmin
from hdopt.study import load_study
from hdopt.tolerance.drive_effects import ExtendedResponse
from hdopt.tolerance.drive_inputs import DriveResponse
from hdopt.workflow.effect_selection import extended_model
from hdopt.workflow.stack import stack, study_problem

TABLED = [(name, keys) for name, keys in EXAMPLES if name != "resonance" and keys.get("lines") != 4001]


@pytest.fixture
def study_with(tmp_path):
    def load(effects, operation=OPERATION):
        (tmp_path / "extended.toml").write_text(toml(effects, operation))
        return load_study(tmp_path / "extended.toml")

    return load


@pytest.mark.parametrize(("name", "keys"), TABLED, ids=[f"{name}-{i}" for i, (name, _) in enumerate(TABLED)])
def test_the_compiled_walk_finds_the_reference_peak_to_peak(study_with, name, keys):
    """Within 2e-3 arcmin: golden section stops at 1e-3 deg, and a table with 32 places in a period dims by 0.5 %."""
    model = replace(extended_model(study_with({name: keys})), geometry="closed form")
    matrix = random_errors(2, seed=7).to_matrix()
    found = matrix_peak_to_peak_arcmin(model.drive, matrix, tabulate(model.drive, model.effects, model.operation))
    for row, value in zip(matrix, found, strict=True):
        reference = replace(model, errors=DriveErrors.from_matrix(row))
        assert value == pytest.approx(peak_to_peak_arcmin(reference), abs=2e-3)


def test_without_effects_the_walk_agrees_with_the_kernel_of_the_base():
    """The kernel is right to 1e-3 arcmin for 99 % of drives."""
    study, errors = load_study(), random_errors(200, seed=3)
    walked = matrix_peak_to_peak_arcmin(study.drive, errors.to_matrix(), tabulate(study.drive, (), study.operation))
    off = np.abs(walked - base_peak_to_peak_arcmin(study.drive, errors))
    assert np.quantile(off, 0.99) < 1e-3


LOBES = {"circular_spline_lobing": {"lobes": 6, "radial_amplitude_um": 5.0, "phase_deg": 17.0}}
ENCODER = {"encoder_output_eccentricity": {"amplitude_arcmin": 0.1, "phase_deg": 15.0}}


def sampled(problem):
    """The response of 200 drives of the tolerances, and what the problem says of effects."""
    points = problem.space.sample(np.random.default_rng(0).random((200, problem.space.dimension)))
    return problem.response(points), " ".join(problem.notes)


def test_tolerances_count_the_drive_and_leave_the_bench_out(study_with):
    bare, _ = sampled(study_problem(study_with({}, {})))
    drive, said = sampled(study_problem(study_with(LOBES | ENCODER, {})))
    every, _ = sampled(study_problem(study_with(LOBES | ENCODER, {"include": "all"})))
    none, _ = sampled(study_problem(study_with(LOBES | ENCODER, {"include": "none"})))
    assert bare.mean() + 0.05 < drive.mean() < every.mean() - 0.05
    assert (none == bare).all()
    assert "computed with circular_spline_lobing" in said
    assert "without encoder_output_eccentricity (of the bench that measured" in said
    assert "the same in every drive" in said


def test_a_shift_at_reversal_adds_to_every_drive(study_with):
    """Play of 0.3 arcmin, both ways: 0.3 arcmin more in every drive, to what the walk and the kernel are right to."""
    effects = {"lost_motion": {"lost_motion_arcmin": 0.3, "crossing_arcmin": 0.3}}
    both, _ = sampled(study_problem(study_with(effects, {"motion": "both"})))
    one_way, _ = sampled(study_problem(study_with(effects, {"motion": "forward"})))
    bare, _ = sampled(study_problem(study_with({}, {})))
    assert np.quantile(np.abs(both - bare - 0.3), 0.99) < 2e-3
    assert np.quantile(np.abs(one_way - bare), 0.99) < 2e-3


@pytest.mark.slow
def test_a_stack_works_with_effects(study_with):
    result = stack(study_with(LOBES, {}), 2048)
    values, _ = sampled(study_problem(study_with(LOBES, {})))
    # 200 independent drives against 2048: four standard errors of their mean
    assert result.stack.mean.value == pytest.approx(values.mean(), abs=4 * values.std() / np.sqrt(200))
    assert any("computed with circular_spline_lobing" in note for note in result.to_dict()["notes"])


def test_the_bound_holds_for_drives_with_effects(study_with):
    problem = study_problem(study_with(LOBES, {}))
    points = problem.space.sample(np.random.default_rng(0).random((256, problem.space.dimension)))
    lower, upper = points.min(axis=0), points.max(axis=0)
    assert isinstance(problem.response, ExtendedResponse)
    assert problem.response(points).max() <= problem.response.upper_bound(lower, upper)


def test_without_effects_the_response_is_the_kernels(study_with):
    assert isinstance(study_problem(study_with({}, {})).response, DriveResponse)
    assert isinstance(study_problem(study_with(ENCODER, {})).response, DriveResponse)


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"resonance": {"frequency_hz": 3.0, "damping_ratio": 0.05}}, "resonance follows each drive's own waveform"),
        (
            {"encoder_interpolation": {"shaft": "input", "lines": 5000, "amplitude_arcmin": 0.1, "phase_deg": 0.0}},
            "encoder_interpolation is a ripple too fine for tolerances and searches",
        ),
    ],
)
def test_what_a_stack_cannot_use_is_refused(study_with, effects, message):
    study = study_with(effects, {"include": "all", "speed_rpm": 60.0})
    with pytest.raises(HdoptError, match=message):
        study_problem(study)
    assert isinstance(study_problem(study_with(effects, {})).response, DriveResponse)
