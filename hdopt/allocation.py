"""Least-cost tolerances of a study: the result behind `hdopt allocate`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdopt.engine import Engine
from hdopt.errors import HdoptError, unknown_name
from hdopt.study import Study
from hdopt.tolerance.intervals import Estimate
from hdopt.tolerance.space import InputSpace
from hdopt.tolerance.stack import Stack, run_stack
from hdopt.tolerancing import STACK_N, loaded_study, study_problem

if TYPE_CHECKING:
    from hdopt.tolerance.allocate import Item
    from hdopt.tolerance.allocate_response import Allocation

DEFAULT_REACH = (0.1, 3.0)
"""How far an allocated tolerance may go where the study does not say, as multiples of the present one: the closed form
of the kinematic error is checked up to three times the shipped tolerances."""


@dataclass(frozen=True)
class AllocatedError:
    """One tolerance: before and after, its grade where grades are used, and why that grade's standard does not reach
    here, if so; `unit` is that of the tolerance."""

    tolerance: float
    present: float
    cost: float
    present_cost: float
    unit: str
    grade: str | None = None
    extrapolated: str = ""
    source: str = "assumed"


@dataclass(frozen=True)
class RuleOutcome:
    """What one rule allocates, and what the real response makes of it."""

    rule: str
    total_cost: float
    tolerances: dict[str, float]
    conforming: Estimate
    required_quantile: float
    modelled: float | None
    note: str = ""


@dataclass(frozen=True)
class AllocateResult:
    """Tolerances at least cost by one rule, verified once."""

    study: str
    rule: str
    unit: str
    limit: float
    required_yield: float
    status: str
    errors: dict[str, AllocatedError]
    total_cost: float
    present_cost: float
    optimality_gap: float | None
    optimality_gap_reason: str
    marginal_cost: float | None
    marginal_cost_reason: str
    slack: float | None
    verified_yield: Estimate
    verify_n: int
    verify_seed: int
    comparison: tuple[RuleOutcome, ...] = ()
    cost_curve: tuple[tuple[float, float], ...] = ()
    notes: tuple[str, ...] = field(default=())

    @property
    def accepted(self) -> bool:
        """Whether the verification confirms what the rule promises."""
        return self.status != "not verified"

    def to_dict(self) -> dict[str, Any]:
        return {
            "study": self.study,
            "rule": self.rule,
            "status": self.status,
            f"limit_{self.unit}": self.limit,
            "required_yield": self.required_yield,
            "errors": {
                name: {
                    "tolerance": e.tolerance,
                    "unit": e.unit,
                    "grade": e.grade,
                    "extrapolated": e.extrapolated or None,
                    "cost": e.cost,
                    "present_tolerance": e.present,
                    "present_cost": e.present_cost,
                    "cost_source": e.source,
                }
                for name, e in self.errors.items()
            },
            "total_cost": self.total_cost,
            "present_cost": self.present_cost,
            "optimality_gap": self.optimality_gap,
            "optimality_gap_reason": self.optimality_gap_reason,
            "marginal_cost": self.marginal_cost,
            "marginal_cost_reason": self.marginal_cost_reason,
            "requirement_slack": self.slack,
            "verified_yield": self.verified_yield.to_dict(),
            "verification": {
                "n": self.verify_n,
                "seed": self.verify_seed,
                "interval": self.verified_yield.interval,
            },
            "rules": {
                outcome.rule: {
                    "total_cost": outcome.total_cost,
                    "tolerances": outcome.tolerances,
                    "yield": outcome.conforming.to_dict(),
                    f"required_quantile_{self.unit}": outcome.required_quantile,
                    f"modelled_{self.unit}": outcome.modelled,
                    "note": outcome.note,
                }
                for outcome in self.comparison
            },
            "cost_curve": [{f"limit_{self.unit}": limit, "total_cost": cost} for limit, cost in self.cost_curve],
            "notes": list(self.notes),
        }

    def to_frame(self):
        """One row a tolerance."""
        import pandas as pd

        rows = [
            (name, e.unit, e.present, e.tolerance, e.grade, e.present_cost, e.cost) for name, e in self.errors.items()
        ]
        columns = ["error", "unit", "present tolerance", "tolerance", "grade", "present cost", "cost"]
        return pd.DataFrame(rows, columns=columns).set_index("error")


def allocate(
    study: Study | str | Path | None = None,
    rule: str | None = None,
    *,
    compare: bool | None = None,
    curve: Sequence[float] | None = None,
    seed: int = 1,
    engine: Engine | str | None = None,
    progress: Callable[[Sequence[str]], Iterable[str]] = iter,
) -> AllocateResult:
    """Least-cost tolerances of a study by `rule` ('worst_case', 'rss' or 'yield'; the study's own if None).

    `compare` also runs the other rules; `curve` gives the cost at multiples of the requirement; `progress` is told of
    each rule of a drive as it begins. Raises `hdopt.tolerance.allocate.Infeasible` where no allowed tolerances meet
    the requirement.
    """
    from hdopt.study.costs import AllocateSection

    study = loaded_study(study)
    settings = study.sections.get("allocate") or AllocateSection()
    rule = (rule or settings.rule).replace("-", "_")
    if rule not in ("worst_case", "rss", "yield"):
        raise HdoptError(unknown_name("allocation rule", rule, ("worst_case", "rss", "yield")))
    compare = settings.compare if compare is None else compare
    curve = settings.curve if curve is None else curve
    if "linear_stack" in study.sections:
        return _allocate_linear(study, rule, compare, curve, settings.verify_n, seed, engine)
    return _allocate_drive(study, rule, compare, curve, settings.verify_n, seed, engine, progress)


def verification_seed(seed: int) -> int:
    """The seed of the one verification: fixed by the run's seed, and none that the design has used."""
    return int(np.random.SeedSequence([seed, 0x7E5]).generate_state(1)[0])


def _items(study: Study, space: InputSpace) -> tuple[list[Item], dict[str, str]]:
    """The tolerances that have a cost, and where the costs come from."""
    from hdopt.tolerance.allocate import Item

    sections = [study.sections[name] for name in ("tolerances", "contributors") if name in study.sections]
    rows = {name: cost for section in sections for name, cost in section.costs().items() if name in space.tolerances}
    if not rows:
        raise HdoptError(
            "allocate needs costs: give at least one tolerance or contributor a cost, such as "
            'cost = { model = "reciprocal", a = 1, b = 0.01 }'
        )
    geometry = study.drive.geometry
    gear = geometry.module, geometry.module * geometry.flexspline_teeth
    items = []
    for name, row in rows.items():
        value = space.tolerances[name].value
        if value is None:
            raise HdoptError(f"{name} has a cost but no tolerance: bound it (upper), a direction has none to pay for")
        try:
            model = row.build(gear)
        except HdoptError as error:
            raise HdoptError(f"cost of {name}: {error}") from error
        low, high = (factor * value for factor in DEFAULT_REACH)
        if row.model in ("table", "piecewise"):
            low, high = model.range
        items.append(
            Item(
                name,
                model,
                value,
                low if row.tightest is None else row.tightest,
                high * (1 + 1e-12) if row.widest is None else row.widest,
            )
        )
    return items, {name: row.source for name, row in rows.items()}


def _allocate_drive(
    study: Study,
    rule: str,
    compare: bool,
    curve: Sequence[float],
    verify_n: int,
    seed: int,
    engine: Engine | str | None,
    progress: Callable[[Sequence[str]], Iterable[str]],
) -> AllocateResult:
    from hdopt.tolerance import allocate_response as methods

    stated = study_problem(study)
    items, sources = _items(study, stated.space)
    problem = methods.Problem(
        stated.response, stated.space, tuple(items), stated.limit, stated.required_yield, stated.unit, engine
    )
    by_rule = {
        "equal scaling": lambda: methods.allocate_by_equal_scaling(problem, seed),
        "worst_case": lambda: methods.allocate_by_worst_case(problem, seed),
        "rss": lambda: methods.allocate_by_rss(problem, seed),
        "yield": lambda: methods.allocate_by_yield(problem, seed, verify_n),
    }
    # the chosen rule first: where it has no answer the others are not asked
    order = [rule, *(name for name in by_rule if name != rule)] if compare else [rule]
    found: dict[str, RuleOutcome] = {}
    for name in progress(order):
        if name == rule:
            chosen = by_rule[name]()
            found[name] = _outcome(name, chosen)
        else:
            found[name] = _attempt(name, by_rule[name])
    outcomes = [_present(problem, seed), *(found[name] for name in by_rule)] if compare else []
    fresh = verification_seed(seed)
    verified = methods.verify(problem, chosen.tolerances, fresh, verify_n).conforming
    status = "verified" if verified.low >= stated.required_yield else "not verified"
    notes = [*stated.notes]
    if status == "not verified":
        notes.append(
            f"the {rule} rule's tolerances do not reach the yield: its lower bound is {verified.low:.5f}, required is "
            f"{stated.required_yield:g}"
        )
    points = methods.yield_cost_curve(problem, [factor * stated.limit for factor in curve], seed)
    solution = chosen.solution
    return AllocateResult(
        study=study.name,
        rule=rule,
        unit=stated.unit,
        limit=stated.limit,
        required_yield=stated.required_yield,
        status=status,
        errors=_allocated(items, sources, chosen, problem.by_name(problem.current)),
        total_cost=chosen.total_cost,
        present_cost=_present_cost(items, problem.by_name(problem.current)),
        optimality_gap=None,
        optimality_gap_reason="the peak-to-peak's quantile is not proven convex in the tolerances, so no lower bound "
        f"of the cost is proven; the last convex model closed its own gap to {solution.optimality_gap:.1g}",
        marginal_cost=chosen.marginal_cost,
        marginal_cost_reason=_marginal_reason("last convex model", stated.unit, chosen.marginal_cost, chosen.grades),
        slack=stated.limit - chosen.modelled,
        verified_yield=verified,
        verify_n=verify_n,
        verify_seed=fresh,
        comparison=tuple(outcomes),
        cost_curve=tuple(points),
        notes=tuple(notes),
    )


def _marginal_reason(of_what: str, unit: str, value: float | None, grades: dict[str, str]) -> str:
    if value is None:
        return "a choice among grades alone has no slope"
    return f"dual of the {of_what}, cost per {unit} of the limit" + (", grades held" if grades else "")


def _attempt(name: str, run) -> RuleOutcome:
    from hdopt.tolerance.allocate import Infeasible

    try:
        return _outcome(name, run())
    except Infeasible as error:
        nothing = Estimate(float("nan"), float("nan"), float("nan"))
        return RuleOutcome(name, float("nan"), {}, nothing, float("nan"), error.best_reachable, f"infeasible: {error}")


def _present(problem, seed: int) -> RuleOutcome:
    """The tolerances as they are, judged like every rule's."""
    from hdopt.tolerance.allocate_response import COMPARE_POINTS, verify

    tolerances = problem.by_name(problem.current)
    judged = verify(problem, tolerances, seed + 1, COMPARE_POINTS)
    cost = _present_cost(problem.items, tolerances)
    return RuleOutcome("present", cost, tolerances, judged.conforming, judged.required_quantile.value, None)


def _outcome(name: str, allocation: Allocation) -> RuleOutcome:
    return RuleOutcome(
        name,
        allocation.total_cost,
        allocation.tolerances,
        allocation.conforming,
        allocation.required_quantile.value,
        allocation.modelled,
    )


def _allocated(items, sources, chosen, present) -> dict[str, AllocatedError]:
    from hdopt.tolerance.cost import GradeTable

    rows = {}
    for item in items:
        tolerance = chosen.tolerances[item.name]
        grade = item.cost.nearest(tolerance) if isinstance(item.cost, GradeTable) else None
        rows[item.name] = AllocatedError(
            tolerance=tolerance,
            present=present[item.name],
            cost=chosen.costs[item.name],
            present_cost=_cost_or_nan(item, present[item.name]),
            unit="deg" if item.name.endswith("_deg") else "mm",
            grade=grade.name if grade else None,
            extrapolated=grade.extrapolated if grade else "",
            source=sources.get(item.name, ""),
        )
    return rows


def _cost_or_nan(item: Item, tolerance: float) -> float:
    """Cost of a present tolerance; NaN where it is finer than every grade."""
    try:
        return float(item.cost.cost(tolerance))
    except HdoptError:
        return float("nan")


def _present_cost(items: Sequence[Item], present: dict[str, float]) -> float:
    return float(sum(_cost_or_nan(item, present[item.name]) for item in items))


def _allocate_linear(
    study: Study,
    rule: str,
    compare: bool,
    curve: Sequence[float],
    verify_n: int,
    seed: int,
    engine: Engine | str | None,
) -> AllocateResult:
    from hdopt.tolerance.allocate import Item, cost_curve, rss_rule, solve, worst_case_rule
    from hdopt.tolerance.linear_stack import Dimension, linear_problem

    section = study.section("linear_stack")
    if rule == "yield":
        raise HdoptError("the yield rule is for drives; a linear stack takes the rule worst_case or rss")
    costed = {name: d for name, d in section.dimensions.items() if d.cost is not None}
    if not costed:
        raise HdoptError("allocate needs costs: give at least one dimension of [linear_stack] a cost")
    items = [
        Item(name, d.cost.build(None), d.tolerance, d.cost.tightest or 0.0, d.cost.widest or float("inf"))
        for name, d in costed.items()
    ]
    fixed = [d.sensitivity * d.tolerance for name, d in section.dimensions.items() if name not in costed]
    sensitivities = [d.sensitivity for d in costed.values()]
    makers = {"worst_case": worst_case_rule, "rss": rss_rule}
    requirement = makers[rule](sensitivities, section.gap_tolerance, fixed)
    present = {name: d.tolerance for name, d in costed.items()}
    fresh = verification_seed(seed)

    def judged(tolerances: dict[str, float], n: int) -> Stack:
        response, space = linear_problem(
            {
                name: Dimension(d.sensitivity, tolerances.get(name, d.tolerance), d.sigmas)
                for name, d in section.dimensions.items()
            }
        )
        return run_stack(
            response,
            space,
            limit=section.gap_tolerance,
            required_yield=section.required_yield,
            n=n,
            seed=fresh,
            engine=engine,
            unit=section.unit,
        )

    def outcome(name: str, tolerances: dict[str, float], cost: float, modelled: float | None) -> RuleOutcome:
        found = judged(tolerances, STACK_N)
        return RuleOutcome(name, cost, tolerances, found.conforming, found.required_quantile.value, modelled)

    solution = solve(items, requirement)
    outcomes = []
    if compare:
        outcomes.append(outcome("present", present, _present_cost(items, present), None))
        for name, make in makers.items():
            other = make(sensitivities, section.gap_tolerance, fixed)
            found = solution if name == rule else solve(items, other)
            value = other.value(np.array(list(found.tolerances.values())))
            outcomes.append(outcome(name, found.tolerances, found.total_cost, value))
    verified = judged(solution.tolerances, verify_n).conforming
    rows = _allocated(items, {name: d.cost.source for name, d in costed.items()}, solution, present)
    return AllocateResult(
        study=study.name,
        rule=rule,
        unit=section.unit,
        limit=section.gap_tolerance,
        required_yield=section.required_yield,
        status="optimal",
        errors={name: AllocatedError(**{**vars(row), "unit": section.unit}) for name, row in rows.items()},
        total_cost=solution.total_cost,
        present_cost=_present_cost(items, present),
        optimality_gap=solution.optimality_gap,
        optimality_gap_reason="against the Lagrangian lower bound"
        if not any(item.cost.discrete for item in items)
        else "against the mixed-integer problem's lower bound",
        marginal_cost=solution.marginal_cost,
        marginal_cost_reason=_marginal_reason("requirement", section.unit, solution.marginal_cost, solution.grades),
        slack=solution.slack,
        verified_yield=verified,
        verify_n=verify_n,
        verify_seed=fresh,
        comparison=tuple(outcomes),
        cost_curve=tuple(cost_curve(items, requirement, [factor * section.gap_tolerance for factor in curve])),
        notes=("the verified yield takes each dimension as normal, truncated at its tolerance",),
    )
