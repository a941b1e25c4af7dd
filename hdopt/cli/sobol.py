"""`hdopt sobol`: which tolerances matter."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: what the command's other options give

import click

from hdopt.cli.common import StudyOptions, emit, status, study_options, table_options, watched, work_options
from hdopt.cli.completion import offered, sensitivity_methods
from hdopt.cli.whole_number import WholeNumber
from hdopt.words import counted

if TYPE_CHECKING:
    from hdopt.study import Study
    from hdopt.tolerance.intervals import IntervalEstimate
    from hdopt.tolerance.results import SobolResult
    from hdopt.tolerance.screening import Screening


@click.command()
@table_options
@study_options
@click.option("-n", "n", type=WholeNumber(1, 2**30), help="Base points in all; 16384, or the method's own number.")
@click.option(
    "--method",
    metavar="METHOD",
    shell_complete=offered(sensitivity_methods),
    default="sobol",
    show_default=True,
    help="sobol, or by SALib: morris, delta, pawn, rbd_fast, dgsm.",
)
@click.option("--no-second-order", is_flag=True, help="Leave out the indices of pairs.")
@click.option(
    "--shapley",
    metavar="PLAYERS",
    shell_complete=offered(lambda: ("inputs", "groups")),
    help="Also Shapley effects of 'inputs' or 'groups'.",
)
@work_options
def command(asked: StudyOptions, json_file: Path | None, seed: int, **options: Any) -> int:
    """Which tolerances matter: Sobol' indices with 95 % intervals, Shapley effects where inputs are correlated.

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken. Other methods are
    SALib's own, over the percentiles of the inputs.
    """
    from hdopt.workflow.requirement import of_tolerances

    loaded = asked.load()
    result, lines = _analysed(loaded, seed, **options)
    verdict = of_tolerances(loaded, seed)
    emit(result.to_dict(), json_file, lines, verdict, tables=result)
    return status(True, verdict)


def _analysed(
    study: Study, seed: int, method: str, n: int | None, no_second_order: bool, shapley: str | None
) -> tuple[SobolResult | Screening, Iterator[str]]:
    """The result of one method, and its lines for a person."""
    from hdopt.errors import HdoptError
    from hdopt.workflow.stack import SOBOL_N, screen, sobol

    if method == "sobol":
        second, points = not no_second_order, SOBOL_N if n is None else n
        result = sobol(study, points, second_order=second, shapley=shapley, seed=seed, engine=watched("scramblings"))
        return result, _lines(result)
    if shapley is not None or no_second_order:
        raise HdoptError(f"--shapley and --no-second-order go with --method sobol, not with {method}; leave them out")
    screened = screen(study, method, n, seed=seed, engine=watched("blocks"))
    return screened, _screened_lines(screened)


def _screened_lines(result: Screening) -> Iterator[str]:
    yield f"{result.study}: {result.method}, n = {result.n}, {counted(result.evaluations, 'drive')}"
    yield f"  {result.says}"
    measures = list(next(iter(result.inputs.values())))
    yield f"  {'':34s} " + " ".join(f"{measure:>19s}" for measure in measures)
    for name, values in result.inputs.items():
        yield f"  {name:34s} " + " ".join(f"{value:19.4f}" for value in values.values())
    for note in result.notes:
        yield f"  note: {note}"


def _span(estimate: IntervalEstimate) -> str:
    return f"{estimate.value:7.4f} ({estimate.low:7.4f} to {estimate.high:7.4f})"


def _lines(result: SobolResult) -> Iterator[str]:
    part = result.sobol or result.shapley
    assert part is not None, "a result holds indices, effects, or both"
    yield f"{result.study}: n = {part.n}, {counted(part.evaluations, 'drive')}; {part.interval}"
    if result.sobol is not None:
        yield f"  {'':34s} {'first order':28s} total"
        for group in (result.sobol.inputs, result.sobol.groups):
            for name, index in group.items():
                yield f"  {name:34s} {_span(index.S1)}  {_span(index.ST)}"
        strong = sorted(result.sobol.second.items(), key=lambda item: -item[1].value)[:5]
        for (a, b), estimate in strong:
            yield f"  {a + ' x ' + b:63s} {_span(estimate)}"
    if result.shapley is not None:
        yield "  Shapley effects"
        for name, effect in result.shapley.effects.items():
            yield f"  {name:34s} {_span(effect)}"
    for note in result.notes:
        yield f"  note: {note}"
