"""From a study to a search: its space of designs, what they are judged under, and the limits as numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdopt.drive import Structure
from hdopt.errors import HdoptError, MissingValue
from hdopt.study import Study
from hdopt.study.search import (
    DEFAULT_LIMITS,
    DEFAULT_VARIABLES,
    LimitSection,
    SearchSection,
    VariableSection,
)
from hdopt.trade.bearing import BearingConstants
from hdopt.trade.mesh import Mesh
from hdopt.trade.problem import DesignProblem, Limit
from hdopt.trade.quantities import Trade, find_quantity
from hdopt.trade.space import OWN_VARIABLES, SIZE_RULES, Combination, Design, DesignSpace, Variable

if TYPE_CHECKING:
    from hdopt.trade.added import DesignEffects

RPM = 2 * math.pi / 60
DEFAULT_WRAP_DEG = 60.0
"""Wrap angle where neither the study nor a variable gives one: that of Jia 2021, Table 4."""


@dataclass(frozen=True)
class Setup:
    """Everything a search needs, made once from a study; perturbed copies are made with `replace`."""

    section: SearchSection
    space: DesignSpace
    trade: Trade
    limit_sections: dict[str, LimitSection]

    @property
    def baseline(self) -> Design:
        """The study's own drive, its profile as it stands (which need not keep the flexspline's perimeter)."""
        drive = self.space.baseline
        generator = drive.wave_generator
        combination = Combination(generator.profile.name, generator.structure)
        values = dict(self.space.baseline_values)
        if combination.profile not in OWN_VARIABLES:
            del values["wrap_angle_deg"]
        return Design(combination, values, drive, Mesh(drive.geometry, generator.profile))

    def limits(self) -> tuple[Limit, ...]:
        """The limits as numbers; shares of the baseline are taken of the baseline under this very trade."""
        return tuple(self._limit(key, given) for key, given in self.limit_sections.items())

    def _limit(self, key: str, given: LimitSection) -> Limit:
        quantity = find_quantity(key)
        share = given.max_of_baseline if given.max_of_baseline is not None else given.min_of_baseline
        if share is not None:
            bound = share * quantity.value(self.trade, self.baseline)
        else:
            bound = given.max if given.max is not None else given.min
        return Limit(key, bound, at_least=given.min is not None or given.min_of_baseline is not None)

    def problem(self, combination: Combination, objective: str | None = None) -> DesignProblem:
        objective = objective or self.section.objective
        limits = tuple(limit for limit in self.limits() if limit.quantity != objective)
        return DesignProblem(self.space, self.trade, combination, objective, limits)


def setup_of(study: Study, seed: int) -> Setup:
    """The search of a study; a study without [search] gets the default variables and limits."""
    section = study.sections.get("search") or SearchSection()
    drive = study.drive
    if not drive.wave_generator.profile.tip_is_smooth:
        raise HdoptError(
            f"the study's profile is {drive.wave_generator.profile.name!r}; a search starts from an ellipse, Resal or "
            "two-disk profile"
        )
    wrap = getattr(study.sections.get("wave_generator"), "wrap_angle_deg", None) or DEFAULT_WRAP_DEG
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
    for key in (section.objective, section.second_objective, *limits):
        if key is not None:
            find_quantity(key)
    return Setup(section, space, _trade(study, section, seed), dict(limits))


def _modules(wanted: tuple[float, ...], possible: tuple[float, ...], size: str) -> tuple[float, ...]:
    if not possible:
        return wanted
    if wanted:
        raise HdoptError(
            f"[search.variables] module_mm has its own values, but {size} allows only those of whole tooth counts; "
            "leave step and values out"
        )
    return possible


def _trade(study: Study, section: SearchSection, seed: int) -> Trade:
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
    return Trade(
        errors=study.errors,
        reference=drive,
        bearing=constants,
        torque=load.torque,
        speed=load.input_speed,
        face_width=load.tooth_face_width,
        backlash=drive.clearances.backlash,
        notch_factor=given.notch_factor,
        sample=sample_rows(study, section.samples, seed) if needs_sample else None,
        quantile=section.quantile,
        added=_effects(study, section, needs_sample),
    )


def _effects(study: Study, section: SearchSection, needs_sample: bool) -> DesignEffects | None:
    """The effects that count: those of the drive, unless [operation] says otherwise."""
    if not study.effects:
        return None
    from hdopt.included import inclusion
    from hdopt.trade.added import DesignEffects

    chosen = inclusion(study, "drive").counted
    if not chosen:
        return None
    leave = "leave the effects out with operation.include=none"
    if needs_sample:
        raise HdoptError(
            "a search under the tolerances does not compute effects, whose walk takes a hundred times longer; set "
            f"search.robust=false with a nominal search.objective, or {leave}"
        )
    if section.size != "fixed_tooth_counts":
        raise HdoptError(
            f"search.size is {section.size!r}, which changes the ratio and with it the orders of the effects found; "
            f"set search.size=fixed_tooth_counts, or {leave}"
        )
    return DesignEffects.of(study.drive, chosen, study.operation)


def tolerance_problem(study: Study):
    """The study's tolerances as (rows of inputs -> errors, random inputs)."""
    from hdopt.tolerancing import study_problem

    problem = study_problem(study)
    return problem.response, problem.space


def sample_rows(study: Study, n: int, seed: int) -> NDArray[np.float64]:
    """`n` drives of the study's tolerances as rows of `DriveErrors.to_matrix`: one scrambling of Sobol' points."""
    from hdopt.tolerance.sampling import ScrambledSobol

    response, space = tolerance_problem(study)
    points = np.concatenate(list(ScrambledSobol(1).blocks(seed, 0, n, space.dimension)))
    return response.errors(space.sample(points)).to_matrix()


def with_trade(setup: Setup, **changes) -> Setup:
    """The same search judged under another trade."""
    return replace(setup, trade=replace(setup.trade, **changes))
