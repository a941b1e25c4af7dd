"""`hdopt explore`: one page with the study's drive under sliders, from the closed form computed in the browser."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: the JSON of the page, as `hdopt.files.to_json` takes it

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import ERROR_NAMES, PHASE_OF, DriveErrors, study_key
from hdopt.drive.geometry import Drive, Structure
from hdopt.drive.profiles import TwoDisk
from hdopt.errors import HdoptError
from hdopt.files import ShownAsTable, claim_output, write_text
from hdopt.recordings.orders import model_orders
from hdopt.report.explorer import render_explorer
from hdopt.report.sections.words import ERROR_LABELS, ERROR_SYMBOLS, label
from hdopt.study import AnyStudy, Study, as_study
from hdopt.study.tolerances import RequirementSection, TolerancesBase
from hdopt.study.write import study_toml
from hdopt.tolerance.sampling import SAMPLINGS
from hdopt.words import counted
from hdopt.workflow.placed import numbers_named
from hdopt.workflow.stack import drive_problem_of, needed_beside_the_drive
from hdopt.workflow.steps.profiles import alternatives

if TYPE_CHECKING:
    import pandas as pd

EXPLORER_FILE = "explorer.html"
CLOUD_N = 2048
"""Drives of the cloud: their yield is known within about 0.003, and a browser has them anew in a few seconds."""
MOST_CLOUD = 20_000
"""More would take the page beyond 6 MB and the browser minutes."""
REACH = 3.0
"""Sliders go to this many times the tolerance: so far the closed form holds (`hdopt.kinematics.closed_form`)."""
USUAL_MM, USUAL_DEG = 0.01, 0.1
"""Taken for the tolerance of an error that has none and is nil: those of the shipped drive are of this size."""
PRESSURE_ANGLE_DEG = (5.0, 30.0)
WIDTH_REACH = (0.4, 2.0)
"""Of the study's own width."""
WRAP_ANGLE_DEG = (0.0, 80.0)
GROUPS = {
    "axis": "Input axis",
    "wg": "Wave generator",
    "cs": "Circular spline teeth",
    "fs": "Flexspline teeth",
}
"""Heading of the sliders of each error, by the first part of its name."""
PREFIXES = ("Axis ", "WG ", "CS tooth ", "FS tooth ")
"""Of the labels of errors: what their heading says already."""


@dataclass(frozen=True)
class ExploreResult(ShownAsTable):
    """The page that was written: its `file`, how many `drives` of the tolerances its cloud has, and `notes` of what it
    leaves out. `cloud` are their errors in the units of a study file with their peak-to-peak (arcmin) in the last
    column, shape (drives, 13)."""

    study: str
    file: Path
    drives: int
    notes: tuple[str, ...]
    cloud: Array = field(default_factory=lambda: np.empty((0, len(ERROR_NAMES) + 1)), compare=False, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready, with the file as text and without the cloud."""
        return {"study": self.study, "file": str(self.file), "drives": self.drives, "notes": list(self.notes)}

    def to_frame(self) -> pd.DataFrame:
        """The cloud, one row a drive: its errors by their study keys, and its peak-to-peak."""
        import pandas as pd

        columns = [*(study_key(name) for name in ERROR_NAMES), "peak_to_peak_arcmin"]
        return pd.DataFrame(self.cloud, columns=columns)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet."""
        return {"cloud": self.to_frame()}


@dataclass(frozen=True)
class ExplorerPage:
    """The explorer as text, with `notes` of what it leaves out and its `cloud`, shape (drives, 13)."""

    html: str
    notes: tuple[str, ...]
    cloud: Array


@numbers_named
def explore(
    study: AnyStudy = None, file: str | Path = EXPLORER_FILE, n: int = CLOUD_N, *, seed: int = 1
) -> ExploreResult:
    """Write the explorer of a `study` (or of its name or path) to `file`: a page that opens from disk, with sliders for
    the twelve errors and the design.

    Its numbers are the closed form's (Jia 2021, Eqs. (16)-(32), to second order in the errors), of a single tooth pair,
    without effects. `n` drives of the study's tolerances, drawn with `seed`, are the cloud behind the present point.
    Raises `HdoptError` for a measured profile or measured teeth, which the closed form does not know, and for an `n`
    below 1 or above 20000.
    """
    study, file = as_study(study), Path(file)
    claim_output(file)
    page = explorer_page(study, n, seed)
    write_text(file, page.html)
    return ExploreResult(study.name, file, len(page.cloud), page.notes, page.cloud)


def explorer_page(study: Study, n: int = CLOUD_N, seed: int = 1) -> ExplorerPage:
    """The explorer of `study`; `n` and `seed` as in `explore`."""
    if not 1 <= n <= MOST_CLOUD:
        raise HdoptError(f"the cloud has {counted(n, 'drive')}; give 1 to {MOST_CLOUD}")
    drive, errors = study.drive, _errors(study)
    _check(drive)
    notes = _notes(study)
    matrix = cloud = None
    table = np.empty((0, len(ERROR_NAMES) + 1))
    if not _lacking(study):
        matrix, peaks = _cloud(study, n, seed)
        table = np.column_stack([_in_study_units(matrix), peaks])
        cloud = {"errors": _rounded(_in_study_units(matrix)), "peak_to_peak": _rounded(peaks)}
    data = {
        "study": study.name,
        "command": _command(study),
        "gear": _gear(study),
        "choices": _choices(drive),
        "parameters": [*_design_sliders(study), *_error_sliders(errors, matrix)],
        "requirement": _requirement(study),
        "cloud": cloud,
        "orders": [asdict(order) for order in model_orders(drive.geometry.ratio)],
        "toml": _toml(study),
    }
    return ExplorerPage(render_explorer(study.title, data, notes), notes, table)


def _errors(study: Study) -> DriveErrors:
    """The study's one drive; one without errors where it speaks of tolerances only."""
    return study.errors if "errors" in study.sections else DriveErrors()


def _check(drive: Drive) -> None:
    if not drive.wave_generator.profile.tip_is_smooth:
        raise HdoptError(
            "the explorer computes the closed form, which needs smooth tips, and this profile is measured; "
            "take --set wave_generator.profile=ellipse to explore the drive with that"
        )
    if drive.has_measured_teeth:
        raise HdoptError(
            "the explorer knows tooth errors as one sine a spline, and this study has teeth measured one by one; "
            "take a study without [cs_teeth] and [fs_teeth]"
        )


def _lacking(study: Study) -> list[str]:
    """The sections that the cloud of drives needs and `study` has not."""
    return [f"[{name}]" for name in needed_beside_the_drive(study) if name not in study.sections]


def _notes(study: Study) -> tuple[str, ...]:
    notes = []
    if study.effects:
        left_out = ", ".join(label(effect.id) for effect in study.effects)
        notes.append(f"Left out here are the study's effects: {left_out}.")
    tolerances = study.find("tolerances", TolerancesBase)
    if tolerances is not None and (drawn := tolerances.graded(study.drive.geometry)):
        notes.append(
            f"The cloud's drives have teeth drawn from tolerances of pitch ({', '.join(drawn)}); the drive that the "
            "sliders move has one sine a spline."
        )
    lacking = _lacking(study)
    if lacking:
        notes.append(f"There is no cloud of drives: the study has no {' and no '.join(lacking)}.")
    return tuple(notes)


def _cloud(study: Study, n: int, seed: int) -> tuple[Array, Array]:
    """The errors of `n` drives of the study's tolerances, (n, 12) in mm and rad, and their peak-to-peak, arcmin."""
    problem = drive_problem_of(study)
    blocks = SAMPLINGS["sobol"]().blocks(seed, 0, n, problem.space.dimension)
    inputs = np.concatenate([problem.space.sample(points) for points in blocks])
    return problem.response.matrix(inputs), problem.response(inputs)


def _in_study_units(matrix: Array) -> Array:
    """Rows of errors in mm and deg, directions within a turn."""
    shown = matrix.copy()
    for column, name in enumerate(ERROR_NAMES):
        if study_key(name).endswith("_deg"):
            shown[:, column] = np.degrees(shown[:, column])
        if name in PHASE_OF.values():
            shown[:, column] %= 360.0
    return shown


def _rounded(values: Array) -> Any:  # lists of lists of numbers, as deep as the array
    """`values` in five significant digits: what a screen shows has three."""
    size = np.floor(np.log10(np.abs(np.where(values == 0, 1.0, values))))
    scale = 10.0 ** (4 - size)
    return (np.round(values * scale) / scale).tolist()


def _gear(study: Study) -> dict[str, float | None]:
    """What no slider moves, by the names of closed_form.js."""
    drive = study.drive
    gear, material = drive.geometry, drive.material
    return {
        "fsTeeth": gear.flexspline_teeth,
        "csTeeth": gear.circular_spline_teeth,
        "module": gear.module,
        "innerRadius": gear.flexspline_inner_radius,
        "fsAddendum": gear.flexspline_addendum,
        "csAddendum": gear.circular_spline_addendum,
        "wall": gear.flexspline_wall,
        "semiMajor": drive.wave_generator.profile.semi_major,
        "semiMinor": alternatives(study)["ellipse"].semi_minor,
        "modulus": None if material is None else material.modulus,
        "endurance": None if material is None else material.endurance,
    }


def _choices(drive: Drive) -> list[dict[str, Any]]:
    generator = drive.wave_generator
    offered = {
        "profile": (generator.profile.name, ("ellipse", "resal", "two_disk")),
        "structure": (generator.structure.value, tuple(structure.value for structure in Structure)),
    }
    return [
        {
            "key": key,
            "path": f"wave_generator.{key}",
            "label": label(key),
            "group": "Design",
            "value": value,
            "options": [[name, label(name)] for name in names],
        }
        for key, (value, names) in offered.items()
    ]


def _slider(path: str, name: str, symbol: str, group: str, value: float, low: float, high: float) -> dict[str, Any]:
    section, _, key = path.partition(".")
    return {
        "key": key,
        "path": path,
        "section": section,
        "label": name,
        "short": _within(group, name),
        "symbol": symbol,
        "group": group,
        "unit": "mm" if key.endswith("_mm") else "deg",
        "value": value,
        "low": low,
        "high": high,
        "step": 10 ** math.floor(math.log10((high - low) / 200)),
    }


def _within(group: str, name: str) -> str:
    """The label `name` under the heading `group`, which says already whose it is: 'Axis tilt along y' under 'Input
    axis' is 'Tilt along y', and a direction follows its eccentricity."""
    if group == "Design":
        return name
    short = name.rpartition(", ")[2] if name.endswith(", direction") else name
    for prefix in PREFIXES:
        short = short.removeprefix(prefix)
    return short[:1].upper() + short[1:]


def _design_sliders(study: Study) -> list[dict[str, Any]]:
    drive = study.drive
    angle, width = math.degrees(drive.geometry.pressure_angle), drive.wave_generator.width
    two_disk = alternatives(study)["two_disk"]
    wrap = math.degrees(two_disk.wrap_angle) if isinstance(two_disk, TwoDisk) else 0.0
    widths = tuple(_two_digits(factor * width) for factor in WIDTH_REACH)
    rows = (
        ("drive.pressure_angle_deg", "Pressure angle", "α", _plain(angle), _range(PRESSURE_ANGLE_DEG, angle)),
        ("wave_generator.width_mm", "Width", "b", width, widths),
        ("wave_generator.wrap_angle_deg", "Wrap angle", "γ", _plain(wrap), _range(WRAP_ANGLE_DEG, wrap)),
    )
    return [_slider(path, name, symbol, "Design", value, *ends) for path, name, symbol, value, ends in rows]


def _error_sliders(errors: DriveErrors, matrix: Array | None) -> list[dict[str, Any]]:
    found = []
    for column, (name, value) in enumerate(errors.by_name().items()):
        key = study_key(name)
        given = _plain(math.degrees(float(value))) if key.endswith("_deg") else float(value)
        largest = 0.0 if matrix is None else float(np.abs(_in_study_units(matrix)[:, column]).max())
        if name in PHASE_OF.values():
            given, low, high = given % 360.0, 0.0, 360.0
        else:
            usual = USUAL_MM if key.endswith("_mm") else USUAL_DEG
            high = _two_digits(REACH * (max(largest, abs(given)) or usual))
            low = 0.0 if name in PHASE_OF else -high
        group = GROUPS[name.partition("_")[0]]
        found.append(_slider(f"errors.{key}", ERROR_LABELS[name], ERROR_SYMBOLS[name], group, given, low, high))
    return found


def _plain(value: float) -> float:
    """Without the rounding that the way over radians leaves: 12.000000000000002 is 12."""
    return float(f"{value:.12g}")


def _two_digits(value: float) -> float:
    return float(f"{value:.2g}")


def _range(usual: tuple[float, float], value: float) -> tuple[float, float]:
    """The `usual` range, wide enough for `value`."""
    return min(usual[0], math.floor(value)), max(usual[1], math.ceil(value))


def _requirement(study: Study) -> dict[str, Any] | None:
    section = study.find("requirement", RequirementSection)
    if section is None:
        return None
    return {
        "limit": section.peak_to_peak_arcmin,
        "yield": section.required_yield,
        "evened": section.homogenization == "contact",
    }


def _command(study: Study) -> str:
    """How `study` is named on a command line, with the changes that it was loaded with; a file by its name alone, so
    that a page handed round tells nothing of the folder."""
    source, drive = study.recipe.get("source"), study.recipe.get("drive")
    words = [Path(str(source)).name] if source else []
    words += ["--drive", str(drive)] if drive else []
    words += [part for override in study.recipe.get("overrides", ()) for part in ("--set", str(override))]
    return " ".join(words) or study.name


def _toml(study: Study) -> str:
    """The study as a file, with "@section.key@" wherever the page puts its present value."""
    given = {
        name: content for name, content in study.data.items() if content != {}
    }  # a section without keys says nothing
    data = {name: dict(content) if isinstance(content, dict) else content for name, content in given.items()}
    for key in ("pressure_angle_deg",):
        data["drive"][key] = f"@drive.{key}@"
    for key in ("profile", "structure", "width_mm", "wrap_angle_deg"):
        data["wave_generator"][key] = f"@wave_generator.{key}@"
    data["errors"] = {study_key(name): f"@errors.{study_key(name)}@" for name in ERROR_NAMES}
    return study_toml(data, ("Written by the explorer.",))
