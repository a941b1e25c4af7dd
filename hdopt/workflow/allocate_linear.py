"""Least-cost tolerances of a linear stack: a convex problem, solved with a bound of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdopt.allocation.convex import Item, Requirement, Solution, cost_curve, rss_rule, solve, worst_case_rule
from hdopt.allocation.request import AllocationRequest
from hdopt.allocation.results import AllocateResult, RuleOutcome, allocated_errors, cost_of, marginal_reason
from hdopt.errors import HdoptError
from hdopt.study import Study
from hdopt.study.costs import Cost
from hdopt.study.tolerances import LinearStackSection
from hdopt.tolerance.linear_stack import Dimension, linear_problem
from hdopt.tolerance.stack import Stack, StackRequest, run_stack
from hdopt.workflow.stack import STACK_N

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
        fixed = [d.sensitivity * d.tolerance for name, d in dimensions.items() if name not in self.costs]
        return MAKERS[rule]([dimensions[name].sensitivity for name in self.costs], self.section.gap_tolerance, fixed)

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
    sources = {name: cost.source for name, cost in problem.costs.items()}
    return AllocateResult(
        study=study.name,
        rule=request.rule,
        unit=section.unit,
        limit=section.gap_tolerance,
        required_yield=section.required_yield,
        status="optimal",
        errors=allocated_errors(items, sources, solution, problem.present, section.unit),
        total_cost=solution.total_cost,
        present_cost=cost_of(items, problem.present),
        optimality_gap=solution.optimality_gap,
        optimality_gap_reason="against the Lagrangian lower bound"
        if not any(item.cost.discrete for item in items)
        else "against the mixed-integer problem's lower bound",
        marginal_cost=solution.marginal_cost,
        marginal_cost_reason=marginal_reason("requirement", section.unit, solution.marginal_cost, solution.grades),
        slack=solution.slack,
        verified_yield=problem.judged(solution.tolerances, request.verify_n).conforming,
        verify_n=request.verify_n,
        verify_seed=request.verification_seed,
        comparison=comparison,
        cost_curve=tuple(cost_curve(items, requirement, [factor * section.gap_tolerance for factor in request.curve])),
        notes=("the verified yield takes each dimension as normal, truncated at its tolerance",),
    )


def _problem(study: Study, request: AllocationRequest) -> LinearProblem:
    section = study.section("linear_stack", LinearStackSection)
    if request.rule == "yield":
        raise HdoptError("the yield rule is for drives; a linear stack takes the rule worst_case or rss")
    costs = {name: d.cost for name, d in section.dimensions.items() if d.cost is not None}
    if not costs:
        raise HdoptError("allocate needs costs: give at least one dimension of [linear_stack] a cost")
    items = tuple(
        Item(
            name,
            cost.build(None),
            section.dimensions[name].tolerance,
            cost.tightest or 0.0,
            cost.widest or float("inf"),
        )
        for name, cost in costs.items()
    )
    return LinearProblem(section, request, costs, items)


def _comparison(problem: LinearProblem, solution: Solution) -> tuple[RuleOutcome, ...]:
    """The present tolerances and those of each rule, judged by the same stack; `solution` is the rule's asked for."""

    def outcome(name: str, tolerances: dict[str, float], cost: float, modelled: float | None) -> RuleOutcome:
        found = problem.judged(tolerances, STACK_N)
        return RuleOutcome(name, cost, tolerances, found.conforming, found.required_quantile.value, modelled)

    outcomes = [outcome("present", problem.present, cost_of(problem.items, problem.present), None)]
    for name in MAKERS:
        requirement = problem.requirement(name)
        found = solution if name == problem.request.rule else solve(problem.items, requirement)
        value = requirement.value(np.array(list(found.tolerances.values())))
        outcomes.append(outcome(name, found.tolerances, found.total_cost, value))
    return tuple(outcomes)
