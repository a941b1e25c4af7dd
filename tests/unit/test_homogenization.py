"""k_e evens out what the zones drive, wherever a peak-to-peak is taken: stack, waveform, extended model, batch."""

from dataclasses import replace

import numpy as np
import pytest
from cases import PROFILES, drive

from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.mechanics.contact import contact_angle, homogenization_coefficient, meshing_teeth
from hdopt.study import load_study
from hdopt.tolerance.drive_inputs import Direct, DriveResponse
from hdopt.workflow.stack import study_problem

CONTACT = 'requirement.homogenization="contact"'


@pytest.fixture(scope="module")
def k_e():
    study = load_study("csf-25-80")
    gear = study.drive.geometry
    found = homogenization_coefficient(meshing_teeth(gear, contact_angle(gear, study.drive.wave_generator.profile)))
    assert 0.1 < found < 0.3  # Jia 2021, Table 4: 0.196 to 0.201
    return found


def evaluated(*settings):
    problem = study_problem(load_study("csf-25-80", settings))
    u = np.random.default_rng(2).uniform(0.05, 0.95, (24, problem.space.dimension))
    return np.asarray(problem.response(problem.space.sample(u)))


def test_stack_of_many_teeth_is_k_e_times_that_of_one(k_e):
    assert evaluated(CONTACT) == pytest.approx(k_e * evaluated(), rel=1e-12)


def test_stack_of_a_measured_profile_is_evened_out():
    """Its contour is searched drive by drive: another way through the program than that of smooth tips."""
    inputs = np.array([[0.01], [0.004]])
    design = drive(PROFILES["measured"])
    errors, feeds = DriveErrors(fs_tooth_amplitude=0.001), (Direct(0, "axis_eccentricity"),)
    made = (DriveResponse(design, errors, feeds, k_e) for k_e in (1.0, 0.2))
    plain, evened = (response(inputs) for response in made)
    assert evened == pytest.approx(0.2 * plain)


def test_stack_with_an_effect_inside_the_zones_is_evened_out_as_a_whole(k_e):
    lobing = "effects.circular_spline_lobing"
    lobes = (f"{lobing}.lobes=3", f"{lobing}.radial_amplitude_um=2.0", f"{lobing}.phase_deg=20")
    assert evaluated(CONTACT, *lobes) == pytest.approx(k_e * evaluated(*lobes), rel=1e-9)


def test_waveform_is_evened_out():
    study, theta = load_study("csf-25-80"), np.linspace(0, 40.0, 500)
    one = kinematic_error_arcmin(study.drive, study.errors, theta)
    many = kinematic_error_arcmin(study.drive, study.errors, theta, homogenization=0.2)
    assert many == pytest.approx(0.2 * one, rel=1e-12)


def test_extended_model_is_evened_out_where_the_zones_drive():
    from hdopt.simulation.model import ExtendedModel

    study = load_study("csf-25-80")
    model = ExtendedModel(study.drive, study.errors, ())
    theta = np.linspace(0, 40.0, 500)
    evened = replace(model, homogenization=0.2).waveform(theta)
    assert evened == pytest.approx(0.2 * model.waveform(theta), rel=1e-9)
