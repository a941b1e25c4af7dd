"""The report's beat marks the converged extremes: the numbers of `hdopt ke`, where the waveform has them."""

from __future__ import annotations

import cases
import numpy as np
import pytest
from effect_examples import toml

from hdopt.kinematics.extremes import extremes_arcmin, lowest_and_where
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.report.sections.waveform import waveform_section
from hdopt.study import load_study, study_of_drive
from hdopt.workflow.kinematic_error import kinematic_error
from hdopt.workflow.steps import Context
from hdopt.workflow.steps.waveform import waveform as waveform_step
from hdopt.workflow.waveform import extremes_of, model_of, resolved, waveform_of

EFFECTS = {
    "lost_motion": {"lost_motion_arcmin": 0.3, "crossing_arcmin": 0.3},
    "circular_spline_lobing": {"lobes": 6, "radial_amplitude_um": 8.0, "phase_deg": 10.0},
}


def marks(section):
    """Turn, error and text of the lowest and the highest mark of the beat, and the ends of its axis."""
    figure = next(item.figure for item in section.items if getattr(item, "key", "") == "waveform-beat")
    found = {trace.name: (trace.x[0], trace.y[0], trace.text[0]) for trace in figure.data if trace.text}
    return found["Lowest"], found["Highest"], figure.layout.yaxis.range


def number(text):
    return float(text.replace("−", "-"))


def test_marks_are_the_numbers_of_ke_and_their_difference_is_the_one_above_them(tmp_path):
    """Fault caught: marks at the largest and smallest of 720 points a turn: 0.008 for 0.0049, 1.366 for 1.369."""
    study = load_study()
    section = waveform_step(study, Context(tmp_path)).sections[0]
    lowest, highest, (bottom, top) = marks(section)
    said = kinematic_error(study)
    assert lowest[2] == f"{said.minimum_arcmin:.3f}" and highest[2] == f"{said.maximum_arcmin:.3f}"
    assert (lowest[1], highest[1]) == (said.minimum_arcmin, said.maximum_arcmin)
    tile = float(dict(section.items[0].values)["Peak-to-peak, converged"].split()[0])
    # Two rounded numbers: half a unit of the last place each, and half a one of the tile's.
    assert abs(number(highest[2]) - number(lowest[2]) - tile) < 0.0016
    assert bottom < lowest[1] and highest[1] < top


@pytest.mark.parametrize(
    ("profile", "method"),
    [
        *((name, "exact") for name in cases.PROFILES),
        *((name, "closed form") for name, profile in cases.PROFILES.items() if profile.tip_is_smooth),
    ],
)
def test_each_mark_stands_where_the_error_is_the_converged_one(profile, method):
    """Faults caught: a mark at the point of the grid nearby, 1e-3 arcmin off; the highest at the lowest's angle."""
    study = study_of_drive(cases.drive(cases.PROFILES[profile]), load_study().errors)
    found = extremes_of(waveform_of(study, method), study)
    assert tuple(error for _, error in found) == extremes_arcmin(study.drive, study.errors, method)
    angles = np.array([angle for angle, _ in found])
    assert (angles >= 0).all() and (angles < 2 * np.pi * study.drive.geometry.beat_phases).all()
    there = kinematic_error_arcmin(study.drive, study.errors, angles, method)
    # Splines through a sampled contour that is not smooth are right to some 1e-4.
    smooth = study.drive.wave_generator.profile.tip_is_smooth
    assert there == pytest.approx([error for _, error in found], abs=2e-5 if smooth else 5e-4)


@pytest.mark.parametrize("motion", ["forward", "backward", "both"])
def test_with_effects_the_marks_are_those_of_the_pass_that_is_shown(tmp_path, motion):
    """Fault caught: the extremes of both passes on the waveform of one, which lies 0.3 arcmin beside the other."""
    (tmp_path / "own.toml").write_text(toml(EFFECTS, {"motion": motion}))
    study = load_study(tmp_path / "own.toml")
    shown = waveform_of(study)
    found = extremes_of(shown, study)
    model = resolved(model_of(study))
    there = model.waveform(np.array([angle for angle, _ in found]), shown.direction)
    assert there == pytest.approx([error for _, error in found], abs=1e-6)
    assert found[0][1] <= shown.waveform.min() and found[1][1] >= shown.waveform.max()


def test_without_converged_extremes_those_of_the_points_are_marked():
    """Fault caught: the marks of a waveform that was given alone left out, or changed for each other."""
    theta = np.linspace(0, 4 * np.pi, 1441)
    lowest, highest, _ = marks(waveform_section(theta, np.sin(theta)))
    assert lowest == (0.75, -1.0, "−1.000") and highest == (0.25, 1.0, "1.000")


@pytest.mark.parametrize("at", [0.003, 2.0, 6.28])
def test_where_it_is_lowest_is_found_within_one_period(at):
    """Faults caught: the angle of the grid; one below nought for a lowest point just after the period's start."""
    theta = np.arange(90) * (2 * np.pi / 90)

    def wave(x):
        return 1.0 - np.cos(x - at)

    place, value = lowest_and_where(wave, theta, wave(theta))
    assert place == pytest.approx(at, abs=1e-5) and value == pytest.approx(0.0, abs=1e-10)
    assert 0 <= place < 2 * np.pi
