"""`hdopt explore`: a page with the study's drive under sliders."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import StudyOptions, answer_options, emit, study_options, table_options
from hdopt.cli.completion import a_file
from hdopt.cli.whole_number import WholeNumber
from hdopt.words import counted

if TYPE_CHECKING:
    from hdopt.workflow.explore import ExploreResult


@click.command()
@study_options
@click.option("-o", "--output", "file", metavar="FILE", default="explorer.html", show_default=True,
              shell_complete=a_file, help="The page to write.")  # fmt: skip
@click.option("-n", "n", type=WholeNumber(1, 100_000), default=2048, show_default=True, help="Drives of the cloud.")
@table_options
@answer_options
def command(asked: StudyOptions, file: str, n: int, json_file: Path | None, seed: int) -> None:
    """A page with the drive under sliders: waveform, beat, orders, peak-to-peak, contact, bending, tolerance cloud.

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken. The page opens from
    disk, needs no server, and copies its present point out as a study file or as a command line. Its table
    is the cloud.
    """
    from hdopt.workflow.explore import explore

    result = explore(asked.load(), file, n, seed=seed)
    emit(result.to_dict(), json_file, _lines(result), tables=result)


def _lines(result: ExploreResult) -> Iterator[str]:
    cloud = f" with a cloud of {counted(result.drives, 'drive')}" if result.drives else ""
    yield f"{result.study}: explorer{cloud}"
    for note in result.notes:
        yield f"  note: {note}"
