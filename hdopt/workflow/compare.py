"""`hdopt compare`: a measured cam against the one that a study designs."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal  # Any: values of JSON

import numpy as np

from hdopt.drive.profiles import MeasuredProfile
from hdopt.errors import HdoptError, unknown_name
from hdopt.figures import drawn
from hdopt.files import ShownAsTable, replacing_all, write_text
from hdopt.geometry.compare import CamFit, FitMethod, fit_cam, read_cam, table_of
from hdopt.geometry.contour import Contour
from hdopt.geometry.dimensions import tolerance_bounds
from hdopt.geometry.job import Job, make_job
from hdopt.study import AnyStudy, Study, as_study
from hdopt.workflow.export import export_options
from hdopt.workflow.output_files import Files, checked_files, write_table_files
from hdopt.workflow.placed import numbers_named

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure

Surface = Literal["cam", "bearing"]
FILES = ("csv", "xlsx", "plot", "study")


@dataclass(frozen=True)
class CompareResult(ShownAsTable):
    """How a measured cam lies against its zone. `zone` is the full width of the profile's tolerance zone, mm.

    `eccentricity_allowed` (mm) is what the study's tolerance of the wave generator's eccentricity lets the cam lie off
    the axis that it was measured from; None where nothing bounds it.
    """

    study: str
    part: str
    surface: Surface
    probe_radius: float
    zone: float
    fit: CamFit
    eccentricity_allowed: float | None
    method: FitMethod = "least_squares"
    """How the points were laid onto the cam; the verdict is that of this fit."""
    minimum_zone: float = 0.0
    """Least width of a zone about the cam that holds every point, mm."""

    @property
    def eccentricity_met(self) -> bool | None:
        """Whether the best fit lies within what its eccentricity may be; None where nothing bounds it."""
        return None if self.eccentricity_allowed is None else self.eccentricity <= self.eccentricity_allowed

    @property
    def met(self) -> bool:
        """Whether the cam keeps its profile's zone. Its location is told beside (`eccentricity_met`): the zero of a
        table may be the machine's and not the bore's."""
        return self.fit.largest <= self.zone / 2

    @property
    def eccentricity(self) -> float:
        """How far the best fit lies off the axis that was measured from, mm."""
        return math.hypot(*self.fit.shift)

    def to_dict(self) -> dict[str, Any]:
        allowed = self.eccentricity_allowed
        return {
            "study": self.study,
            "part": self.part,
            "surface": self.surface,
            "probe_radius_mm": self.probe_radius,
            "points": len(self.fit.angles),
            "zone_um": 1e3 * self.zone,
            "deviation_um": {"largest": 1e3 * self.fit.largest, "rms": 1e3 * self.fit.rms},
            "minimum_zone_um": 1e3 * self.minimum_zone,
            "fit": {
                "method": self.method,
                "rotation_deg": math.degrees(self.fit.rotation),
                "shift_um": [1e3 * value for value in self.fit.shift],
            },
            "noise_um": 1e3 * self.fit.noise,
            "eccentricity_um": 1e3 * self.eccentricity,
            "eccentricity_allowed_um": None if allowed is None else 1e3 * allowed,
            "eccentricity_met": self.eccentricity_met,
            "met": self.met,
        }

    def to_frame(self) -> pd.DataFrame:
        """One row a point: angle in degrees, deviation in um."""
        import pandas as pd

        return pd.DataFrame(table_of(self.fit))

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """The deviation of every point over the angle, with the profile's zone.
        `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        table = self.to_frame()
        points = go.Scatter(x=table["angle_deg"], y=table["deviation_um"], mode="lines")
        layout = {"title": self.study, "xaxis_title": "angle, deg", "yaxis_title": "deviation, um"}
        figure = go.Figure(points, layout)
        figure = figure.add_hline(500 * self.zone, line_dash="dash").add_hline(-500 * self.zone, line_dash="dash")
        return drawn(figure, backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet."""
        return {"deviations": self.to_frame()}


@numbers_named
def compare(
    study: AnyStudy,
    measured: str | Path,
    *,
    probe_radius_mm: float = 0.0,
    surface: Surface = "cam",
    part: str | None = None,
    fit: FitMethod = "least_squares",
    files: Files | None = None,
) -> CompareResult:
    """Lay the measured cam of a CSV file onto the cam that a `study`, or its name or path, designs.

    `measured` has angle_deg,radius_mm or x_mm,y_mm of the centre of a ball of `probe_radius_mm` mm; `surface` says
    whether the cam itself was measured or the outside of the bearing on it; `part` is one of two discs. `fit` lays the
    points onto the cam with the least sum of squares, or with the least largest deviation ("minimum_zone", ISO 1101),
    and the verdict is that fit's. `files` to write: {"csv": PATH} or {"xlsx": PATH} the deviation of every point,
    {"plot": PATH} an SVG of them, {"study": PATH} the study with the measured cam. Raises `HdoptError` for points that
    are not of this cam, and before any work where a file cannot be written.
    """
    study, wanted = as_study(study), checked_files(files, FILES)
    bounds = tolerance_bounds(study.data)
    job = make_job(study.drive, export_options(study), study.name, bounds, study.data.get("contributors"))
    name, contour = _nominal(job, surface, part)
    points = read_cam(Path(measured))
    methods: tuple[FitMethod, ...] = ("least_squares", "minimum_zone")
    fits = {method: fit_cam(points, contour, probe_radius_mm, method, str(measured)) for method in methods}
    if fit not in fits:
        raise HdoptError(unknown_name("fit", fit, fits))
    allowed, least = bounds.get("wg_eccentricity_mm"), 2 * fits["minimum_zone"].largest
    zone = job.model.profile_zone
    result = CompareResult(study.name, name, surface, probe_radius_mm, zone, fits[fit], allowed, fit, least)
    write_comparison(result, wanted, study, str(measured))
    return result


def write_comparison(result: CompareResult, files: Mapping[str, Path], study: Study, source: str) -> Path | None:
    """Write of a comparison `result` what `files` asks for ("csv", "xlsx", "plot", "study" -> path).

    `study` is the one that the cam was laid onto, `source` the name of the measured file for the plot. Returns the path
    of the cam's table beside a study, None where none was asked for. Raises `HdoptError` where a file cannot be
    written.
    """
    write_table_files(result, files)
    if "plot" in files:
        from hdopt.geometry.deviation_plot import deviation_plot

        title = f"{result.part} of {result.study}, measured"
        write_text(files["plot"], deviation_plot(result.fit, result.zone, title, source))
    return write_measured_study(study, result, files["study"]) if "study" in files else None


def _nominal(job: Job, surface: Surface, part: str | None) -> tuple[str, Contour]:
    """The part that was measured and the contour that the points are to lie on."""
    carriers = {item.name: item.contour for item in job.model.profiled}
    name = part or next(iter(carriers))
    if name not in carriers:
        raise HdoptError(unknown_name("part with a profile", name, carriers))
    contour = carriers[name]
    if surface == "bearing":
        contour = contour.inward(-(job.drive.wave_generator.bearing_thickness or 0.0))
    return name, contour


def write_measured_study(study: Study, result: CompareResult, path: Path) -> Path:
    """Write the `study` to `path` with the measured cam of `result` in place of its profile, and the cam's table beside
    it; both files or neither, and neither where `hdopt ke` would refuse the table.

    The table's name is the study file's with `-cam.csv` for its ending; it keeps the cam's own eccentricity about the
    axis that it was measured from. Returns the table's path. Raises `HdoptError` where a file cannot be written.
    """
    import tomlkit

    table = path.with_name(f"{path.stem}-cam.csv")
    text = _table_of_cam(result)
    data = {name: dict(section) if isinstance(section, dict) else section for name, section in study.data.items()}
    generator = dict(study.data["wave_generator"])
    for key in ("semi_major_mm", "semi_minor_mm", "wrap_angle_deg"):
        generator.pop(key, None)
    noise = round(1e3 * result.fit.noise, 6)
    generator |= {"profile": "measured", "file": table.name, "surface": result.surface, "noise_um": noise}
    data["wave_generator"] = generator
    with replacing_all((table, path)) as (new_table, new_study):
        new_table.write_bytes(text.encode())
        new_study.write_bytes(tomlkit.dumps(data).encode("utf-8", "surrogateescape"))
    return table


def _table_of_cam(result: CompareResult) -> str:
    """The measured cam of a `result` as the CSV that a study reads. Raises `HdoptError` where none would take it."""
    points = sorted((math.degrees(math.atan2(x, y)) % 360, math.hypot(x, y)) for x, y in result.fit.points.tolist())
    rows = [(f"{angle:.9g}", f"{radius:.7f}") for angle, radius in points]
    angles, radii = np.array(rows, dtype=float).T
    MeasuredProfile(np.radians(angles), radii, source="of the measured cam, as its study is to have it,")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("angle_deg", "radius_mm"))
    writer.writerows(rows)
    return text.getvalue()
