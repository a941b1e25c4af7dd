"""`hdopt profile`: what a wave generator's profile asks of the flexspline."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import StudyOptions, answer_options, emit, study_options, table_options
from hdopt.cli.completion import offered, profiles

if TYPE_CHECKING:
    from hdopt.workflow.kinematic_error import ProfileResult


@click.command()
@table_options
@study_options
@click.option("--profile", metavar="P", shell_complete=offered(profiles), help="ellipse, resal, two_disk or measured.")
@answer_options
def command(asked: StudyOptions, profile: str | None, json_file: Path | None, seed: int) -> None:
    """The wave generator's profile: contact angle, curvature change, bending stress.

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken.
    """
    from hdopt.workflow.kinematic_error import profile as analyse

    chosen = (f"wave_generator.profile={profile}",) if profile else ()
    result = analyse(asked.load(*chosen))
    emit(result.to_dict(), json_file, _lines(result), tables=result)


ROWS = (
    ("contact_angle_deg", "contact angle (overlap of tips)", "{:.3f} deg"),
    ("meshing_teeth", "teeth in mesh, one zone", "{:.2f}"),
    ("homogenization_coefficient", "homogenization coefficient k_e", "{:.4f}"),
    ("max_curvature_change_per_mm", "largest change of curvature", "{:.6f} 1/mm"),
    ("max_bending_stress_mpa", "largest bending stress, ring", "{:.1f} MPa"),
    ("max_bending_stress_plate_mpa", "largest bending stress, plate", "{:.1f} MPa"),
    ("mean_flank_pressure_mpa", "mean flank pressure under the load", "{:.2f} MPa"),
    ("perimeter_error_mm", "perimeter less the flexspline's", "{:+.4f} mm"),
    ("semi_major_mm", "semi-major axis", "{:.4f} mm"),
    ("semi_minor_mm", "semi-minor axis", "{:.4f} mm"),
    ("tip_radius_of_curvature_mm", "radius of curvature at the tip", "{:.4f} mm"),
)


def _lines(result: ProfileResult) -> Iterator[str]:
    values = result.to_dict()
    yield f"{result.study}: {result.profile} profile"
    for key, label, form in ROWS:
        if values[key] is not None:
            yield f"  {label:36s} {form.format(values[key])}"
    for note in result.notes:
        yield f"  note: {note}"
