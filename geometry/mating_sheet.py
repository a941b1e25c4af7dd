"""The mating sheet as a CSV file."""

from __future__ import annotations

import csv
from pathlib import Path

from hdopt.files import JsonReady
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.job import Job
from hdopt.words import counted

COLUMNS = ("part", "feature", "requirement", "value_mm", "over_mm", "feeds", "takes", "unit")


def write_mating(path: Path, job: Job) -> None:
    """Write the sheet of a `job` to `path` as CSV."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(f"# {job.identity.title}: mating parts; {job.identity.description}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in job.mating:
            values = row.to_dict()
            cells = [values[name] for name in COLUMNS]
            writer.writerow(["" if c is None else f"{c:.6g}" if isinstance(c, float) else c for c in cells])


def check_mating(path: Path, job: Job, name: str) -> JsonReady:
    """Read the sheet at `path` back: every row of the `job`, and sums within the bounds. Raises `CheckFailed`, which
    calls the file `name`, with all that is wrong."""
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    failures = []
    if len(rows) != len(job.mating):
        failures.append(f"it has {counted(len(rows), 'row')}, not {len(job.mating)}")
    for error, key in (("axis_eccentricity", "axis_eccentricity_mm"), ("axis_tilt", "axis_tilt_y_deg")):
        spent = sum(float(row["takes"]) for row in rows if row["feeds"] == error and row["takes"])
        if key in job.bounds and not any(spec.get("feeds") == error for spec in job.contributors.values()):
            if not spent <= job.bounds[key] * (1 + 1e-5):
                failures.append(f"{error} is spent to {spent:.6g}; {job.bounds[key]:.6g} is allowed")
    if failures:
        raise CheckFailed(name, failures)
    return {"rows": len(rows)}
