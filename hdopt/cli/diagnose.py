"""`hdopt diagnose`: what physics a recording holds that the model leaves out, or each of many."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import (
    OutputFile,
    answer_options,
    emit,
    engine_option,
    finished_parts_kept,
    resume_option,
    table_options,
    watched,
)
from hdopt.cli.log import looked_at
from hdopt.cli.recorded import RecordingOptions, recording_options

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis
    from hdopt.diagnosis.verdict.many import DiagnosedBatch

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
@click.option("--each", is_flag=True, help="Each file is a drive of its own: one table, --engine takes them.")
@resume_option
@engine_option
@answer_options
def command(
    given: RecordingOptions,
    nuisance: str,
    report_file: Path | None,
    study_file: Path | None,
    each: bool,
    resume: bool,
    json_file: Path | None,
    seed: int,
) -> None:
    """What physics recordings of one drive hold that the model leaves out.

    REC are files of one drive, of any format that `hdopt inspect` reads, fitted jointly; with --each, of one drive
    each. Exit status 0 whenever a verdict was reached.
    """
    asked = tuple(name.strip() for name in nuisance.split(",") if name.strip())
    wanted = {"report": report_file, "study": study_file}
    files = {kind: path for kind, path in wanted.items() if path is not None}
    if not each:
        if resume:
            raise click.UsageError("--resume goes on with many drives; give it with --each")
        _one(given, asked, files, json_file, seed)
        return
    if study_file is not None:
        raise click.UsageError("--write-study: said of one drive; leave it out with --each")
    with finished_parts_kept(given.fingerprint(), resume):
        _each(given, asked, files, json_file, seed)


def _one(
    given: RecordingOptions, nuisance: tuple[str, ...], files: dict[str, Path], json_file: Path | None, seed: int
) -> None:
    """The diagnosis of one drive, said and written."""
    from threading import get_ident

    from hdopt.workflow.diagnose import diagnose, write_diagnosis
    from hdopt.workflow.diagnosis_stages import DiagnosisWatch

    source = given.source()
    read = source.recordings(given.recordings)
    label = f"diagnosis of {len(read)} recording{'s' if len(read) > 1 else ''}"
    with looked_at(label, DiagnosisWatch(get_ident()).words):
        diagnosis = diagnose(read, source, seed=seed, nuisance=nuisance)
    try:
        write_diagnosis(diagnosis, files, [recording.name for recording in read], source)
    finally:
        # A file that cannot be written after minutes of work must not take the answer with it.
        emit(diagnosis.to_dict(), json_file, _lines(diagnosis), tables=diagnosis)


def _each(
    given: RecordingOptions, nuisance: tuple[str, ...], files: dict[str, Path], json_file: Path | None, seed: int
) -> None:
    """The diagnoses of many drives, said and written."""
    from hdopt.parallel.engine import engine_in_force
    from hdopt.workflow.diagnose_many import diagnose_many, write_diagnoses

    with engine_in_force(watched("drives")):
        batch = diagnose_many(given.recordings, given.source(), seed, nuisance)
    try:
        write_diagnoses(batch, files)
    finally:
        emit(batch.to_dict(), json_file, _batch_lines(batch), tables=batch)


def _batch_lines(batch: DiagnosedBatch) -> Iterator[str]:
    for drive in batch.drives:
        if drive.error:
            yield f"{drive.name}: not diagnosed: {drive.error}"
        else:
            found = ", ".join(f"{name} {confidence:.2f}" for name, confidence in drive.effects.items())
            yield f"{drive.name}: {drive.verdict}" + (f" ({found})" if found else "")
    yield "verdicts: " + ", ".join(f"{name} {count}" for name, count in batch.verdicts.items())


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
