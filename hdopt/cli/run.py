"""`hdopt run`: everything a study asks for, with a report."""

from __future__ import annotations

from pathlib import Path

import click

from hdopt.cli.common import drive_option, emit, json_option, progress, seed_option, set_option, study_argument


@click.command()
@study_argument
@click.option("-o", "--output", "folder", metavar="DIR", help="Where the report goes; out/STUDY if omitted.")
@drive_option
@set_option
@json_option
@seed_option
def command(study, folder, drive, overrides, json_file, seed) -> None:
    """Everything a study asks for: report.html with its figures, their numbers as CSV, and results.json.

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken.
    """
    from hdopt.run import run
    from hdopt.study import load_study

    loaded = load_study(study, overrides, drive)
    target = Path(folder) if folder else Path("out") / loaded.name
    result = run(loaded, target, seed, lambda names: progress(names, f"hdopt run {loaded.name}", len(names)))
    emit(result.to_dict(), json_file, (f"{loaded.title}", f"  report: {result.report}"))
