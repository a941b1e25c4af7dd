"""`hdopt diagnose`: what physics a recording holds that the model leaves out."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import OutputFile, answer_options, emit, engine_option, table_options
from hdopt.cli.recorded import RecordingOptions, recording_options

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis

MOST_LISTED = 12
"""Parameters of one effect that the terminal shows."""


@click.command()
@table_options
@recording_options
@click.option(
    "--nuisance", metavar="NAME,...", default="", help="Fit beside every model, and never name: drift, time-warp."
)
@click.option("--report", "report_file", metavar="FILE", type=OutputFile(), help="Write an HTML report.")
@click.option(
    "--write-study",
    "study_file",
    metavar="FILE",
    type=OutputFile(),
    help="Write a study with the drive's fitted errors and the effects found.",
)
@engine_option
@answer_options
def command(
    given: RecordingOptions,
    nuisance: str,
    report_file: Path | None,
    study_file: Path | None,
    json_file: Path | None,
    seed: int,
) -> None:
    """What physics recordings of one drive hold that the model leaves out.

    REC are files of one drive, of any format that `hdopt inspect` reads, fitted jointly. Exit status 0 whenever a
    verdict was reached.
    """
    from hdopt.workflow.diagnose import diagnose, write_diagnosis

    asked = tuple(name.strip() for name in nuisance.split(",") if name.strip())
    source = given.source()
    read = source.recordings(given.recordings)
    diagnosis = diagnose(read, source, seed=seed, nuisance=asked)
    wanted = {"report": report_file, "study": study_file}
    files = {kind: path for kind, path in wanted.items() if path is not None}
    try:
        write_diagnosis(diagnosis, files, [recording.name for recording in read], source)
    finally:
        # A file that cannot be written after minutes of work must not take the answer with it.
        emit(diagnosis.to_dict(), json_file, _lines(diagnosis), tables=diagnosis)


def _lines(diagnosis: Diagnosis) -> Iterator[str]:
    yield f"verdict: {diagnosis.verdict}"
    yield f"  {diagnosis.says}"
    for found in diagnosis.effects:
        yield f"  {found.id}: confidence {found.confidence:.2f}, {found.where['rms_arcmin']:.3g} arcmin rms"
        listed = list(found.parameters.items())
        for name, p in listed[:MOST_LISTED]:
            yield f"    {name:24s} {p.value:.5g}  ({p.low:.5g} to {p.high:.5g}) {p.unit}"
        if len(listed) > MOST_LISTED:
            yield f"    and {len(listed) - MOST_LISTED} more, all of them in --json"
    if diagnosis.separating_test:
        yield f"  next: {diagnosis.separating_test}"
    fit = diagnosis.fit
    yield (
        f"  cross-validated: base {fit['heldout_rms_base_arcmin']:.4f}, "
        f"extended {fit['heldout_rms_extended_arcmin']:.4f}, generic {fit['heldout_rms_generic_arcmin']:.4f}, "
        f"placebo {fit['heldout_rms_placebo_arcmin']:.4f} arcmin; false alarm p {fit['false_alarm_p']:.3g}"
    )
    if fit["heldout_nested_rms_arcmin"] is not None:
        yield (
            f"  turns that no stage saw: base {fit['heldout_nested_rms_base_arcmin']:.4f}, extended "
            f"{fit['heldout_nested_rms_arcmin']:.4f} arcmin"
        )
    if fit["heldout_conditions_rms_base_arcmin"] is not None:
        yield (
            f"  conditions left out: base {fit['heldout_conditions_rms_base_arcmin']:.4f}, extended "
            f"{fit['heldout_conditions_rms_extended_arcmin']:.4f} arcmin"
        )
    for name, p in diagnosis.nuisances.items():
        yield f"  nuisance {name} {p.value:.3g}  ({p.low:.3g} to {p.high:.3g}) {p.unit}"
    for warning in diagnosis.warnings:
        yield f"  note: {warning}"
