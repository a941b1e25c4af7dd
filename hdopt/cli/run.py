"""`hdopt run`: everything a study asks for, with a report."""

from __future__ import annotations

from pathlib import Path

import click

from hdopt.cli.common import drive_option, emit, json_option, progress, seed_option, set_option, study_argument


@click.command()
@study_argument
@click.option("-o", "--output", "folder", metavar="DIR", help="Folder to write to; out/STUDY if omitted.")
@drive_option
@set_option
@json_option
@seed_option
def command(study, folder, drive, overrides, json_file, seed) -> int:
    """Everything a study asks for: results, tables, and report.html.

    STUDY is a study file or a shipped study (see `hdopt studies`); without one, the shipped drive csf-25-80 is taken.
    """
    from hdopt.run import run_study
    from hdopt.study import load_study

    loaded = load_study(study, overrides, drive)
    result = run_study(
        loaded, Path(folder) if folder else Path("out") / loaded.name, seed, lambda names: progress(names, loaded.name)
    )
    emit(result.to_dict(), json_file, _lines(result))
    return 0 if result.answer else 1


def _lines(result):
    for name, step in result.steps.items():
        for line in step.says or ((f"left out: {step.results['left_out']}",) if "left_out" in step.results else ()):
            yield f"{name.replace('_', ' ')}: {line}"
    yield f"report: {result.report}"
