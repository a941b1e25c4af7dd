"""Stacks of drives whose teeth are known one by one, together with effects."""

from dataclasses import replace

import numpy as np
import pytest
from effect_examples import OPERATION, toml

from hdopt.drive.errors import DriveErrors
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.simulation.batch import tabulate
from hdopt.simulation.extremes import peak_to_peak_arcmin
from hdopt.study import load_study
from hdopt.tolerance.drive_effects import ExtendedResponse
from hdopt.tolerance.drive_inputs import DriveResponse
from hdopt.workflow.effect_selection import extended_model
from hdopt.workflow.kinematic_error import kinematic_error
from hdopt.workflow.stack import drive_problem_of, study_problem

LOBES = {"circular_spline_lobing": {"lobes": 6, "radial_amplitude_um": 5.0, "phase_deg": 17.0}}
HARMONIC = {"fs_tooth_harmonics": {"amplitude_3_um": 1.5, "phase_3_deg": 40.0}}
GRADED = ["tolerances.cs_teeth={iso_1328_class=6}", "tolerances.fs_teeth={iso_1328_class=6}"]
SHARED = 'requirement.homogenization="contact"'


@pytest.fixture
def study_of(tmp_path):
    def load(effects, *changes):
        (tmp_path / "extended.toml").write_text(toml(effects, OPERATION))
        return load_study(tmp_path / "extended.toml", changes)

    return load


def points_of(problem, n, seed=2):
    return problem.space.sample(np.random.default_rng(seed).random((n, problem.space.dimension)))


def measured(drive, deviations, i):
    """`drive` with the teeth of row `i` measured."""
    teeth = {name: MeasuredTeeth.of(values[i], "cumulative", recentre=False) for name, values in deviations.items()}
    return replace(drive, **teeth)


@pytest.mark.parametrize("effects", [LOBES, LOBES | HARMONIC], ids=["lobes", "lobes and FS harmonic"])
def test_each_drive_is_one_with_its_own_teeth_and_the_effects(study_of, effects):
    """Against `ke`'s model of a drive whose teeth were measured: would catch zone 2 meeting the teeth where zone 1
    does (0.3 arcmin), the teeth of the other spline, and an effect on a spline that the teeth stand instead of."""
    study = study_of(effects, *GRADED)
    problem = study_problem(study)
    assert isinstance(problem.response, ExtendedResponse)
    inputs = points_of(problem, 3)
    deviations, rows = problem.response.base.deviations(inputs), problem.response.base.matrix(inputs)
    model = replace(extended_model(study), geometry="closed form")
    expected = [
        peak_to_peak_arcmin(
            replace(model, drive=measured(study.drive, deviations, i), errors=DriveErrors.from_matrix(rows[i]))
        )
        for i in range(3)
    ]
    # As without teeth: golden section stops at 1e-3 deg, and tables are joined by chords.
    assert problem.response(inputs) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("kind", ["drawn", "measured"])
def test_terms_are_shared_as_without_effects(study_of, kind, tmp_path):
    """An effect of nil between teeth in contact: sines by k_e, misalignment by its mean, known teeth by theirs."""
    changes = GRADED[:1]
    if kind == "measured":
        pitch = np.random.default_rng(1).normal(0, 4, 162)
        rows = "\n".join(f"{i + 1},left,{value:.3f}" for i, value in enumerate(pitch))
        (tmp_path / "cs.csv").write_text(rows, encoding="utf-8")
        changes = ['cs_teeth.file="cs.csv"', 'cs_teeth.deviation="single"']
    nil = {"circular_spline_lobing": {"lobes": 6, "radial_amplitude_um": 1e-9, "phase_deg": 0.0}}
    study = study_of(nil, *changes, SHARED)
    problem, bare = study_problem(study), drive_problem_of(study).response
    assert isinstance(bare, DriveResponse) and bare.homogenization < 0.5
    inputs = points_of(problem, 6)
    assert problem.response(inputs) == pytest.approx(bare(inputs), abs=2e-3)
    lower, upper = problem.space.box
    if kind == "measured":
        assert problem.response(inputs).max() <= problem.response.upper_bound(lower, upper)


def test_ke_evens_out_measured_teeth_and_effects_as_a_stack_does(study_of, tmp_path):
    """Two ways to the same figure: k_e on the table, on none of the effects, or on misalignment moves it by 0.05 arcmin
    and more, and an effect at the output is not evened out at all."""
    pitch = np.random.default_rng(1).normal(0, 4, 162)
    rows = "\n".join(f"{i + 1},left,{value:.3f}" for i, value in enumerate(pitch))
    (tmp_path / "cs.csv").write_text(rows, encoding="utf-8")
    encoder = {"encoder_output_eccentricity": {"amplitude_arcmin": 0.2, "phase_deg": 10.0}}
    teeth = ['cs_teeth.file="cs.csv"', 'cs_teeth.deviation="single"', "fs_tooth_amplitude_mm=0.002"]
    study = study_of(LOBES | encoder, *teeth)
    result = kinematic_error(study, method="closed form")
    model = extended_model(study)
    bare = replace(model.drive, cs_teeth=None)
    k_e = result.homogenization_coefficient
    response = ExtendedResponse(
        DriveResponse(model.drive, model.errors, (), k_e), tabulate(bare, model.effects, model.operation)
    )
    assert response(np.empty((1, 0))) == pytest.approx([result.nonuniform_arcmin], abs=2e-3)


def test_effects_between_the_teeth_are_shared_by_k_e(study_of):
    """Teeth without deviations change nothing where no misalignment is to be shared otherwise. Would catch effects that
    keep all of their arc (0.3 arcmin)."""
    model = extended_model(study_of(LOBES))
    errors = DriveErrors(fs_tooth_amplitude=0.002)
    added = tabulate(model.drive, model.effects, model.operation)
    perfect = replace(model.drive, cs_teeth=MeasuredTeeth.of(np.zeros(162)))
    none = np.empty((1, 0))
    with_table, without = (
        ExtendedResponse(DriveResponse(drive, errors, (), 0.3), added)(none) for drive in (perfect, model.drive)
    )
    assert with_table == pytest.approx(without, abs=2e-3)
