"""From a study to a search: its space of designs, what they are judged under, and the limits as numbers."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import Structure
from hdopt.errors import HdoptError, MissingValue
from hdopt.mechanics.bearing_life import BearingConstants
from hdopt.optimize.design_space import SIZE_RULES, Combination, DesignSpace, Variable
from hdopt.optimize.objectives import DesignConditions, find_quantity
from hdopt.optimize.setup import LimitRule, SearchSettings, Setup
from hdopt.study import Study
from hdopt.study.drive import WaveGeneratorSection
from hdopt.study.search import (
    DEFAULT_LIMITS,
    DEFAULT_VARIABLES,
    LimitSection,
    SearchSection,
    VariableSection,
)
from hdopt.study.tolerances import TolerancesBase

if TYPE_CHECKING:
    from hdopt.optimize.design_effects import DesignEffects
    from hdopt.optimize.sampled_teeth import SampledTeeth

RPM = 2 * math.pi / 60
DEFAULT_WRAP_DEG = 60.0
"""Wrap angle where neither the study nor a variable gives one: that of Jia 2021, Table 4."""


def setup_of(study: Study, seed: int) -> Setup:
    """The search of a `study`; one without [search] gets the default variables and limits. `seed` is that of the drives
    which make a quantile."""
    section = study.find("search", SearchSection) or SearchSection()
    drive = study.drive
    if drive.has_measured_teeth and section.size != "fixed_tooth_counts":
        raise HdoptError(
            f"search.size is {section.size!r}, which changes the number of teeth, and these were measured one by one; "
            "set search.size=fixed_tooth_counts, or leave [cs_teeth] and [fs_teeth] out"
        )
    tolerances = study.find("tolerances", TolerancesBase)
    if tolerances is not None and section.size != "fixed_tooth_counts" and tolerances.graded(drive.geometry):
        raise HdoptError(
            f"search.size is {section.size!r}, which changes the number of teeth, and their tolerances of pitch are "
            "drawn for one number; set search.size=fixed_tooth_counts, or give tooth amplitudes in [tolerances]"
        )
    if not drive.wave_generator.profile.tip_is_smooth:
        raise HdoptError(
            f"the study's profile is {drive.wave_generator.profile.name!r}; a search starts from an ellipse, Resal or "
            "two-disk profile"
        )
    generator = study.find("wave_generator", WaveGeneratorSection)
    given_wrap = None if generator is None else generator.wrap_angle_deg
    wrap = DEFAULT_WRAP_DEG if given_wrap is None else given_wrap
    size = SIZE_RULES[section.size]
    variables = []
    for name in type(section.variables or DEFAULT_VARIABLES).model_fields:
        given: VariableSection | None = getattr(section.variables or DEFAULT_VARIABLES, name)
        if given is None:
            continue
        allowed = given.allowed()
        if name == "module_mm":
            allowed = _modules(allowed, size.modules(drive.geometry, given.lower, given.upper), section.size)
        variables.append(Variable(name, given.lower, given.upper, allowed))
    combinations = tuple(
        Combination(profile, Structure(structure)) for profile in section.profiles for structure in section.structures
    )
    space = DesignSpace(drive, wrap, size, tuple(variables), combinations)
    limits = DEFAULT_LIMITS if section.limits is None else section.limits
    asked = [("objective", section.objective), ("second_objective", section.second_objective)]
    for name, key in (*asked, *(("limits", key) for key in limits)):
        try:
            if key is not None:
                find_quantity(key)
        except HdoptError as error:
            raise HdoptError(f"[search] {name}: {error}") from error
    rules = {key: _rule(limit) for key, limit in limits.items()}
    return Setup(_settings(section), space, _trade(study, section, seed), rules)


def _settings(section: SearchSection) -> SearchSettings:
    return SearchSettings(**{field.name: getattr(section, field.name) for field in fields(SearchSettings)})


def _rule(section: LimitSection) -> LimitRule:
    (side,) = section.model_fields_set
    return LimitRule(getattr(section, side), side.startswith("min"), side.endswith("of_baseline"))


def _modules(wanted: tuple[float, ...], possible: tuple[float, ...], size: str) -> tuple[float, ...]:
    if not possible:
        return wanted
    if wanted:
        raise HdoptError(
            f"[search.variables] module_mm has its own values, but {size} allows only those of whole tooth counts; "
            "leave step and values out"
        )
    return possible


def _trade(study: Study, section: SearchSection, seed: int) -> DesignConditions:
    drive, given = study.drive, section.trade
    load = drive.load
    rated_torque = load.torque if given.rated_torque_nm is None else 1000 * given.rated_torque_nm
    rated_speed = load.input_speed if given.rated_speed_rpm is None else RPM * given.rated_speed_rpm
    if rated_torque is None or rated_speed is None:
        raise MissingValue("a design search", "load.torque_nm", "load.input_speed_rpm")
    constants = BearingConstants(
        rated_torque,
        rated_speed,
        given.bearing_l50_h,
        given.torque_exponent,
        given.l10_share,
        given.width_exponent,
        given.friction,
    )
    needs_sample = section.robust or "quantile" in section.objective
    sample, teeth = sample_of(study, section.samples, seed) if needs_sample else (None, None)
    return DesignConditions(
        errors=study.errors,
        reference=drive,
        bearing=constants,
        torque=load.torque,
        speed=load.input_speed,
        face_width=load.tooth_face_width,
        backlash=drive.clearances.backlash,
        notch_factor=given.notch_factor,
        mean_stress_sensitivity=given.mean_stress_sensitivity,
        sample=sample,
        teeth=teeth,
        quantile=section.quantile,
        added=_effects(study, section),
        structure_costs=tuple((Structure(name), cost / 100) for name, cost in given.structure_cost_percent.items()),
        over_bore=(given.wg_tilt_major_over == "bore", given.wg_tilt_minor_over == "bore"),
    )


def _effects(study: Study, section: SearchSection) -> DesignEffects | None:
    """The effects that count: those of the drive, unless [operation] says otherwise."""
    if not study.effects:
        return None
    from hdopt.optimize.design_effects import DesignEffects
    from hdopt.workflow.effect_selection import inclusion

    chosen = inclusion(study, "drive").counted
    if not chosen:
        return None
    if section.size != "fixed_tooth_counts":
        raise HdoptError(
            f"search.size is {section.size!r}, which changes the ratio and with it the orders of the effects found; "
            "set search.size=fixed_tooth_counts, or leave the effects out with operation.include=none"
        )
    return DesignEffects.of(study.drive, chosen, study.operation)


def sample_of(study: Study, n: int, seed: int) -> tuple[Array, SampledTeeth | None]:
    """`n` drives of the study's tolerances as rows of `DriveErrors.to_matrix`, and their teeth where those are drawn
    from tolerances of pitch: one scrambling, by `seed`, of Sobol' points."""
    from hdopt.optimize.sampled_teeth import SampledTeeth
    from hdopt.tolerance.sampling import ScrambledSobol
    from hdopt.workflow.stack import drive_problem_of

    problem = drive_problem_of(study)
    response = problem.response
    points = np.concatenate(list(ScrambledSobol(1).blocks(seed, 0, n, problem.space.dimension)))
    inputs = problem.space.sample(points)
    teeth = SampledTeeth.of(response.teeth, inputs) if response.teeth else None
    return response.errors(inputs).to_matrix(), teeth
