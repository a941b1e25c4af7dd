"""Measured teeth where designs are searched and recordings fitted: the same number as everywhere else."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from cases import BASE_ERRORS, drive

from hdopt.drive.errors import DriveErrors
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.errors import HdoptError
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.optimize.objectives import Point, find_quantity
from hdopt.study import load_study
from hdopt.workflow.kinematic_error import kinematic_error
from hdopt.workflow.recorded_drive import recorded_drive
from hdopt.workflow.search_setup import setup_of

SINES = BASE_ERRORS.with_(cs_tooth_amplitude=0.0005, fs_tooth_amplitude=0.0004)


def measured(seed=2):
    rng = np.random.default_rng(seed)
    teeth = [MeasuredTeeth.of(rng.normal(0, 0.003, z), "single", first_angle=0.2 * z / 160) for z in (162, 160)]
    return replace(drive(), cs_teeth=teeth[0], fs_teeth=teeth[1])


def test_a_fit_sees_the_tables_that_the_waveform_has():
    """A table at the wrong angle, with the wrong zone's half turn, or over a turn instead of the beat."""
    design, theta = measured(), np.linspace(0, 160, 1999)
    model = CartesianModel.of(design)
    found = model.evaluate(theta, to_cartesian(SINES, model.half_width))[0]
    assert found == pytest.approx(kinematic_error_arcmin(design, SINES, theta, "closed form"), abs=1e-6)


def test_slopes_of_a_fit_count_that_the_deepest_point_moves_along_the_tables():
    """Away from changes of zone and rim; without the tables' own slopes those over eccentricities are 2 % off."""
    model = CartesianModel.of(measured(seed=8))
    theta = np.linspace(0, 60, 400)
    at, step = to_cartesian(SINES, model.half_width), 1e-7
    _, zone, slopes = model.evaluate(theta, at)
    for i in range(12):
        ends = [model.evaluate(theta, at + sign * step * np.eye(12)[i]) for sign in (-1, 1)]
        smooth = (ends[0][1] == zone) & (ends[1][1] == zone)
        numeric = (ends[1][0] - ends[0][0]) / (2 * step)
        off = np.abs(numeric - slopes[:, i])[smooth]
        assert np.quantile(off, 0.95) < 1e-3 * np.abs(slopes[:, i]).max()


@pytest.fixture
def study(tmp_path):
    rng = np.random.default_rng(5)
    for name, z in (("cs", 162), ("fs", 160)):
        rows = "\n".join(f"{i + 1},left,{value:.3f}" for i, value in enumerate(rng.normal(0, 3, z)))
        (tmp_path / f"{name}.csv").write_text(f"tooth,flank,fp_um\n{rows}\n")
    sections = "".join(f'[{name}_teeth]\nfile = "{name}.csv"\ndeviation = "single"\n' for name in ("cs", "fs"))
    (tmp_path / "mine.toml").write_text(f'drive = "csf-25-80"\n{sections}')
    return load_study(tmp_path / "mine.toml")


def test_a_search_judges_the_study_s_own_design_as_ke_does(study):
    setup = setup_of(study, 1)
    same = setup.space.combinations[0]
    design = setup.space.design(same, {})
    assert design.drive.cs_teeth == study.drive.cs_teeth
    nominal = find_quantity("peak_to_peak_arcmin").value(setup.trade, design)
    expected = converged_peak_to_peak_arcmin(design.drive, study.errors, "closed form")
    assert nominal == pytest.approx(expected, abs=1e-5)
    evened = find_quantity("evened_out_arcmin").value(setup.trade, design)
    found = kinematic_error(design.drive, study.errors, method="closed form").nonuniform_arcmin
    assert evened == pytest.approx(found, abs=1e-4)
    lag = find_quantity("lag_arcmin").value(setup.trade, design)
    flat = replace(design, drive=replace(design.drive, cs_teeth=None, fs_teeth=None))
    assert lag != pytest.approx(find_quantity("lag_arcmin").value(setup.trade, flat), abs=1e-2)


def test_slopes_of_a_design_are_those_of_its_value(study):
    setup = setup_of(study, 1)
    combination = setup.space.combinations[0]
    width = setup.space.design(combination, {}).drive.wave_generator.width
    quantity = find_quantity("peak_to_peak_arcmin")
    point = Point(setup.space, setup.trade, combination, {"width_mm": width}, (("width_mm", 1e-4),))
    values, slopes = quantity.pieces(point)
    ends = [
        quantity.value(setup.trade, setup.space.design(combination, {"width_mm": width + step}))
        for step in (-1e-2, 1e-2)
    ]
    assert values.max() == pytest.approx(quantity.value(setup.trade, point.design), abs=1e-12)
    assert slopes[values.argmax(), 0] == pytest.approx((ends[1] - ends[0]) / 2e-2, rel=2e-2, abs=1e-4)


def test_a_search_that_changes_the_number_of_teeth_is_refused(study):
    with pytest.raises(HdoptError, match="changes the number of teeth"):
        setup_of(study.with_({"search.size": "fixed_outside_diameter"}), 1)


def test_no_table_leaves_a_fit_as_it_is():
    """Bit by bit: nothing is added where nothing was measured."""
    theta = np.linspace(0, 30, 500)
    bare, flat = CartesianModel.of(drive()), CartesianModel.of(replace(drive(), cs_teeth=MeasuredTeeth((0.0,) * 162)))
    at = to_cartesian(DriveErrors(axis_eccentricity=0.01), bare.half_width)
    assert np.array_equal(bare.evaluate(theta, at)[0], flat.evaluate(theta, at)[0])


def test_recordings_of_a_drive_with_tables_say_what_was_done_to_them(study, tmp_path):
    """With the first file alone: a table that was re-centred is another one than was measured."""
    theta = np.linspace(0, 720, 400)
    for name, size in (("a", 1.0), ("b", 1.1)):
        angles = {"input_angle_deg": theta, "output_angle_deg": theta / 80 - size * np.sin(np.radians(2 * theta)) / 60}
        pd.DataFrame(angles).to_csv(tmp_path / f"{name}.csv", index=False)
    first, second = recorded_drive(study).recordings([tmp_path / "a.csv", tmp_path / "b.csv"])
    assert [name for name in ("cs_teeth", "fs_teeth") if any(name in said for said in first.warnings)] == [
        "cs_teeth",
        "fs_teeth",
    ]
    assert sum("was taken out" in said for said in first.warnings) == 2
    assert not any("_teeth" in said for said in second.warnings)
