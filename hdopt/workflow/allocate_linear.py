"""Least-cost tolerances of a linear stack: a convex problem, solved with a bound of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdopt.allocation.convex import (
    Infeasible,
    Item,
    Requirement,
    Solution,
    cost_curve,
    rss_rule,
    solve,
    worst_case_rule,
)
from hdopt.allocation.request import AllocationRequest
from hdopt.allocation.results import (
    NOT_VERIFIED,
    AllocateResult,
    RuleOutcome,
    allocated_errors,
    cost_of,
    finer_than_data,
    infeasible,
    marginal_reason,
    not_reached,
    present_notes,
)
from hdopt.allocation.spread import spread_factors
from hdopt.errors import HdoptError
from hdopt.study import Study
from hdopt.study.cost_bounds import LINEAR_REACH
from hdopt.study.costs import Cost
from hdopt.study.tolerances import LinearStackSection
from hdopt.tolerance.intervals import smallest_n
from hdopt.tolerance.linear_stack import Dimension, linear_problem
from hdopt.tolerance.stack import Stack, StackRequest, run_stack
from hdopt.workflow.allocation_bounds import assumed_bounds, at_assumed_bounds, bound_notes
from hdopt.workflow.stack import STACK_N

NORMAL = "the verified yield takes each dimension as normal, truncated at its tolerance"
MAKERS = {"worst_case": worst_case_rule, "rss": rss_rule}


@dataclass(frozen=True)
class LinearProblem:
    """The linear stack of a study, and its dimensions that have a cost."""

    section: LinearStackSection
    request: AllocationRequest
    costs: Mapping[str, Cost]
    items: tuple[Item, ...]

    @property
    def present(self) -> dict[str, float]:
        """Tolerances as they are."""
        return {name: self.section.dimensions[name].tolerance for name in self.costs}

    def requirement(self, rule: str) -> Requirement:
        """What `rule` asks of the tolerances that have a cost; the others are held."""
        dimensions = self.section.dimensions
        counted = dict.fromkeys(dimensions, 1.0)
        if rule == "rss":
            sigmas = np.array([d.sigmas for d in dimensions.values()])
            factors = spread_factors(sigmas, self.section.required_yield)
            counted = dict(zip(dimensions, map(float, factors), strict=True))
        slopes = {name: counted[name] * d.sensitivity for name, d in dimensions.items()}
        fixed = [slopes[name] * d.tolerance for name, d in dimensions.items() if name not in self.costs]
        return MAKERS[rule]([slopes[name] for name in self.costs], self.section.gap_tolerance, fixed)

    def judged(self, tolerances: Mapping[str, float], n: int) -> Stack:
        """The stack of `n` samples under other `tolerances`."""
        dimensions = self.section.dimensions
        response, space = linear_problem(
            {k: Dimension(d.sensitivity, tolerances.get(k, d.tolerance), d.sigmas) for k, d in dimensions.items()}
        )
        return run_stack(
            response,
            space,
            StackRequest(
                limit=self.section.gap_tolerance,
                required_yield=self.section.required_yield,
                n=n,
                seed=self.request.verification_seed,
                engine=self.request.engine,
                unit=self.section.unit,
            ),
        )


def allocate_linear(study: Study, request: AllocationRequest) -> AllocateResult:
    """Least-cost tolerances of the linear stack of `study` as `request` asks; the yield rule is for drives."""
    problem = _problem(study, request)
    section, items = problem.section, problem.items
    requirement = problem.requirement(request.rule)
    solution = solve(items, requirement)
    comparison = _comparison(problem, solution) if request.compare else ()
    verified = problem.judged(solution.tolerances, request.verify_n).conforming
    missed = verified.value < section.required_yield
    at = at_assumed_bounds(study, items, solution.tolerances)
    sources = {name: cost.source for name, cost in problem.costs.items()}
    return AllocateResult(
        study=study.name,
        rule=request.rule,
        unit=section.unit,
        limit=section.gap_tolerance,
        required_yield=section.required_yield,
        status=NOT_VERIFIED if missed else "optimal",
        errors=allocated_errors(items, sources, solution, problem.present, section.unit, at),
        total_cost=solution.total_cost,
        present_cost=cost_of(items, problem.present),
        optimality_gap=solution.optimality_gap,
        optimality_gap_reason="against the Lagrangian lower bound"
        if not any(item.cost.discrete for item in items)
        else "against the mixed-integer problem's lower bound",
        marginal_cost=solution.marginal_cost,
        marginal_cost_reason=marginal_reason("requirement", section.unit, solution.marginal_cost, solution.grades),
        slack=solution.slack,
        verified_yield=verified,
        verify_n=request.verify_n,
        verify_seed=request.verification_seed,
        comparison=comparison,
        cost_curve=tuple(cost_curve(items, requirement, [factor * section.gap_tolerance for factor in request.curve])),
        notes=(
            NORMAL,
            *((not_reached(request.rule, verified, section.required_yield),) if missed else ()),
            *bound_notes(at, items),
            *present_notes(items, problem.present),
        ),
    )


def _problem(study: Study, request: AllocationRequest) -> LinearProblem:
    section = study.section("linear_stack", LinearStackSection)
    if request.rule == "yield":
        raise HdoptError("the yield rule is for drives; a linear stack takes the rule worst_case or rss")
    costs = {name: d.cost for name, d in section.dimensions.items() if d.cost is not None}
    if not costs:
        raise HdoptError("allocate needs costs: give at least one dimension of [linear_stack] a cost")
    items = tuple(_item(name, section, cost) for name, cost in costs.items())
    return LinearProblem(section, request, costs, items)


def _item(name: str, section: LinearStackSection, cost: Cost) -> Item:
    """The dimension `name` of the stack as a tolerance to choose at this `cost`."""
    try:
        model = cost.build(None, section.unit)
    except HdoptError as error:
        raise HdoptError(f"cost of {name}: {error}") from error
    present = section.dimensions[name].tolerance
    return Item(name, model, present, *assumed_bounds(cost, present, LINEAR_REACH))


def _comparison(problem: LinearProblem, solution: Solution) -> tuple[RuleOutcome, ...]:
    """The present tolerances and those of each rule, judged by the same stack; `solution` is the rule's asked for."""

    fewer = smallest_n(problem.section.required_yield) <= STACK_N
    n = STACK_N if fewer else problem.request.verify_n

    def outcome(name: str, tolerances: dict[str, float], cost: float, modelled: float | None) -> RuleOutcome:
        found, note = problem.judged(tolerances, n), finer_than_data(problem.items, tolerances)
        return RuleOutcome(name, cost, tolerances, found.conforming, found.required_quantile.value, modelled, note)

    outcomes = [outcome("present", problem.present, cost_of(problem.items, problem.present), None)]
    for name in MAKERS:
        requirement = problem.requirement(name)
        try:
            found = solution if name == problem.request.rule else solve(problem.items, requirement)
        except Infeasible as error:
            outcomes.append(infeasible(name, error))
            continue
        value = requirement.value(np.array(list(found.tolerances.values())))
        outcomes.append(outcome(name, found.tolerances, found.total_cost, value))
    return tuple(outcomes)
