"""The acceptance sheet of one drive, and the table of many: records that commands make and reports show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any  # Any: values of JSON

from hdopt.arrays import Array
from hdopt.figures import drawn
from hdopt.files import ShownAsTable
from hdopt.recordings.capability import Gauge, Performance
from hdopt.recordings.decision import Decision
from hdopt.recordings.figures import Cells, Return
from hdopt.recordings.stiffness import Torsion

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure


@dataclass(frozen=True)
class Beat:
    """Peak-to-peak over the full beat, arcmin, with its 95 % interval, and `source`: "measured" or "model"."""

    value: float
    low: float
    high: float
    source: str


@dataclass(frozen=True)
class OrderLine:
    """One order: `symbol`, `order` (cycles per input turn), `amplitude_arcmin`, where it comes from, and whether the
    record's length lets it stand apart from its neighbours."""

    symbol: str
    order: float
    amplitude_arcmin: float
    origin: str
    separable: bool


@dataclass(frozen=True)
class Inspection(ShownAsTable):
    """The acceptance sheet of one drive; all figures in arcmin at the output unless another unit is named.

    `strain_wave` says whether it is of a harmonic drive: what is said of another gear does without its parts.

    What is None was not measured: `recording_peak_to_peak`, `rms`, `drift` and `uncertainty` (the standard one of a
    peak-to-peak) need an input that turns, `slope_per_deg` one that turns by ten degrees.
    """

    names: tuple[str, ...]
    serial: str
    conditions: str
    ratio: float
    turns: float
    one_turn: Array
    recording_peak_to_peak: float | None
    beat: Beat | None
    rms: float | None
    returned: Return | None
    repeatability: float | None
    slope_per_deg: float | None
    slope_arcsec_per_s: float | None
    orders: tuple[OrderLine, ...]
    drift: float | None
    torsion: Torsion | None
    starting_torque: float | None
    gauge: Gauge | None
    uncertainty: float | None
    checks: Mapping[str, str]
    limits: tuple[Decision, ...]
    understood: tuple[str, ...]
    warnings: tuple[str, ...]
    cells: tuple[Cells, ...] = field(repr=False)
    orientation: Mapping[str, Any] | None = None
    strain_wave: bool = True

    @property
    def missed(self) -> bool:
        """Whether any limit is missed beyond doubt."""
        return any(limit.verdict == "missed" for limit in self.limits)

    @property
    def locked(self) -> bool:
        """Whether the input was locked in every recording: then nothing is known of an error along its turns."""
        return not self.cells

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `hdopt inspect`; keys as in the interface contract."""
        turns = self.one_turn
        torsion = self.torsion
        return {
            "schema": 1,
            "files": list(self.names),
            "serial": self.serial,
            "conditions": self.conditions,
            "ratio": self.ratio,
            "turns": self.turns,
            "peak_to_peak_arcmin": {
                "one_turn": _spread(turns),
                "recording": self.recording_peak_to_peak,
                "beat": None if self.beat is None else vars(self.beat),
                "makers_figure": "beat",
            },
            "rms_arcmin": self.rms,
            "return_error_arcmin": None
            if self.returned is None
            else {"median": self.returned.median, "largest": self.returned.largest},
            "repeatability_arcmin": self.repeatability,
            "steepest_slope_arcmin_per_deg": self.slope_per_deg,
            "steepest_slope_arcsec_per_s": self.slope_arcsec_per_s,
            "orders": [vars(line) for line in self.orders],
            "drift_arcmin": self.drift,
            "stiffness_nm_per_rad": None if torsion is None else list(torsion.stiffness),
            "knees_nm": None if torsion is None else list(torsion.knees),
            "hysteresis_loss_arcmin": None if torsion is None else torsion.hysteresis_loss_arcmin,
            "starting_torque_nm": self.starting_torque,
            "gauge_arcmin": None if self.gauge is None else vars(self.gauge) | {"total": self.gauge.total},
            "uncertainty_arcmin": self.uncertainty,
            "orientation": None if self.orientation is None else dict(self.orientation),
            "checks": dict(self.checks),
            "limits": [
                {
                    "name": limit.name,
                    "value": limit.value,
                    "limit": limit.limit,
                    "met": limit.met,
                    "verdict": limit.verdict,
                    "uncertainty": limit.uncertainty,
                    "note": limit.note,
                }
                for limit in self.limits
            ],
            "understood": list(self.understood),
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """The figures as a table: name, value, unit."""
        import pandas as pd

        content = self.to_dict()
        rows: list[tuple[str, float | None, str]] = []
        spread = content["peak_to_peak_arcmin"]
        rows += [(f"peak_to_peak_one_turn_{k}", v, "arcmin") for k, v in (spread["one_turn"] or {}).items()]
        rows.append(("peak_to_peak_recording", spread["recording"], "arcmin"))
        for key in ("value", "low", "high"):
            rows.append((f"peak_to_peak_beat_{key}", (spread["beat"] or {}).get(key), "arcmin"))
        rows.append(("rms", self.rms, "arcmin"))
        for key, value in (content["return_error_arcmin"] or {}).items():
            rows.append((f"return_error_{key}", value, "arcmin"))
        rows.append(("repeatability", self.repeatability, "arcmin"))
        rows.append(("steepest_slope", self.slope_per_deg, "arcmin/deg"))
        rows += [(f"order_{line.symbol}", line.amplitude_arcmin, "arcmin") for line in self.orders]
        return pd.DataFrame(rows, columns=["figure", "value", "unit"])

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """The amplitude of every order. `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        bars = go.Bar(x=[line.symbol for line in self.orders], y=[line.amplitude_arcmin for line in self.orders])
        title = ", ".join(self.names)
        layout = {"title": title, "xaxis_title": "order", "yaxis_title": "amplitude, arcmin"}
        return drawn(go.Figure(bars, layout), backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: figures, orders, limits, checks."""
        import pandas as pd

        content = self.to_dict()
        found = {"figures": self.to_frame(), "orders": pd.DataFrame(content["orders"])}
        if self.limits:
            found["limits"] = pd.DataFrame(content["limits"])
        found["checks"] = pd.DataFrame(list(self.checks.items()), columns=["check", "outcome"])
        return found


def _spread(values: Array) -> dict[str, float] | None:
    if len(values) == 0:
        return None
    return {"mean": float(values.mean()), "largest": float(values.max()), "smallest": float(values.min())}


@dataclass(frozen=True)
class Unit:
    """One drive of a batch: figures in arcmin, `verdict` of its peak-to-peak ("" without a limit), or why its file
    could not be read: then there are no figures. `figure` says which peak-to-peak stands there: "beat", or "recording"
    where that is not known. What is None was not measured: all of it where the input was locked, `one_turn` where no
    whole turn was recorded, `return_error` where nothing came back."""

    name: str
    peak_to_peak: float | None = None
    figure: str = ""
    one_turn: float | None = None
    rms: float | None = None
    return_error: float | None = None
    verdict: str = ""
    missed: bool = False
    outlier: bool = False
    error: str = ""


@dataclass(frozen=True)
class Batch(ShownAsTable):
    """The drives of a batch in the order of their files, the `limit` of the peak-to-peak (arcmin) and the performance
    against it (None with fewer than eight drives or no limit)."""

    drives: tuple[Unit, ...]
    limit: float | None
    performance: Performance | None

    @property
    def missed(self) -> bool:
        """Whether any drive misses a limit beyond doubt."""
        return any(drive.missed for drive in self.drives)

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `hdopt inspect --each`."""
        return {
            "schema": 1,
            "drives": [vars(drive) for drive in self.drives],
            "limit_arcmin": self.limit,
            "performance": None if self.performance is None else vars(self.performance),
            "outliers": [drive.name for drive in self.drives if drive.outlier],
        }

    def to_frame(self) -> pd.DataFrame:
        """One row a drive."""
        import pandas as pd

        return pd.DataFrame([vars(drive) for drive in self.drives])

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """The peak-to-peak of every drive, with the limit. `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        read = [drive for drive in self.drives if drive.peak_to_peak is not None]
        points = go.Scatter(x=[d.name for d in read], y=[d.peak_to_peak for d in read], mode="markers")
        figure = go.Figure(points, {"xaxis_title": "drive", "yaxis_title": "peak-to-peak, arcmin"})
        return drawn(figure if self.limit is None else figure.add_hline(self.limit, line_dash="dash"), backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: the drives, and Ppk where there is one."""
        import pandas as pd

        found = {"drives": self.to_frame()}
        if self.performance is not None:
            found["performance"] = pd.DataFrame([vars(self.performance)])
        return found
