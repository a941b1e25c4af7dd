"""Step: the drive with each of the four wave-generator structures."""

from __future__ import annotations

import math
from dataclasses import replace

import pandas as pd

from hdopt.drive.geometry import Drive, Structure
from hdopt.errors import MissingValue
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.kinematics.waveform import relative_turn
from hdopt.mechanics.lag import lag
from hdopt.report.sections.structures import structures_section
from hdopt.study import Study
from hdopt.workflow.steps import Context, StepResult, requirement_arcmin

SAMPLES_PER_TURN = 360


def with_structure(drive: Drive, structure: Structure) -> Drive:
    """`drive` with a wave generator of another `structure`."""
    return replace(drive, wave_generator=replace(drive.wave_generator, structure=structure))


def structures(study: Study, context: Context) -> StepResult:
    """Peak-to-peak and lag of all four structures for the drive of the `study`; needs nothing of the `context`; lag
    is left out where a clearance it needs is not given."""
    rows, waveforms = [], {}
    for structure in Structure:
        drive = with_structure(study.drive, structure)
        theta, error = relative_turn(drive, study.errors, SAMPLES_PER_TURN)
        row = {
            "structure": structure.value,
            "peak_to_peak_arcmin": converged_peak_to_peak_arcmin(drive, study.errors),
        }
        try:
            lost = lag(drive, study.errors, theta, error).total_arcmin
        except MissingValue:
            lost = None
        if lost is not None:
            row |= {"lag_mean_arcmin": lost.mean(), "lag_min_arcmin": lost.min(), "lag_max_arcmin": lost.max()}
        rows.append(row)
        one_turn = theta <= 2 * math.pi
        waveforms[structure.value] = error[one_turn]
    frame = pd.DataFrame(rows)
    if frame.isna().any(axis=None):
        frame = frame[["structure", "peak_to_peak_arcmin"]]
    section = structures_section(
        frame, waveforms=(theta[one_turn], waveforms), requirement_arcmin=requirement_arcmin(study)
    )
    return StepResult((section,), {row.pop("structure"): row for row in frame.to_dict("records")})
