"""Steps about the design: what the error depends on, and its map over pressure angle and width."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd

from hdopt.arrays import Array
from hdopt.drive.errors import AMPLITUDE_NAMES, ERROR_NAMES, PHASE_OF, DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.kinematics import peak_to_peak_arcmin
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.kinematics.waveform import CLOSED_FORM, DEFAULT_METHOD
from hdopt.report.sections.design_map import Design, pressure_angle_width_section
from hdopt.report.sections.tornado import sensitivities_section
from hdopt.report.sections.words import ERROR_LABELS
from hdopt.study import Study
from hdopt.workflow.steps import Context, StepResult, requirement_arcmin

RELATIVE_CHANGE = 0.2
"""Change of a size or a tilt to either side."""
DIRECTION_CHANGE = math.radians(30)
"""Change of a direction or a phase to either side."""
MAP_POINTS = 25
MAP_REACH = (0.6, 1.6)
"""From and to this many times the design's own pressure angle and width."""


def sensitivities(study: Study, context: Context) -> StepResult:
    """Each error of the `study`, the pressure angle and the width alone, by 20 % to either side (directions and phases:
    30 deg); needs nothing of the `context`."""
    drive, errors = study.drive, study.errors
    base = converged_peak_to_peak_arcmin(drive, errors)
    rows = [row for name in ERROR_NAMES if (row := _of_error(drive, errors, name)) is not None]
    gear, width = drive.geometry, drive.wave_generator.width
    for variable, value, unit, change in (
        ("Pressure angle", math.degrees(gear.pressure_angle), "deg", with_pressure_angle_deg),
        ("WG width", width, "mm", with_width),
    ):
        low, high = value * (1 - RELATIVE_CHANGE), value * (1 + RELATIVE_CHANGE)
        at_low, at_high = (converged_peak_to_peak_arcmin(change(drive, end), errors) for end in (low, high))
        rows.append(_row(variable, f"{low:.3g} {unit}", f"{high:.3g} {unit}", at_low, at_high))
    frame = pd.DataFrame(rows)
    by_variable = {row.pop("variable"): row for row in frame.to_dict("records")}
    return StepResult(
        (sensitivities_section(frame, base),), {"method": DEFAULT_METHOD, "base_arcmin": base, **by_variable}
    )


def design_map(study: Study, context: Context) -> StepResult:
    """Converged peak-to-peak of the `study` over pressure angle and wave-generator width, the errors as they are; needs
    nothing of the `context`."""
    drive = study.drive
    angle, width = math.degrees(drive.geometry.pressure_angle), drive.wave_generator.width
    angles = angle * np.linspace(*MAP_REACH, MAP_POINTS)
    widths = width * np.linspace(*MAP_REACH, MAP_POINTS)
    values = map_arcmin(drive, study.errors, angles, widths)
    design = Design(study.name, width, angle)
    section = pressure_angle_width_section(angles, widths, values, design, requirement_arcmin=requirement_arcmin(study))
    method = CLOSED_FORM if drive.wave_generator.profile.tip_is_smooth else DEFAULT_METHOD
    results = {"method": method, "pressure_angle_deg": angles, "width_mm": widths, "peak_to_peak_arcmin": values}
    return StepResult((section,), results)


def map_arcmin(drive: Drive, errors: DriveErrors, angles_deg: Array, widths: Array) -> Array:
    """Converged peak-to-peak of `drive` with `errors` at each of `angles_deg`, pressure angles (m,), and of `widths`,
    mm (n,): arcmin, shape (m, n)."""
    return np.array(
        [
            [float(peak_to_peak_arcmin(with_width(with_pressure_angle_deg(drive, a), w), errors)) for w in widths]
            for a in angles_deg
        ]
    )


def with_pressure_angle_deg(drive: Drive, angle_deg: float) -> Drive:
    """`drive` with the pressure angle `angle_deg`."""
    return replace(drive, geometry=replace(drive.geometry, pressure_angle=math.radians(angle_deg)))


def with_width(drive: Drive, width: float) -> Drive:
    """`drive` with a wave generator of `width` mm."""
    return replace(drive, wave_generator=replace(drive.wave_generator, width=float(width)))


def _of_error(drive: Drive, errors: DriveErrors, name: str) -> dict[str, object] | None:
    """One error to either side; None for an error that is nil, or the direction of one that is."""
    value = float(getattr(errors, name))
    size_of = {direction: size for size, direction in PHASE_OF.items()}
    if name in size_of:
        if float(getattr(errors, size_of[name])) == 0:
            return None
        change = DIRECTION_CHANGE
    else:
        change = RELATIVE_CHANGE * abs(value)
        if change == 0:
            return None
    ends = (value - change, value + change)
    low, high = (converged_peak_to_peak_arcmin(drive, errors.with_(**{name: end})) for end in ends)
    first, last = (_written(name, end) for end in ends)
    return _row(ERROR_LABELS[name], first, last, low, high)


def _written(name: str, value: float) -> str:
    """The `value` of the error `name`, in mm or deg."""
    if name in AMPLITUDE_NAMES:
        return f"{value:.3g} mm"
    return f"{math.degrees(value):.3g} deg".replace("-", "−")


def _row(variable: str, low: str, high: str, low_arcmin: float, high_arcmin: float) -> dict[str, object]:
    return {"variable": variable, "low": low, "high": high, "low_arcmin": low_arcmin, "high_arcmin": high_arcmin}
