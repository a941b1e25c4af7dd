"""What a search leaves: designs in plain numbers, fronts, the choice, and how sure it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any  # Any: values of JSON

from hdopt.figures import drawn
from hdopt.files import ShownAsTable
from hdopt.optimize.region_records import Regions
from hdopt.optimize.setup import Setup
from hdopt.optimize.solve import Solution

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure


@dataclass(frozen=True)
class DesignRecord:
    """One design in plain numbers: its choices, the variables by their study key, and every quantity."""

    profile: str
    structure: str
    variables: dict[str, float]
    quantities: dict[str, float]
    feasible: bool = True
    broken_limits: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    @property
    def name(self) -> str:
        return f"{self.profile}, {self.structure}"


@dataclass(frozen=True)
class Front:
    """Non-dominated designs between two quantities, and each combination's own front."""

    objective: str
    second: str
    designs: tuple[DesignRecord, ...]
    by_combination: dict[str, tuple[DesignRecord, ...]]
    hypervolume: float
    reference: tuple[float, float]


@dataclass(frozen=True)
class SearchResult(ShownAsTable):
    """What a search found. `best` is feasible unless `feasible` says no; then it is the design nearest to the limits.

    `active` lists limits and bounds that hold the best design, with the price of each; `optimality_residual` is how far
    the first-order conditions are from holding there, as a share of the objective's slope. Where no design keeps all
    limits there is no optimum: nothing is listed, and the residual is not a number.
    """

    study: str
    objective: str
    second: str | None
    feasible: bool
    best: DesignRecord
    baseline: DesignRecord
    combinations: tuple[DesignRecord, ...]
    fronts: tuple[Front, ...]
    limits: tuple[str, ...]
    active: tuple[dict[str, Any], ...]
    optimality_residual: float
    evaluations: int
    impossible: int
    algorithm: str
    stopped_because: str
    interrupted: bool
    setup: Setup
    solutions: tuple[Solution, ...]
    notes: tuple[str, ...] = ()
    regions: Regions | None = None
    """How far each constant of the trade may go before another choice is the better; None where it was not asked."""

    @property
    def chosen(self) -> Solution:
        """The solution behind `best`."""
        return choose(self.solutions)

    @property
    def front(self) -> tuple[DesignRecord, ...]:
        """The front of the study's own objective, the nominal one where both were made."""
        return self.fronts[0].designs if self.fronts else ()

    def to_dict(self) -> dict[str, Any]:
        return {
            "study": self.study,
            "objective": self.objective,
            "second_objective": self.second,
            "feasible": self.feasible,
            "best": self.best.to_dict(),
            "baseline": self.baseline.to_dict(),
            "front": [design.to_dict() for design in self.front],
            "fronts": [
                {
                    "objective": found.objective,
                    "second_objective": found.second,
                    "hypervolume": found.hypervolume,
                    "reference": list(found.reference),
                    "designs": [design.to_dict() for design in found.designs],
                }
                for found in self.fronts
            ],
            "combinations": [design.to_dict() for design in self.combinations],
            "limits": list(self.limits),
            "active": list(self.active),
            "optimality_residual": self.optimality_residual,
            "evaluations": self.evaluations,
            "impossible_designs": self.impossible,
            "algorithm": self.algorithm,
            "stopped_because": self.stopped_because,
            "notes": list(self.notes),
            **({} if self.regions is None else {"regions": self.regions.to_dict()}),
        }

    def to_frame(self) -> pd.DataFrame:
        """The front as a table; the best design of each combination where no front was traced."""
        return _designs(self.front or self.combinations)

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """The front between the two objectives, or the best of each combination where none was traced.
        `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        designs = [d for d in self.front or self.combinations if self.objective in d.quantities]
        second = self.second or self.objective
        points = go.Scatter(
            x=[d.quantities[self.objective] for d in designs],
            y=[d.quantities.get(second) for d in designs],
            text=[d.name for d in designs],
            mode="markers",
        )
        layout = {"title": self.study, "xaxis_title": self.objective, "yaxis_title": second}
        return drawn(go.Figure(points, layout), backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: the front if any, the best design and the present one, the best of each
        combination, and what holds the best."""
        import pandas as pd

        found = {"front": _designs(self.front)} if self.front else {}
        found["combinations"] = _designs(self.combinations)
        found["best and present"] = _designs((self.best, self.baseline))
        if self.active:
            found["active limits"] = pd.DataFrame(list(self.active))
        return found


def _designs(designs: Sequence[DesignRecord]) -> pd.DataFrame:
    """One row a design."""
    import pandas as pd

    return pd.DataFrame(
        [
            {
                "profile": d.profile,
                "structure": d.structure,
                **d.variables,
                **d.quantities,
                "feasible": d.feasible,
                "broken limits": "; ".join(d.broken_limits),
            }
            for d in designs
        ]
    )


@dataclass(frozen=True)
class QuantileCheck:
    """The best design's peak-to-peak that the share `quantile` of fresh drives keeps: `quantile_arcmin` of so many
    `drives`, with its 95 % interval `low` to `high`; `searched_arcmin` is what the search found, None where it was not
    about the quantile."""

    quantile: float
    quantile_arcmin: float
    low: float
    high: float
    searched_arcmin: float | None
    drives: int


@dataclass(frozen=True)
class Verification:
    """The best design's peak-to-peak (arcmin) by the exact geometry and by the compiled kernel, and its quantile over
    fresh drives; `fresh` is None where the study has no tolerances."""

    exact_arcmin: float
    kernel_arcmin: float
    fresh: QuantileCheck | None

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready, in one level; without tolerances the numbers of the quantile are None, of 0 drives."""
        fresh = self.fresh
        found = dict.fromkeys(field.name for field in fields(QuantileCheck)) if fresh is None else asdict(fresh)
        none = {"drives": 0} if fresh is None else {}
        return {"exact_arcmin": self.exact_arcmin, "kernel_arcmin": self.kernel_arcmin, **found, **none}


def choose(solutions: Sequence[Solution]) -> Solution:
    """The least of the feasible `solutions` in the objective with what structures cost; where none is feasible, the one
    nearest to the limits: by the one that it breaks most, then by all together."""
    return min(solutions, key=lambda s: ((0.0, 0.0) if s.feasible else s.broken, s.weighed))
