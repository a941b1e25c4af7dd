"""The diagnosis as a record: a verdict with everything that carries it, and its JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypedDict

from hdopt.diagnosis.checks.assessment import Evidence
from hdopt.diagnosis.checks.confounding import Confounding
from hdopt.diagnosis.checks.localization import Location
from hdopt.diagnosis.inference.base_fit import BaseEstimate
from hdopt.diagnosis.verdict.named_effect import NamedEffect
from hdopt.diagnosis.verdict.where import Where
from hdopt.effects.estimate import Parameter
from hdopt.figures import drawn
from hdopt.files import ShownAsTable

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure


class FitNumbers(TypedDict):
    """The numbers behind a verdict, arcmin rms: cross-validated errors of base, extended, generic and placebo model (a
    ripple of orders that the search of high orders found belongs to all of these but the base), on
    turns that no stage saw (`nested`; None where too few could be spared), on the same turns of what the search on all
    turns found, fitted to the others (`proposed`; None where these do not prefer it), and on whole conditions (None
    where there is one condition), and the noise floor; the chance of a false alarm.
    """

    heldout_rms_base_arcmin: float
    heldout_rms_extended_arcmin: float
    heldout_rms_generic_arcmin: float
    heldout_rms_placebo_arcmin: float
    heldout_nested_rms_base_arcmin: float | None
    heldout_nested_rms_arcmin: float | None
    heldout_proposed_rms_arcmin: float | None
    heldout_conditions_rms_base_arcmin: float | None
    heldout_conditions_rms_extended_arcmin: float | None
    noise_floor_arcmin: float
    false_alarm_p: float


@dataclass(frozen=True)
class Diagnosis(ShownAsTable):
    """A verdict with everything that carries it; `to_dict` is the JSON contract, and `rule` the name of the rule that
    gave the verdict.
    """

    verdict: str
    rule: str
    effects: tuple[NamedEffect, ...]
    ambiguous_with: tuple[tuple[str, ...], ...]
    separating_test: str | None
    base: BaseEstimate
    fit: FitNumbers
    below_detection: Mapping[str, float]
    warnings: tuple[str, ...]
    says: str
    where: Where | None
    located: tuple[Location, ...]
    confounded: tuple[Confounding, ...]
    each_condition: Mapping[str, tuple[float, float]]
    nuisances: Mapping[str, Parameter]
    evidence: Evidence

    def to_dict(self) -> dict[str, object]:
        """The JSON of `hdopt diagnose`."""
        result: dict[str, object] = {
            "schema": 1,
            "verdict": self.verdict,
            "says": self.says,
            "effects": [found.to_dict() for found in self.effects],
            "ambiguous_with": [list(ids) for ids in self.ambiguous_with],
            "separating_test": self.separating_test,
            "confounded": [pair.to_dict() for pair in self.confounded],
            "base": {
                "parameters": {name: p.to_dict() for name, p in self.base.parameters.items()},
                "rms_arcmin": self.base.rms_arcmin,
                "not_separable": list(self.base.open_combinations),
                "nuisances": {name: p.to_dict() for name, p in self.nuisances.items()},
            },
            "located": [location.to_dict() for location in self.located],
            "orientation": self.evidence.orientation.to_dict(),
            "scale": None if self.evidence.scale is None else self.evidence.scale.to_dict(),
            "fit": dict(self.fit),
            "heldout_conditions": [
                {"condition": name, "rms_base_arcmin": base, "rms_extended_arcmin": extended}
                for name, (base, extended) in self.each_condition.items()
            ],
            "below_detection": dict(self.below_detection),
            "warnings": list(self.warnings),
        }
        if self.where is not None:
            result["where"] = self.where
        return result

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """What each model leaves of turns that it did not see, with the noise floor. `backend` is "plotly" or
        "matplotlib"."""
        import plotly.graph_objects as go

        left = {
            "base": self.fit["heldout_rms_base_arcmin"],
            "extended": self.fit["heldout_rms_extended_arcmin"],
            "generic": self.fit["heldout_rms_generic_arcmin"],
            "placebo": self.fit["heldout_rms_placebo_arcmin"],
        }
        bars = go.Bar(x=list(left), y=list(left.values()))
        layout = {"title": self.verdict, "xaxis_title": "model", "yaxis_title": "held-out error, arcmin rms"}
        floor = {"y": self.fit["noise_floor_arcmin"], "line_dash": "dash", "annotation_text": "noise floor"}
        return drawn(go.Figure(bars, layout).add_hline(**floor), backend)

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter, of the effects that were named and of the base model, with its interval; an angle that
        is undefined, as the direction of an error that may be nil, has no numbers."""
        import pandas as pd

        found = [(effect.id, effect.confidence, effect.parameters) for effect in self.effects]
        rows = [
            (of, sure, name, *((math.nan, math.nan, math.nan) if p.undefined else (p.value, p.low, p.high)), p.unit)
            for of, sure, parameters in [*found, ("base model", None, self.base.parameters)]
            for name, p in parameters.items()
        ]
        return pd.DataFrame(rows, columns=["of", "confidence", "parameter", "value", "low", "high", "unit"])

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: parameters, figures of the fit, where structure was found, what is said."""
        import pandas as pd

        found = {
            "parameters": self.to_frame(),
            "fit": pd.DataFrame(list(self.fit.items()), columns=["figure", "value"]),
            "verdict": pd.DataFrame([("verdict", self.verdict), ("says", self.says)], columns=["of", "text"]),
        }
        if self.located:
            found["located"] = pd.DataFrame([location.to_dict() for location in self.located])
        return found
