"""A search as records: what it minimises, the space of designs, what they are judged under, the limits as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any  # Any: fields of the trade's records, of several types

from hdopt.mechanics.tooth_path import Mesh
from hdopt.optimize.design_space import OWN_VARIABLES, Combination, Design, DesignSpace
from hdopt.optimize.objectives import DesignConditions, find_quantity
from hdopt.optimize.problem import DesignProblem, Limit


@dataclass(frozen=True)
class SearchSettings:
    """What a search minimises and how far it goes.

    `objective` and `second_objective` name quantities, `robust` adds a front under the tolerances at `quantile`,
    `front_points` is the size of a front, `perturbation` how far each constant is followed (0.5: down to
    1/1.5 and up to 1.5 times its value); the algorithms are those found best where they are None.
    """

    objective: str
    second_objective: str | None = None
    robust: bool = False
    quantile: float = 0.9973
    front_points: int = 30
    perturbation: float = 0.5
    global_algorithm: str | None = None
    local_algorithm: str | None = None


@dataclass(frozen=True)
class LimitRule:
    """A limit on a quantity: `bound` in its unit, or as a share of the baseline's own value; `at_least` for a lower
    limit."""

    bound: float
    at_least: bool = False
    of_baseline: bool = False


@dataclass(frozen=True)
class Setup:
    """Everything a search needs; perturbed copies are made with `dataclasses.replace`."""

    settings: SearchSettings
    space: DesignSpace
    trade: DesignConditions
    limit_rules: Mapping[str, LimitRule]

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
        """The limits as numbers; shares of the baseline are taken of the baseline under these very conditions."""
        return tuple(self._limit(key, given) for key, given in self.limit_rules.items())

    def _limit(self, key: str, given: LimitRule) -> Limit:
        quantity = find_quantity(key)
        bound = given.bound * quantity.value(self.trade, self.baseline) if given.of_baseline else given.bound
        return Limit(key, bound, at_least=given.at_least)

    def problem(self, combination: Combination, objective: str | None = None) -> DesignProblem:
        """The search of one `combination`, for `objective` or the settings' own."""
        objective = objective or self.settings.objective
        limits = tuple(limit for limit in self.limits() if limit.quantity != objective)
        return DesignProblem(self.space, self.trade, combination, objective, limits)


def with_trade(setup: Setup, **changes: Any) -> Setup:
    """`setup` judged under other conditions: `changes` are fields of `DesignConditions`."""
    return replace(setup, trade=replace(setup.trade, **changes))
