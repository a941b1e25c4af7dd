"""Diagnoses of many drives of one type: one row a drive, and how often each verdict and each effect came."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any  # Any: values of JSON

from hdopt.figures import drawn
from hdopt.files import ShownAsTable

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure

    from hdopt.diagnosis.verdict.diagnosis import Diagnosis

NUMBERS = ("heldout_rms_base_arcmin", "heldout_rms_extended_arcmin", "noise_floor_arcmin", "false_alarm_p")
"""What a row holds of the numbers behind a verdict."""


@dataclass(frozen=True)
class DiagnosedDrive:
    """One drive of a batch: its `verdict` and what that `says`, the `effects` named with the confidence in each, and
    `content`, the JSON of its diagnosis; or the `error`, why there is none."""

    name: str
    verdict: str = ""
    says: str = ""
    effects: Mapping[str, float] = field(default_factory=dict)
    content: Mapping[str, Any] | None = None
    error: str = ""

    @classmethod
    def of(cls, name: str, diagnosis: Diagnosis) -> DiagnosedDrive:
        """The row of the drive `name` that its `diagnosis` makes."""
        effects = {found.id: found.confidence for found in diagnosis.effects}
        return cls(name, diagnosis.verdict, diagnosis.says, effects, diagnosis.to_dict())

    def number(self, name: str) -> float | None:
        """The number `name` behind the verdict (a key of `fit` in the JSON); None where there is no diagnosis."""
        return None if self.content is None else self.content["fit"][name]


@dataclass(frozen=True)
class DiagnosedBatch(ShownAsTable):
    """The diagnosed `drives` in the order of their files."""

    drives: tuple[DiagnosedDrive, ...]

    @property
    def verdicts(self) -> dict[str, int]:
        """How many drives came to each verdict."""
        return dict(sorted(Counter(drive.verdict for drive in self.drives if not drive.error).items()))

    @property
    def effects(self) -> dict[str, int]:
        """In how many drives each effect was named, the most frequent first."""
        return dict(Counter(name for drive in self.drives for name in sorted(drive.effects)).most_common())

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `hdopt diagnose --each`."""
        return {
            "schema": 1,
            "drives": [{"name": drive.name, "error": drive.error, "diagnosis": drive.content} for drive in self.drives],
            "verdicts": self.verdicts,
            "effects": self.effects,
        }

    def to_frame(self) -> pd.DataFrame:
        """One row a drive."""
        import pandas as pd

        rows = [
            {"name": drive.name, "verdict": drive.verdict}
            | {"effects": ", ".join(f"{name} ({confidence:.2f})" for name, confidence in drive.effects.items())}
            | {name: drive.number(name) for name in NUMBERS}
            | {"error": drive.error}
            for drive in self.drives
        ]
        return pd.DataFrame(rows)

    def parameters(self) -> pd.DataFrame:
        """One row a parameter of a named effect, with its interval and its drive."""
        import pandas as pd

        rows = [
            (drive.name, effect["id"], name, p["value"], p["low"], p["high"], p["unit"])
            for drive in self.drives
            for effect in (drive.content or {"effects": ()})["effects"]
            for name, p in effect["parameters"].items()
        ]
        return pd.DataFrame(rows, columns=["name", "effect", "parameter", "value", "low", "high", "unit"])

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """What the base and the extended model leave of each drive's turns that they did not see. `backend` is "plotly"
        or "matplotlib"."""
        import plotly.graph_objects as go

        done = [drive for drive in self.drives if not drive.error]
        figure = go.Figure(layout={"xaxis_title": "drive", "yaxis_title": "held-out error, arcmin rms"})
        for model in ("base", "extended"):
            left = [drive.number(f"heldout_rms_{model}_arcmin") for drive in done]
            figure.add_trace(go.Scatter(x=[drive.name for drive in done], y=left, mode="markers", name=model))
        return drawn(figure, backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: the drives, and the parameters of what was found in them."""
        return {"drives": self.to_frame(), "parameters": self.parameters()}
