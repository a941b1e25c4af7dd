"""Export of a wave generator: build, write under a passing name, read back, check, and only then name the file.

A file that has not passed its check never bears its name; a file of an earlier export stays as it was.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError, MissingLibrary, unknown_name
from hdopt.figures import drawn
from hdopt.files import JsonReady, ShownAsTable, is_special, replacing_all
from hdopt.geometry.budget import CalloutTables
from hdopt.geometry.dimensions import Dimension
from hdopt.geometry.formats import FORMATS
from hdopt.geometry.inspection import COLUMNS, Check, inspection_plan
from hdopt.geometry.job import make_job
from hdopt.geometry.mating import MatingRow
from hdopt.geometry.model import WaveGeneratorModel
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.step import Identity

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure


@dataclass(frozen=True)
class ExportResult(ShownAsTable):
    """What was written, as it was found in the files."""

    files: Mapping[str, Path]
    checks: Mapping[str, JsonReady]
    model: WaveGeneratorModel
    dimensions: tuple[Dimension, ...]
    identity: Identity
    mating: tuple[MatingRow, ...]
    plan: tuple[Check, ...]
    """The inspection plan."""
    replaced: tuple[str, ...] = ()
    """Kinds of file of which an earlier one bore the name."""

    @property
    def profile_deviation_um(self) -> float | None:
        """Largest deviation of a profile in any file from its analytic curve, um; None where no file shows one."""
        found = [check.get("max_profile_deviation_um") for check in self.checks.values()]
        return max((value for value in found if value is not None), default=None)

    @property
    def budgets_kept(self) -> bool:
        """Whether fits, clearances and tolerances keep the bounds of eccentricity and tilt."""
        return all(budget.met for budget in self.model.plan.budgets)

    def to_dict(self) -> JsonReady:
        step = self.checks.get("step", {})
        parts = step.get("parts") or [
            {"name": part.name, "volume_mm3": part.volume, "bounding_box_mm": list(part.size), "context": part.context}
            for part in self.model.parts
        ]
        first = next(iter(self.files.values()), None)
        return {
            "file": str(self.files.get("step", first)) if self.files else None,
            "files": {kind: str(path) for kind, path in self.files.items()},
            "replaced": list(self.replaced),
            "structure": self.model.structure.value,
            "parts": parts,
            "max_profile_deviation_um": self.profile_deviation_um,
            "dimensions": [dimension.to_dict() for dimension in self.dimensions],
            "mating": [row.to_dict() for row in self.mating],
            "budgets": [budget.to_dict() for budget in self.model.plan.budgets],
            "budgets_kept": self.budgets_kept,
            "checks": dict(self.checks),
            "assumptions": {assumption.key: assumption.value for assumption in self.model.assumptions},
            "notes": list(self.model.notes),
            "fingerprint": self.identity.fingerprint,
        }

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """The outlines that carry the flexible bearing, the major axis upwards. `backend` is "plotly" or
        "matplotlib"."""
        import plotly.graph_objects as go

        lines = []
        for part in self.model.profiled:
            x, y = part.contour.points(np.linspace(0, 2 * math.pi, 721)).T
            lines.append(go.Scatter(x=x, y=y, mode="lines", name=part.name))
        layout = {"title": self.identity.study, "xaxis_title": "x, mm", "yaxis_title": "y, mm, along the major axis"}
        return drawn(go.Figure(lines, layout).update_yaxes(scaleanchor="x"), backend)

    def to_frame(self) -> pd.DataFrame:
        """The inspection plan, one row a check."""
        import pandas as pd

        return pd.DataFrame([check.to_dict() for check in self.plan], columns=list(COLUMNS))

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: inspection plan, key dimensions, parts, what shaft and housing must keep."""
        import pandas as pd

        parts = [(part["name"], part["volume_mm3"], *part["bounding_box_mm"]) for part in self.to_dict()["parts"]]
        return {
            "inspection plan": self.to_frame(),
            "dimensions": pd.DataFrame([dimension.to_dict() for dimension in self.dimensions]),
            "parts": pd.DataFrame(parts, columns=["part", "volume_mm3", "x_mm", "y_mm", "z_mm"]),
            "mating": pd.DataFrame([row.to_dict() for row in self.mating]),
        }


def export_drive(
    drive: Drive,
    files: Mapping[str, str | Path],
    options: ExportOptions | None = None,
    name: str = "wave generator",
    bounds: Mapping[str, float] | None = None,
    contributors: CalloutTables | None = None,
) -> ExportResult:
    """Write a `drive`'s wave generator to `files` (a key of `FORMATS` -> path) and check each file from disk.

    `options` are sizes that were given (mm and deg as their names say), the others follow their rules. `name` is what
    the files call their study; `bounds` are tolerances by study key (mm or deg) or contributor, and `contributors` the
    study's callouts. Raises `HdoptError` for input that cannot be made, and `hdopt.geometry.check.CheckFailed` where a
    file fails its check: then no file of this export is left.
    """
    options = options or ExportOptions()
    for kind in files:
        if kind not in FORMATS:
            raise HdoptError(unknown_name("file format", kind, FORMATS))
    targets = {kind: Path(path) for kind, path in files.items()}
    files_meant = [path.resolve() for path in targets.values() if not is_special(path)]
    if len(set(files_meant)) < len(files_meant):
        raise HdoptError("two files of the export have the same name; give each its own")
    _require_suffixes(targets)
    job = make_job(drive, options, name, bounds, contributors)
    if any(FORMATS[kind].needs_solids for kind in targets):
        require_cadquery()
    checks = {}
    replaced = tuple(kind for kind, path in targets.items() if path.exists() and not is_special(path))
    with replacing_all(targets.values()) as paths:
        passing = dict(zip(targets, paths, strict=True))
        for kind, path in passing.items():
            FORMATS[kind].write(path, job)
        for kind, path in passing.items():
            checks[kind] = FORMATS[kind].check(path, job, targets[kind].name)
    return ExportResult(
        targets, checks, job.model, job.dimensions, job.identity, job.mating, inspection_plan(job), replaced
    )


def require_cadquery() -> None:
    """`HdoptError` that says what to install, where CadQuery's libraries do not load."""
    try:
        import cadquery  # noqa: F401
    except ImportError as error:
        if isinstance(error, ModuleNotFoundError) and error.name == "cadquery":
            says = "CadQuery is not installed; pip install cadquery"
        else:
            says = f"CadQuery cannot be loaded ({error}); on Debian install libgl1, then try again"
        raise MissingLibrary(says) from error


def _require_suffixes(targets: Mapping[str, Path]) -> None:
    """Each file bears the suffix of its kind."""
    for kind, path in targets.items():
        allowed = FORMATS[kind].suffixes
        if path.suffix.lower() not in allowed:
            raise HdoptError(
                f"--{kind} {path.name} does not end in {' or '.join(allowed)}; give it the suffix of what it will hold"
            )
