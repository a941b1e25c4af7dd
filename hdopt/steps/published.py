"""Step: published numbers beside their re-computation, on the published sampling and converged."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from hdopt.contact import contact_angle, homogenization_coefficient, meshing_teeth
from hdopt.errors import HdoptError, unknown_name
from hdopt.kinematics import peak_to_peak_arcmin
from hdopt.kinematics.extremes import walked_peak_to_peak_arcmin
from hdopt.report import Section, Table
from hdopt.report.cells import heading
from hdopt.report.sections.published import published_section
from hdopt.steps import Context, StepResult
from hdopt.study import Study, apply_overrides, study_of

COLUMNS = ("table", "case", "quantity", "published", "sampling_deg", "set")
PEAK_TO_PEAK = "peak_to_peak_arcmin"


@dataclass(frozen=True)
class Published:
    """One published number: where it stands, of what, on which sampling, and what its case changes of the study."""

    table: str
    case: str
    quantity: str
    value: float
    sampling_deg: float
    overrides: tuple[str, ...]


def sampled_peak_to_peak(study: Study, sampling_deg: float) -> float:
    """Peak-to-peak of the angles 0, sampling, ... over one full relative turn, arcmin."""
    turns = study.drive.geometry.beat_phases
    return walked_peak_to_peak_arcmin(study.drive, study.errors, math.radians(sampling_deg), turns)


def _contact_angle_deg(study: Study, sampling_deg: float) -> float:
    return math.degrees(contact_angle(study.drive.geometry, study.drive.wave_generator.profile))


def _homogenization(study: Study, sampling_deg: float) -> float:
    gear = study.drive.geometry
    return homogenization_coefficient(meshing_teeth(gear, contact_angle(gear, study.drive.wave_generator.profile)))


def _evened_out(study: Study, sampling_deg: float) -> float:
    return _homogenization(study, sampling_deg) * sampled_peak_to_peak(study, sampling_deg)


QUANTITIES: dict[str, Callable[[Study, float], float]] = {
    PEAK_TO_PEAK: sampled_peak_to_peak,
    "contact_angle_deg": _contact_angle_deg,
    "homogenization_coefficient": _homogenization,
    "nonuniform_arcmin": _evened_out,
}
"""What a line of the file may be about -> its value for a study, on a sampling in deg."""


def published(study: Study, context: Context) -> StepResult:
    """Every number of the file named in [published], recomputed."""
    asked = study.section("published", "the step 'published'")
    rows = []
    for number in read_published(study.folder / asked.file):
        case = study_of(apply_overrides(study.document, number.overrides), study.name, study.folder)
        row = {
            "table": number.table,
            "case": number.case,
            "quantity": number.quantity,
            "published": number.value,
            "computed": QUANTITIES[number.quantity](case, number.sampling_deg),
            "sampling_deg": number.sampling_deg,
        }
        if number.quantity == PEAK_TO_PEAK:
            row["converged"] = float(peak_to_peak_arcmin(case.drive, case.errors))
        rows.append(row)
    frame = pd.DataFrame(rows).assign(difference=lambda f: f["computed"] - f["published"])
    errors = frame[frame["quantity"] == PEAK_TO_PEAK].reset_index(drop=True)
    sections = [
        published_section(
            pd.DataFrame(
                {
                    "case": errors["case"],
                    "published_arcmin": errors["published"],
                    "sampled_arcmin": errors["computed"],
                    "converged_arcmin": errors["converged"],
                    "sampling_deg": errors["sampling_deg"],
                    "table": errors["table"],
                }
            ),
            source=asked.source,
            tolerance_arcmin=asked.tolerance_arcmin,
            remarks=asked.remarks,
        )
    ]
    others = frame[frame["quantity"] != PEAK_TO_PEAK]
    if len(others):
        sections.append(_others_section(others.drop(columns=["sampling_deg", "converged"], errors="ignore")))
    return StepResult(tuple(sections), {"numbers": frame.to_dict("records")})


def _others_section(frame: pd.DataFrame) -> Section:
    shown = frame.assign(quantity=[_written(name) for name in frame["quantity"]]).reset_index(drop=True)
    formats = {"published": ".4f", "computed": ".4f", "difference": "+.4f"}
    table = Table("published-others", "Contact and what it evens out", shown, formats=formats)
    return Section("contact", "Contact angle and homogenization", (table,))


def _written(quantity: str) -> str:
    name, unit = heading(quantity)
    return f"{name} [{unit}]" if unit else name


def read_published(path: Path) -> list[Published]:
    """The published numbers in a CSV file with the columns of `COLUMNS`."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise HdoptError(f"published numbers {path}: cannot be read ({error}); give a CSV text file") from error
    rows = csv.DictReader(lines)
    if tuple(rows.fieldnames or ()) != COLUMNS:
        raise HdoptError(f"published numbers {path}: the first line must read {','.join(COLUMNS)}")
    return [_number(path, line, row) for line, row in enumerate(rows, 2)]


def _number(path: Path, line: int, row: dict[str, str]) -> Published:
    where = f"published numbers {path}, line {line}"
    if row["quantity"] not in QUANTITIES:
        raise HdoptError(f"{where}: {unknown_name('quantity', row['quantity'], QUANTITIES)}")
    try:
        value, sampling = float(row["published"]), float(row["sampling_deg"])
    except (TypeError, ValueError) as error:
        raise HdoptError(f"{where}: published and sampling_deg must be numbers ({error})") from error
    overrides = tuple(part.strip() for part in (row["set"] or "").split(";") if part.strip())
    return Published(row["table"], row["case"], row["quantity"], value, sampling, overrides)
