"""`hdopt diagnose`: what physics a recording holds that the model leaves out."""

from __future__ import annotations

from pathlib import Path

import click

from hdopt.cli.common import OutputFile, emit, engine_option, json_option, seed_option

MOST_LISTED = 12
"""Parameters of one effect that the terminal shows."""


@click.command()
@click.argument("recordings", nargs=-1, required=True, metavar="REC...", type=click.Path(path_type=Path))
@click.option("--drive", metavar="NAME|STUDY|none", default="csf-25-80", show_default=True, help="The drive recorded.")
@click.option("--ratio", type=float, help="Reduction ratio, with --drive none.")
@click.option(
    "--columns", metavar="CHANNEL=NAME:UNIT,...", help="Layout: input, output or error, time, torque, temperature."
)
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
@json_option
@seed_option
def command(recordings, drive, ratio, columns, nuisance, report_file, study_file, json_file, seed) -> None:
    """What physics recordings of one drive hold that the model leaves out.

    REC are .csv, .parquet or .mat files of one drive, fitted jointly. Exit status 0 whenever a verdict was reached.
    """
    from hdopt.diagnosis import diagnose

    asked = tuple(name.strip() for name in nuisance.split(",") if name.strip())
    diagnosis = diagnose(recordings, drive_of(drive, ratio), ratio, columns, seed, asked)
    try:
        if report_file is not None:
            from hdopt.files import write_text
            from hdopt.report.html import render
            from hdopt.report.sections.diagnosis import diagnosis_report

            write_text(report_file, render(diagnosis_report(diagnosis, [path.name for path in recordings])))
        if study_file is not None:
            from hdopt.workflow.write_fitted import write_study

            write_study(diagnosis, drive, study_file)
    finally:
        # A file that cannot be written after minutes of work must not take the answer with it.
        emit(diagnosis.to_dict(), json_file, _lines(diagnosis))


def drive_of(name: str, ratio: float | None):
    """The drive by its shipped name or study file; None for 'none', which needs a ratio."""
    from hdopt.errors import HdoptError
    from hdopt.study import load_study, shipped_drives

    if name == "none":
        if ratio is None:
            raise HdoptError("--drive none needs the gear's ratio; give --ratio X")
        return None
    return (load_study(drive=name) if name in shipped_drives() else load_study(name)).drive


def _lines(diagnosis):
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
        f"  held-out: base {fit['heldout_rms_base_arcmin']:.4f}, extended {fit['heldout_rms_extended_arcmin']:.4f}, "
        f"generic {fit['heldout_rms_generic_arcmin']:.4f}, placebo {fit['heldout_rms_placebo_arcmin']:.4f} arcmin; "
        f"false alarm p {fit['false_alarm_p']:.3g}"
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
