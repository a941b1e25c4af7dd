"""`hdopt search`: which design, and what it costs."""

from __future__ import annotations

import sys

import click

from hdopt.cli.common import drive_option, emit, engine_option, json_option, seed_option, set_option, study_argument


@click.command()
@study_argument
@drive_option
@set_option
@click.option("--fronts/--no-fronts", default=True, help="Also trace the fronts between the two objectives.")
@engine_option
@json_option
@seed_option
def command(study, drive, overrides, fronts, json_file, seed) -> int:
    """Which design: profile, structure, pressure angle, width, module and deflection; and what they cost.

    STUDY is a study file or a shipped study; its [search] section says what may vary. Ctrl-C ends with the best so far.
    Exit status 1 where no design meets all limits.
    """
    from hdopt.optimize.summary import result_lines
    from hdopt.study import load_study
    from hdopt.workflow.search import search

    loaded = load_study(study, overrides, drive)
    result = search(loaded, seed, _stages() if sys.stderr.isatty() else lambda stage: None, fronts)
    emit(result.to_dict(), json_file, result_lines(result))
    return 0 if result.feasible else 1


def _stages():
    from tqdm import tqdm

    bar = tqdm(desc="hdopt search", file=sys.stderr, leave=False)

    def tell(stage: str) -> None:
        bar.set_postfix_str(stage)
        bar.update(1)

    return tell
