"""`hdopt run`: everything a study asks for, with a report."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import (
    StudyOptions,
    emit,
    resume_option,
    status,
    study_options,
    table_options,
    work_options,
)
from hdopt.cli.completion import a_folder
from hdopt.cli.log import looked_at

if TYPE_CHECKING:
    from hdopt.workflow.run import RunResult


@click.command()
@study_options
@click.option(
    "-o",
    "--output",
    "folder",
    metavar="DIR",
    shell_complete=a_folder,
    help="Folder to write to; out/STUDY if omitted.",
)
@resume_option
@click.option("--verify", is_flag=True, help="Do the run in the folder STUDY (or -o DIR) again and compare every file.")
@table_options
@work_options
def command(
    asked: StudyOptions, folder: str | None, resume: bool, verify: bool, json_file: Path | None, seed: int
) -> int:
    """Everything a study asks for: results, tables, and report.html.

    STUDY is a study file or a shipped study (see `hdopt studies`); without one, the shipped drive csf-25-80 is taken.
    The folder is replaced as a whole at the end. With --verify, status 1 says that a file came out otherwise.
    """
    if verify:
        return _verify(Path(folder or asked.study or "."), json_file)
    from hdopt.workflow.doing import Doing, told
    from hdopt.workflow.requirement import of_run
    from hdopt.workflow.run import run_study

    loaded = asked.load()
    place = Path(folder) if folder else Path("out") / loaded.name
    with told(Doing()) as doing, looked_at(loaded.name, doing.words):
        result = run_study(loaded, place, seed, doing.steps, resume)
    verdict = of_run(loaded, result.found)
    emit(result.to_dict(), json_file, _lines(result), verdict, result)
    return status(result.answer, verdict)


def _verify(folder: Path, json_file: Path | None) -> int:
    from hdopt.workflow.doing import Doing, told
    from hdopt.workflow.verify import lines, verify_run

    with told(Doing()) as doing, looked_at(str(folder), doing.words):
        result = verify_run(folder, doing.steps)
    emit(result.to_dict(), json_file, lines(result), tables=result)
    return 0 if result.repeated else 1


def _lines(result: RunResult) -> Iterator[str]:
    from hdopt.workflow.run import left_out

    for name, step in result.steps.items():
        for line in step.says or filter(None, (left_out(step),)):
            yield f"{name.replace('_', ' ')}: {line}"
    yield f"report: {result.report}"
