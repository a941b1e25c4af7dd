"""`hdopt diagnose`: what physics a recording holds that the model leaves out, or each of many."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import OutputFile, answer_options, engine_option, table_options
from hdopt.cli.completion import nuisances, several
from hdopt.cli.each import EachOptions, each_options, emit_written
from hdopt.cli.log import looked_at
from hdopt.cli.recorded import RecordingOptions, recording_options
from hdopt.words import counted

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis, FitNumbers
    from hdopt.diagnosis.verdict.many import DiagnosedBatch

MOST_LISTED = 12
"""Parameters of one effect that the terminal shows."""


@click.command()
@table_options
@recording_options
@click.option(
    "--nuisance",
    metavar="NAME,...",
    default="",
    shell_complete=several(nuisances),
    help="Fit beside every model, and never name: drift, time-warp.",
)
@click.option("--report", "report_file", metavar="FILE", type=OutputFile(), help="Write an HTML report.")
@click.option(
    "--write-study",
    "study_file",
    metavar="FILE",
    type=OutputFile(),
    help="Write a study with the drive's fitted errors and the effects found.",
)
@each_options("Each file is a drive of its own: one table, --engine takes them.")
@engine_option
@answer_options
def command(
    given: RecordingOptions,
    nuisance: str,
    report_file: Path | None,
    study_file: Path | None,
    batch: EachOptions,
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
    options = (given, asked, files, json_file, seed)
    of_one = ("--write-study",) if study_file is not None else ()
    batch.work(given, lambda: _one(*options), lambda: _each(*options), of_one)


def _one(
    given: RecordingOptions, nuisance: tuple[str, ...], files: dict[str, Path], json_file: Path | None, seed: int
) -> None:
    """The diagnosis of one drive, said and written."""
    from threading import get_ident

    from hdopt.workflow.diagnose import diagnose, write_diagnosis
    from hdopt.workflow.diagnosis_stages import DiagnosisWatch

    source = given.source()
    read = source.recordings(given.recordings)
    label = f"diagnosis of {counted(len(read), 'recording')}"
    with looked_at(label, DiagnosisWatch(get_ident()).words):
        diagnosis = diagnose(read, source, seed=seed, nuisance=nuisance)
    names = [recording.name for recording in read]
    emit_written(diagnosis, json_file, _lines(diagnosis), lambda: write_diagnosis(diagnosis, files, names, source))


def _each(
    given: RecordingOptions, nuisance: tuple[str, ...], files: dict[str, Path], json_file: Path | None, seed: int
) -> None:
    """The diagnoses of many drives, said and written."""
    from hdopt.workflow.diagnose_many import diagnose_many, write_diagnoses

    batch = diagnose_many(given.recordings, given.source(), seed, nuisance)
    emit_written(batch, json_file, _batch_lines(batch), lambda: write_diagnoses(batch, files))


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
            f"{fit['heldout_nested_rms_arcmin']:.4f} arcmin{_proposed(fit)}"
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


def _proposed(fit: FitNumbers) -> str:
    """What the numbers of `fit` say of the set that the turns left to a part prefer to what was found on them alone."""
    proposed = fit["heldout_proposed_rms_arcmin"]
    return "" if proposed is None else f"; what all turns found, fitted without these: {proposed:.4f} arcmin"
