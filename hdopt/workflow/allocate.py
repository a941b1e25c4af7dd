"""Least-cost tolerances of a study: the result behind `hdopt allocate`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from hdopt.allocation.request import AllocationRequest
from hdopt.errors import HdoptError, unknown_name
from hdopt.parallel.engine import Engine
from hdopt.study import AnyStudy, Study, as_study
from hdopt.study.cost_bounds import DEFAULT_REACH
from hdopt.tolerance.intervals import IntervalEstimate
from hdopt.workflow.allocation_bounds import assumed_bounds, at_assumed_bounds, bound_notes
from hdopt.workflow.placed import numbers_named
from hdopt.workflow.stack import ToleranceProblem, study_problem, words_on_model

if TYPE_CHECKING:
    from hdopt.allocation.convex import Item
    from hdopt.allocation.results import AllocateResult, RuleOutcome
    from hdopt.allocation.rules import Allocation, AllocationProblem
    from hdopt.tolerance.space import InputSpace

RULES = ("worst_case", "rss", "yield")

Progress = Callable[[Sequence[str]], Iterable[str]]


@numbers_named
def allocate(
    study: AnyStudy = None,
    rule: str | None = None,
    *,
    compare: bool | None = None,
    curve: Sequence[float] | None = None,
    seed: int = 1,
    engine: Engine | str | None = None,
    progress: Progress = iter,
) -> AllocateResult:
    """Least-cost tolerances of a `study` by `rule` ('worst_case', 'rss' or 'yield'; the study's own if None).

    `compare` also runs the other rules; `curve` gives the cost at multiples of the requirement; `seed` is that of the
    samples, `engine` computes them; `progress` is told of each rule of a drive as it begins. Raises
    `hdopt.allocation.convex.Infeasible` where no allowed tolerances meet the requirement.
    """
    from hdopt.study.costs import AllocateSection

    study = as_study(study)
    settings = study.find("allocate", AllocateSection) or AllocateSection()
    rule = (rule or settings.rule).replace("-", "_")
    if rule not in RULES:
        raise HdoptError(unknown_name("allocation rule", rule, RULES))
    request = AllocationRequest(
        rule,
        settings.compare if compare is None else compare,
        tuple(settings.curve if curve is None else curve),
        settings.verify_n,
        seed,
        engine,
    )
    if "linear_stack" in study.sections:
        from hdopt.workflow.allocate_linear import allocate_linear

        return allocate_linear(study, request)
    return _allocate_drive(study, request, progress)


def items_of(study: Study, space: InputSpace) -> tuple[list[Item], dict[str, str]]:
    """The tolerances of `study` that have a cost, as items bounded in `space`, and where the costs come from."""
    from hdopt.allocation.convex import Item
    from hdopt.allocation.results import unit_of
    from hdopt.study.tolerances import ContributorsSection, TolerancesBase

    sections = (study.find("tolerances", TolerancesBase), study.find("contributors", ContributorsSection))
    rows = {
        name: cost
        for section in sections
        if section is not None
        for name, cost in section.costs().items()
        if name in space.tolerances
    }
    if not rows:
        raise HdoptError(
            "allocate needs costs: give at least one tolerance or contributor a cost, such as "
            'cost = { model = "reciprocal", a = 1, b = 0.01 }'
        )
    geometry = study.drive.geometry
    gear = geometry.module, geometry.module * geometry.flexspline_teeth
    items: list[Item] = []
    for name, row in rows.items():
        value = space.tolerances[name].value
        if value is None:
            raise HdoptError(
                f"{name} has a cost but no tolerance: its distribution has no end. Give it one, as in upper = 0.01; "
                "a direction has no tolerance, so leave its cost out"
            )
        try:
            model = row.build(gear, unit_of(name))
        except HdoptError as error:
            raise HdoptError(f"cost of {name}: {error}") from error
        low, high = assumed_bounds(row, value, DEFAULT_REACH)
        if row.model in ("table", "piecewise"):
            low, high = (
                given or of_data for given, of_data in zip((row.tightest, row.widest), model.range, strict=True)
            )
        items.append(Item(name, model, value, low, high * (1 + 1e-12) if row.widest is None else high))
    return items, {name: row.source for name, row in rows.items()}


def _allocate_drive(study: Study, request: AllocationRequest, progress: Progress) -> AllocateResult:
    from hdopt.allocation import rules as methods

    stated = study_problem(study)
    items, sources = items_of(study, stated.space)
    problem = methods.AllocationProblem(
        stated.response, stated.space, tuple(items), stated.limit, stated.required_yield, stated.unit, request.engine
    )
    chosen, outcomes = _by_rules(problem, request, progress)
    verified = methods.verify(problem, chosen.tolerances, request.verification_seed, request.verify_n).conforming
    points = methods.yield_cost_curve(problem, [factor * stated.limit for factor in request.curve], request.seed)
    at = at_assumed_bounds(study, items, chosen.tolerances)
    return _drive_result(stated, problem, request, (chosen, sources, at), verified, (outcomes, tuple(points)))


def _drive_result(
    stated: ToleranceProblem,
    problem: AllocationProblem,
    request: AllocationRequest,
    decided: tuple[Allocation, dict[str, str], dict[str, str]],
    verified: IntervalEstimate,
    beside: tuple[tuple[RuleOutcome, ...], tuple[tuple[float, float], ...]],
) -> AllocateResult:
    from hdopt.allocation.results import (
        NOT_VERIFIED,
        AllocateResult,
        allocated_errors,
        cost_of,
        marginal_reason,
        not_reached,
        present_notes,
    )

    chosen, sources, at = decided
    outcomes, points = beside
    status = "verified" if verified.low >= stated.required_yield else NOT_VERIFIED
    allocated = replace(stated, space=stated.space.with_tolerances(chosen.tolerances))
    notes = [*stated.notes, *words_on_model(allocated, request.seed)]
    if status == NOT_VERIFIED:
        notes.append(not_reached(request.rule, verified, stated.required_yield))
    present = problem.by_name(problem.current)
    notes += [*bound_notes(at, problem.items), *present_notes(problem.items, present)]
    assert chosen.solution is not None
    return AllocateResult(
        study=stated.study,
        rule=request.rule,
        unit=stated.unit,
        limit=stated.limit,
        required_yield=stated.required_yield,
        status=status,
        errors=allocated_errors(problem.items, sources, chosen, present, at=at),
        total_cost=chosen.total_cost,
        present_cost=cost_of(problem.items, present),
        optimality_gap=None,
        optimality_gap_reason="the peak-to-peak's quantile is not proven convex in the tolerances, so no lower bound "
        f"of the cost is proven; the last convex model closed its own gap to {chosen.solution.optimality_gap:.1g}",
        marginal_cost=chosen.marginal_cost,
        marginal_cost_reason=marginal_reason("last convex model", stated.unit, chosen.marginal_cost, chosen.grades),
        slack=stated.limit - chosen.modelled,
        verified_yield=verified,
        verify_n=request.verify_n,
        verify_seed=request.verification_seed,
        comparison=outcomes,
        cost_curve=points,
        notes=tuple(notes),
    )


def _by_rules(
    problem: AllocationProblem, request: AllocationRequest, progress: Progress
) -> tuple[Allocation, tuple[RuleOutcome, ...]]:
    """What the rule asked for allocates, and where rules are compared what becomes of each of them."""
    from hdopt.allocation import rules as methods

    seed = request.seed
    by_rule: dict[str, Callable[[], Allocation]] = {
        "equal scaling": lambda: methods.allocate_by_equal_scaling(problem, seed),
        "worst_case": lambda: methods.allocate_by_worst_case(problem, seed),
        "rss": lambda: methods.allocate_by_rss(problem, seed),
        "yield": lambda: methods.allocate_by_yield(problem, seed, request.verify_n),
    }
    others = [name for name in by_rule if name != request.rule] if request.compare else []
    # the chosen rule first: where it has no answer the others are not asked
    found: dict[str, RuleOutcome] = {}
    for name in progress([request.rule, *others]):
        if name == request.rule:
            chosen = by_rule[name]()
            found[name] = _outcome(name, chosen)
        else:
            found[name] = _attempt(name, by_rule[name])
    if not request.compare:
        return chosen, ()
    return chosen, (_present(problem, seed), *(found[name] for name in by_rule))


def _attempt(name: str, run: Callable[[], Allocation]) -> RuleOutcome:
    from hdopt.allocation.convex import Infeasible
    from hdopt.allocation.results import infeasible

    try:
        return _outcome(name, run())
    except Infeasible as error:
        return infeasible(name, error)


def _present(problem: AllocationProblem, seed: int) -> RuleOutcome:
    """The tolerances as they are, judged like every rule's."""
    from hdopt.allocation.results import RuleOutcome, cost_of, finer_than_data
    from hdopt.allocation.rules import COMPARE_POINTS, verify

    tolerances = problem.by_name(problem.current)
    judged = verify(problem, tolerances, seed + 1, COMPARE_POINTS)
    cost, finer = cost_of(problem.items, tolerances), finer_than_data(problem.items, tolerances)
    return RuleOutcome("present", cost, tolerances, judged.conforming, judged.required_quantile.value, None, finer)


def _outcome(name: str, allocation: Allocation) -> RuleOutcome:
    from hdopt.allocation.results import RuleOutcome

    return RuleOutcome(
        name,
        allocation.total_cost,
        allocation.tolerances,
        allocation.conforming,
        allocation.required_quantile.value,
        allocation.modelled,
    )
