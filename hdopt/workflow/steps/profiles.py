"""Step: the drive with each profile that its flexspline and its deflection allow."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd

from hdopt.drive.geometry import Drive
from hdopt.drive.profiles import Ellipse, Resal, TwoDisk, WaveGeneratorProfile, perimeter_error
from hdopt.errors import MissingValue
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin, evened_out_arcmin
from hdopt.mechanics.bending import curvature_change, max_bending_stress
from hdopt.mechanics.contact_model import contact_of
from hdopt.report.sections.profiles import profiles_section
from hdopt.study import Study
from hdopt.study.drive import WaveGeneratorSection
from hdopt.workflow.steps import Context, StepResult

USUAL_WRAP_ANGLE_DEG = 60.0
"""Of the two-disk profile in Jia 2021, Table 4; taken where the study gives none."""


def alternatives(study: Study) -> dict[str, WaveGeneratorProfile]:
    """The own profile of the `study` first, then the others with the same deflection on the major axis."""
    drive = study.drive
    own, radius = drive.wave_generator.profile, drive.geometry.flexspline_inner_radius
    deflection = own.semi_major - radius
    given = study.section("wave_generator", WaveGeneratorSection).wrap_angle_deg
    wrap = math.radians(USUAL_WRAP_ANGLE_DEG if given is None else given)
    offered = (
        Ellipse.of_equal_perimeter(radius, own.semi_major),
        Resal(radius, deflection),
        TwoDisk(radius, deflection, wrap),
    )
    return {own.name: own} | {profile.name: profile for profile in offered if profile.name != own.name}


def profiles(study: Study, context: Context) -> StepResult:
    """Shape, curvature change, stress, contact and kinematic error of each profile for the drive of the `study`; needs
    nothing of the `context`."""
    phi = np.radians(np.arange(0.0, 360.5, 1.0))
    geometry = study.drive.geometry
    offered = alternatives(study)
    rows = []
    for name, profile in offered.items():
        drive = replace(study.drive, wave_generator=replace(study.drive.wave_generator, profile=profile))
        rows.append({"profile": name, **_merits(drive, study)})
    summary = pd.DataFrame(rows).dropna(axis="columns", how="all")
    section = profiles_section(
        phi,
        {name: profile.radius(phi) - geometry.flexspline_inner_radius for name, profile in offered.items()},
        {name: curvature_change(geometry, profile, phi) for name, profile in offered.items()},
        geometry.flexspline_inner_radius,
        summary,
    )
    return StepResult((section,), {row.pop("profile"): row for row in summary.to_dict("records")})


def _merits(drive: Drive, study: Study) -> dict[str, float]:
    profile = drive.wave_generator.profile
    angle = _given(lambda: contact_of(drive).angle)
    k_e = _given(lambda: contact_of(drive).homogenization())
    return {
        "contact_angle_deg": math.degrees(angle),
        "homogenization_coefficient": k_e,
        "peak_to_peak_arcmin": converged_peak_to_peak_arcmin(drive, study.errors),
        "evened_out_arcmin": k_e if math.isnan(k_e) else evened_out_arcmin(drive, study.errors, k_e),
        "max_bending_stress_mpa": _given(lambda: max_bending_stress(drive)),
        "perimeter_error_um": 1000 * perimeter_error(profile, drive.geometry.flexspline_inner_radius),
    }


def _given(value: Callable[[], float]) -> float:
    """The value, or nan where it needs a number that the study does not give."""
    try:
        return value()
    except MissingValue:
        return math.nan
