"""`hdopt search`: which design, and what it costs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import OutputFile, StudyOptions, emit, status, study_options, table_options, work_options
from hdopt.cli.log import lines_in_a_log

if TYPE_CHECKING:
    from hdopt.optimize.records import SearchResult


@click.command()
@table_options
@study_options
@click.option("--fronts/--no-fronts", default=True, help="Also trace the fronts between the two objectives.")
@click.option(
    "--regions/--no-regions",
    default=None,
    help="Also follow each constant of the trade to where another choice is the better; as [search] regions if left.",
)
@click.option(
    "--write-study", "study_file", metavar="FILE", type=OutputFile(), help="Write the best design as a study (TOML)."
)
@work_options
def command(
    asked: StudyOptions, fronts: bool, regions: bool | None, study_file: Path | None, json_file: Path | None, seed: int
) -> int:
    """Which design: profile, structure, pressure angle, width, module and deflection; and what they cost.

    STUDY is a study file or a shipped study; its [search] section says what may vary. Ctrl-C ends with the best so far.
    Exit status 1 where no design meets all limits.
    """
    from hdopt.workflow.requirement import of_search
    from hdopt.workflow.search import search, write_search

    loaded = asked.load()
    with _stages(loaded.name) as tell:
        result = search(loaded, seed, tell, fronts, regions=regions)
    verdict = of_search(loaded, result)
    try:
        write_search(result, {"study": study_file} if study_file else {}, loaded)
    finally:
        emit(result.to_dict(), json_file, _lines(result, study_file), verdict, tables=result)
    return status(result.feasible, verdict)


def _lines(result: SearchResult, study_file: Path | None) -> Iterator[str]:
    from hdopt.optimize.summary import result_lines

    yield from result_lines(result)
    if study_file is not None and not result.feasible:
        yield f"  not written, as no design keeps the limits: {study_file}"


@contextmanager
def _stages(label: str) -> Iterator[Callable[[str], None]]:
    """A function to tell the stages of a search to: a bar on a terminal, else a line now and then."""
    if not sys.stderr.isatty():
        with lines_in_a_log(label) as log:
            yield log.begin
        return
    from tqdm import tqdm

    with tqdm(desc="hdopt search", file=sys.stderr, leave=False) as bar:

        def tell(stage: str) -> None:
            bar.set_postfix_str(stage)
            bar.update(1)

        yield tell
