"""What a stack and a sensitivity analysis of a study leave."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any  # Any: values of JSON

from hdopt.errors import HdoptError
from hdopt.figures import drawn
from hdopt.files import ShownAsTable
from hdopt.kinematics.model_error import ModelError
from hdopt.tolerance.sensitivity import Shapley, Sobol
from hdopt.tolerance.stack import Stack
from hdopt.tolerance.tail import Tail
from hdopt.tolerance.worst_case import WorstCase

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure


@dataclass(frozen=True)
class StackResult(ShownAsTable):
    """A stack with what was asked for beside it."""

    study: str
    stack: Stack
    worst_case: WorstCase | None = None
    tail: Tail | None = None
    notes: tuple[str, ...] = ()
    method: str | None = None
    """closed form or exact: the geometry of the drives' kinematic error; None where there is no drive."""
    model_error: ModelError | None = None
    """Of the closed form against the exact geometry, for a pilot of the drives."""
    pitch: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    """By spline, the figures of teeth that were drawn from tolerances of pitch."""

    def to_dict(self) -> dict[str, Any]:
        result = {"study": self.study, "method": self.method, **self.stack.to_dict()}
        if self.model_error is not None:
            result["model_error"] = self.model_error.to_dict()
        if self.pitch:
            result["pitch"] = {spline: dict(figures) for spline, figures in self.pitch.items()}
        result["notes"] = [*result["notes"], *self.notes]
        if self.worst_case is not None:
            result[f"worst_case_{self.stack.unit}"] = self.worst_case.to_dict()
        if self.tail is not None:
            result["tail"] = self.tail.to_dict()
        return result

    def to_frame(self) -> pd.DataFrame:
        """One row a figure, with its interval."""
        return self.stack.to_frame()

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """The distribution of the drives, with the limit. `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        stack = self.stack
        edges, counts = stack.histogram
        bars = go.Bar(x=(edges[1:] + edges[:-1]) / 2, y=counts, width=edges[1:] - edges[:-1], name="drives")
        title = f"{self.study}: {100 * stack.conforming.value:.4g} % within {stack.limit:g} {stack.unit}"
        figure = go.Figure(bars, {"title": title, "xaxis_title": f"response, {stack.unit}", "yaxis_title": "drives"})
        return drawn(figure.add_vline(stack.limit, line_dash="dash", annotation_text="limit"), backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: figures with intervals, contributions; tail and worst case where asked for."""
        import pandas as pd

        unit, shares = self.stack.unit, self.stack.linearisation.shares
        found = {
            "stack": self.to_frame().reset_index(),
            "contributions": pd.DataFrame(list(shares.items()), columns=["input", "share of the variance"]),
        }
        if self.worst_case is not None:
            worst = [(self.worst_case.value, self.worst_case.bound, unit)]
            found["worst case"] = pd.DataFrame(worst, columns=["found", "no drive exceeds", "unit"])
        if self.tail is not None:
            t = self.tail
            columns = ["limit", "unit", "probability above", "low", "high", "method"]
            found["tail"] = pd.DataFrame([(t.limit, unit, t.probability, t.low, t.high, t.method)], columns=columns)
        return found


@dataclass(frozen=True)
class SobolResult(ShownAsTable):
    """Sobol' indices of independent inputs, or Shapley effects; either may be absent."""

    study: str
    sobol: Sobol | None = None
    shapley: Shapley | None = None
    notes: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        result: dict[str, Any] = {"study": self.study}
        if self.shapley is not None:
            result |= self.shapley.to_dict()
        if self.sobol is not None:
            result |= self.sobol.to_dict()
        return {"groups": {}, **result, "notes": list(self.notes)}

    def to_frame(self) -> pd.DataFrame:
        """One row an input or group; of the Shapley effects where there are no Sobol' indices."""
        table = self.sobol or self.shapley
        assert table is not None, "a result holds indices, effects, or both"
        return table.to_frame()

    def to_salib(self) -> Any:
        """The Sobol' indices of inputs and pairs as SALib's own result: a `ResultDict` with `to_df()` and `plot()`,
        intervals as half widths. Raises `HdoptError` where there are Shapley effects alone."""
        if self.sobol is None:
            raise HdoptError(
                "correlated inputs have no Sobol' indices, and SALib has no Shapley effects: this result is to_frame() "
                "alone"
            )
        from hdopt.tolerance.sobol_in_salib import sobol_in_salib

        return sobol_in_salib(self.sobol)

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """First-order and total index of every input, or its Shapley effect, with intervals.
        `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        table = self.to_frame()
        measures = {"Shapley effect": ("low", "high")}
        if self.sobol is not None:
            table = table[table["kind"] == "input"]
            measures = {"S1": ("S1 low", "S1 high"), "ST": ("ST low", "ST high")}
        bars = []
        for name, (low, high) in measures.items():
            value = table[name]
            ends = {"type": "data", "array": table[high] - value, "arrayminus": value - table[low]}
            bars.append(go.Bar(y=table.index, x=value, error_x=ends, orientation="h", name=name))
        layout = {"title": self.study, "xaxis_title": "share of the variance", "yaxis_title": "input"}
        return drawn(go.Figure(bars, layout), backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: indices, those of pairs, Shapley effects, as far as there are any."""
        import pandas as pd

        found = {}
        if self.sobol is not None:
            found["indices"] = self.sobol.to_frame().reset_index()
            pairs = [(a, b, e.value, e.low, e.high) for (a, b), e in self.sobol.second.items()]
            if pairs:
                found["pairs"] = pd.DataFrame(pairs, columns=["input", "with", "S2", "S2 low", "S2 high"])
        if self.shapley is not None:
            found["Shapley effects"] = self.shapley.to_frame().reset_index()
        return found
