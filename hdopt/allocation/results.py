"""What an allocation leaves: tolerances, what each rule made of them, and how they were verified."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any  # Any: values of JSON

from hdopt.allocation.convex import Infeasible, Item, Solution
from hdopt.allocation.cost import GradeTable
from hdopt.allocation.rules import Allocation
from hdopt.errors import HdoptError
from hdopt.figures import drawn
from hdopt.files import ShownAsTable
from hdopt.tolerance.intervals import IntervalEstimate

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure


NOT_VERIFIED = "not verified"
"""Status of an allocation whose verification does not confirm what its rule promises."""


@dataclass(frozen=True)
class AllocatedError:
    """One tolerance: before and after, its grade where grades are used, and why that grade's standard does not reach
    here, if so; `unit` is that of the tolerance, `at_assumed_bound` the key of the cost that moves the bound that it
    stands at, where that bound is assumed."""

    tolerance: float
    present: float
    cost: float
    present_cost: float
    unit: str
    grade: str | None = None
    extrapolated: str = ""
    source: str = "assumed"
    at_assumed_bound: str = ""


@dataclass(frozen=True)
class RuleOutcome:
    """What one rule allocates, and what the real response makes of it."""

    rule: str
    total_cost: float
    tolerances: dict[str, float]
    conforming: IntervalEstimate
    required_quantile: float
    modelled: float | None
    note: str = ""


@dataclass(frozen=True)
class AllocateResult(ShownAsTable):
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
    verified_yield: IntervalEstimate
    verify_n: int
    verify_seed: int
    comparison: tuple[RuleOutcome, ...] = ()
    cost_curve: tuple[tuple[float, float], ...] = ()
    notes: tuple[str, ...] = field(default=())

    @property
    def accepted(self) -> bool:
        """Whether the verification confirms what the rule promises."""
        return self.status != NOT_VERIFIED

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
                    "at_assumed_bound": e.at_assumed_bound or None,
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

    def to_frame(self) -> pd.DataFrame:
        """One row a tolerance."""
        import pandas as pd

        rows = [
            (name, e.unit, e.present, e.tolerance, e.grade, e.present_cost, e.cost) for name, e in self.errors.items()
        ]
        columns = ["error", "unit", "present tolerance", "tolerance", "grade", "present cost", "cost"]
        return pd.DataFrame(rows, columns=columns).set_index("error")

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """Each tolerance as a share of the present one. `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        shares = [row.tolerance / row.present if row.present else math.nan for row in self.errors.values()]
        bars = go.Bar(y=list(self.errors), x=shares, orientation="h")
        now = "unknown" if math.isnan(self.present_cost) else f"{self.present_cost:.4g}"
        title = f"{self.study}: cost {self.total_cost:.4g}, now {now}"
        layout = {"title": title, "xaxis_title": "tolerance over the present one", "yaxis_title": "error"}
        return drawn(go.Figure(bars, layout).add_vline(1.0, line_dash="dash"), backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: tolerances, the rules side by side, cost over the limit."""
        import pandas as pd

        found = {"tolerances": self.to_frame().reset_index()}
        if self.comparison:
            rows = [
                (o.rule, o.total_cost, o.conforming.value, o.conforming.low, o.conforming.high, o.note)
                for o in self.comparison
            ]
            found["rules"] = pd.DataFrame(rows, columns=["rule", "cost", "yield", "yield low", "yield high", "note"])
        if self.cost_curve:
            found["cost curve"] = pd.DataFrame(self.cost_curve, columns=[f"limit_{self.unit}", "cost"])
        return found


def allocated_errors(
    items: Sequence[Item],
    sources: Mapping[str, str],
    chosen: Allocation | Solution,
    present: Mapping[str, float],
    unit: str = "",
    at: Mapping[str, str] | None = None,
) -> dict[str, AllocatedError]:
    """One record a tolerance of `items`: what was `chosen` beside what is `present`.

    `sources` says where each cost comes from; `unit` is that of all tolerances, by their names (deg, mm) if empty;
    `at` names the key of the bound that a tolerance stands at, where it is assumed.
    """
    rows = {}
    for item in items:
        tolerance = chosen.tolerances[item.name]
        grade = item.cost.nearest(tolerance) if isinstance(item.cost, GradeTable) else None
        rows[item.name] = AllocatedError(
            tolerance=tolerance,
            present=present[item.name],
            cost=chosen.costs[item.name],
            present_cost=cost_or_nan(item, present[item.name]),
            unit=unit or unit_of(item.name),
            grade=grade.name if grade else None,
            extrapolated=grade.extrapolated if grade else "",
            source=sources.get(item.name, ""),
            at_assumed_bound=(at or {}).get(item.name, ""),
        )
    return rows


def infeasible(rule: str, error: Infeasible) -> RuleOutcome:
    """What stands beside the other rules for a `rule` that ended in `error`."""
    nothing = IntervalEstimate(math.nan, math.nan, math.nan)
    return RuleOutcome(rule, math.nan, {}, nothing, math.nan, error.best_reachable, f"infeasible: {error}")


def unit_of(name: str) -> str:
    """Unit of the tolerance of a drive's error or contributor, by its `name`."""
    return "deg" if name.endswith("_deg") else "mm"


def cost_or_nan(item: Item, tolerance: float) -> float:
    """Cost of `tolerance` by the cost model of `item`; NaN where it is finer than the cost data."""
    try:
        return float(item.cost.cost(tolerance))
    except HdoptError:
        return float("nan")


def cost_of(items: Sequence[Item], present: Mapping[str, float]) -> float:
    """Cost of the tolerances `present` of all `items`; NaN where one is finer than the cost data."""
    return float(sum(cost_or_nan(item, present[item.name]) for item in items))


def finer_than_data(items: Sequence[Item], present: Mapping[str, float]) -> str:
    """Which of the tolerances `present` of `items` are finer than the cost data, so that the cost is unknown; '' for
    none."""
    names = [item.name for item in items if math.isnan(cost_or_nan(item, present[item.name]))]
    return f"cost unknown: {', '.join(names)} finer than the cost data" if names else ""


def present_notes(items: Sequence[Item], present: Mapping[str, float]) -> tuple[str, ...]:
    """The note of `finer_than_data`, said of the `present` tolerances of `items`; none where every cost is known."""
    finer = finer_than_data(items, present)
    return (f"present {finer}",) if finer else ()


def marginal_reason(of_what: str, unit: str, value: float | None, grades: Mapping[str, str]) -> str:
    """What the marginal cost `value` is: a dual `of_what`, per `unit` of the limit, with `grades` held or not."""
    if value is None:
        return "a choice among grades alone has no slope"
    return f"dual of the {of_what}, cost per {unit} of the limit" + (", grades held" if grades else "")


def not_reached(rule: str, verified: IntervalEstimate, required_yield: float) -> str:
    """What is said where the yield that was `verified` of the tolerances by `rule` is below the `required_yield`."""
    return (
        f"the {rule} rule's tolerances do not reach the yield: its lower bound is {verified.low:.5f}, "
        f"required is {required_yield:g}"
    )
