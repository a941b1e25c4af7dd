"""`hdopt search`: which design, and what it costs."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import click

from hdopt.cli.common import StudyOptions, answer_options, emit, engine_option, study_options, table_options


@click.command()
@table_options
@study_options
@click.option("--fronts/--no-fronts", default=True, help="Also trace the fronts between the two objectives.")
@engine_option
@answer_options
def command(asked: StudyOptions, fronts: bool, json_file: Path | None, seed: int) -> int:
    """Which design: profile, structure, pressure angle, width, module and deflection; and what they cost.

    STUDY is a study file or a shipped study; its [search] section says what may vary. Ctrl-C ends with the best so far.
    Exit status 1 where no design meets all limits.
    """
    from hdopt.optimize.summary import result_lines
    from hdopt.workflow.search import search

    result = search(asked.load(), seed, _stages() if sys.stderr.isatty() else lambda stage: None, fronts)
    emit(result.to_dict(), json_file, result_lines(result), tables=result)
    return 0 if result.feasible else 1


def _stages() -> Callable[[str], None]:
    from tqdm import tqdm

    bar = tqdm(desc="hdopt search", file=sys.stderr, leave=False)

    def tell(stage: str) -> None:
        bar.set_postfix_str(stage)
        bar.update(1)

    return tell
