"""The inspection plan: every toleranced feature with its limits, the class of instrument, and how many points."""

from __future__ import annotations

import csv
import math
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hdopt.files import JsonReady
from hdopt.geometry.callouts import callouts_of
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.contour import Circle
from hdopt.geometry.slides import slides_of

if TYPE_CHECKING:
    from hdopt.geometry.job import Job

SCANNED = 0.004
"""Zones and outlines are scanned: where a wider instrument would do, this class of `INSTRUMENTS` measures them."""

UNCERTAINTY_SHARE = 0.1
"""Expanded uncertainty of the instrument over the tolerance's width (the usual rule of one to ten; ISO 14253-1 decides
at the limits)."""

INSTRUMENTS = (
    (0.0003, "form tester or measuring machine in a room held at 20 C within 0.5 K"),
    (0.001, "measuring machine, or air gauge set on a master"),
    (0.004, "measuring machine, or comparator with master"),
    (0.02, "micrometer or inside micrometer"),
    (math.inf, "caliper"),
)
"""Largest expanded uncertainty that is allowed, mm -> the class of instrument that reaches it."""

POINTS = {"profile": 360, "cylindricity": 360, "perimeter": 360, "diameter": 24, "zone": 24, "length": 5}
COLUMNS = tuple(
    "number part feature nominal_mm lower_mm upper_mm zone_mm uncertainty_mm instrument points source".split()
)


@dataclass(frozen=True)
class Check:
    """One line of the plan: limits are sizes in mm, `zone` the width of a tolerance zone."""

    number: int
    part: str
    feature: str
    nominal_mm: float | None
    lower_mm: float | None
    upper_mm: float | None
    zone_mm: float | None
    uncertainty_mm: float
    instrument: str
    points: int
    source: str

    def to_dict(self) -> JsonReady:
        return asdict(self)


def inspection_plan(job: Job) -> tuple[Check, ...]:
    """What is to be measured of a `job`: every dimension with limits, the profile, and every zone of the budgets."""
    found: list[Check] = []

    def add(part: str, feature: str, size: tuple[float, float, float] | None, zone: float | None, source: str) -> None:
        width = zone if zone is not None else (size[2] - size[1] if size else 0.0)
        uncertainty = float(f"{UNCERTAINTY_SHARE * width:.6g}")  # an instrument's, without the noise of the arithmetic
        needed = uncertainty if zone is None and feature != "perimeter" else min(uncertainty, SCANNED)
        instrument = next(name for limit, name in INSTRUMENTS if needed <= limit)
        nominal, low, high = size if size else (None, None, None)
        found.append(
            Check(
                len(found) + 1,
                part,
                feature,
                nominal,
                low,
                high,
                zone,
                uncertainty,
                instrument,
                _points(feature, zone),
                source,
            )
        )

    for carrier in job.model.profiled:
        form = "cylindricity" if isinstance(carrier.contour, Circle) else "profile"
        add(carrier.name, f"{form} of the rim, all round at three heights", None, job.model.profile_zone, "ISO 1101")
    for row in job.dimensions:
        if row.nominal is not None and row.lower is not None and row.upper is not None:
            add(row.part, row.name, (row.nominal, row.nominal + row.lower, row.nominal + row.upper), None, row.source)
    for budget in job.model.plan.budgets:
        for share in budget.shares:
            if share.zone is not None:
                add(share.part, share.feature, None, share.zone, budget.of)
    for slide in slides_of(job.model.parts):
        add(slide.above.name, "slot square to the back", None, slide.zone, "clearances")
        add(slide.below.name, "block upright", None, slide.zone, "clearances")
        if slide.below.slot is not None:
            add(slide.below.name, "block square to the slot", None, slide.squareness, "clearances")
    planned = Counter((row.part, row.zone_mm) for row in found)
    for part in job.model.parts:
        for callout in callouts_of(part, job.model) if not part.context else ():
            for frame in callout.frames:
                planned[part.name, frame.zone] -= not frame.usual
                if frame.usual or planned[part.name, frame.zone] < 0:  # what no budget and no slide has brought in
                    add(part.name, f"{frame.symbol} of {callout.lines[0]}", None, frame.zone, "ISO 1101")
    return tuple(found)


def _points(feature: str, zone: float | None) -> int:
    kind = next((kind for kind in ("profile", "cylindricity", "perimeter") if kind in feature), None)
    if kind is None:
        round_ones = ("bore", "seat", "journal", "diameter", "hole")
        kind = "zone" if zone is not None else "diameter" if any(w in feature for w in round_ones) else "length"
    return POINTS[kind]


def write_inspection(path: Path, job: Job) -> None:
    """Write the inspection plan of a `job` to `path` as CSV."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(f"# {job.identity.title}: inspection plan; {job.identity.description}; mm at 20 C\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in inspection_plan(job):
            cells = [row.to_dict()[name] for name in COLUMNS]
            writer.writerow(["" if c is None else f"{c:.6f}" if isinstance(c, float) else c for c in cells])


def check_inspection(path: Path, job: Job, name: str) -> JsonReady:
    """Read the plan at `path` back: a line at least for every part of the `job` that is made, limits in order. Raises
    `CheckFailed`, which calls the file `name`, with all that is wrong."""
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    failures = []
    made = {part.name for part in job.model.parts if not part.context}
    if missing := made - {row["part"] for row in rows}:
        failures.append(f"it lacks {', '.join(sorted(missing))}")
    for row in rows:
        if row["lower_mm"] and not float(row["lower_mm"]) < float(row["upper_mm"]):
            failures.append(f"line {row['number']} has limits out of order")
    if failures:
        raise CheckFailed(name, failures)
    return {"features": len(rows)}
