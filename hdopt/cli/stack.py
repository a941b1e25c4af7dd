"""`hdopt stack`: Monte Carlo stack of the tolerances."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: what the command's other options give

import click

from hdopt.cli.common import (
    StudyOptions,
    emit,
    finished_parts_kept,
    resume_option,
    status,
    study_options,
    table_options,
    watched,
    work_options,
)
from hdopt.cli.completion import offered, samplings, stack_geometries, unhyphened
from hdopt.cli.whole_number import WholeNumber
from hdopt.words import counted

if TYPE_CHECKING:
    from hdopt.tolerance.intervals import IntervalEstimate
    from hdopt.tolerance.results import StackResult


@click.command()
@table_options
@study_options
@click.option("-n", "n", type=WholeNumber(1, 10**13), default=2**18, show_default=True, help="Samples in all.")
@click.option("--tail", type=float, metavar="LIMIT", help="Also the probability of exceeding LIMIT, down to 1e-7.")
@click.option("--worst-case", is_flag=True, help="Also the worst case over the tolerance box, with its certificate.")
@click.option("--quantile", "quantiles", type=float, multiple=True, help="A further quantile; may be repeated.")
@click.option(
    "--sampling",
    default="sobol",
    metavar="KIND",
    show_default=True,
    shell_complete=offered(samplings),
    help="'sobol', 16 scramblings, or 'monte-carlo', independent points.",
)
@click.option(
    "--geometry",
    default="closed-form",
    metavar="KIND",
    show_default=True,
    shell_complete=offered(stack_geometries),
    callback=unhyphened,
    help="Of the sampled drives: 'closed-form', 'exact' for up to 4096, or 'auto', exact where the former errs.",
)
@resume_option
@work_options
def command(asked: StudyOptions, resume: bool, geometry: str, json_file: Path | None, **options: Any) -> int:
    """Monte Carlo stack of the tolerances: distribution, yield, Ppk; tails and worst case on request.

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken.
    """
    from hdopt.workflow.requirement import of_stack
    from hdopt.workflow.stack import stack, study_problem

    loaded = asked.load()
    with finished_parts_kept(loaded.sha256, resume):
        result = stack(study_problem(loaded).by(geometry), engine=watched("samples"), **options)
    verdict = of_stack(result)
    emit(result.to_dict(), json_file, _lines(result), verdict, tables=result)
    return status(True, verdict)


def _row(label: str, estimate: IntervalEstimate, form: str, unit: str) -> str:
    text = f"{estimate.value:9{form}}  ({estimate.low:{form}} to {estimate.high:{form}})"
    return f"  {label:34s} {text} {unit}"


def _lines(result: StackResult) -> Iterator[str]:
    stack = result.stack
    unit, line = stack.unit, stack.linearisation
    yield f"{result.study}: {counted(stack.n, 'drive')}, {stack.sampling}; limit {stack.limit:g} {unit}"
    yield _row("mean", stack.mean, ".4f", unit)
    yield _row("standard deviation", stack.std, ".4f", unit)
    for q, estimate in stack.quantiles.items():
        yield _row(f"quantile {q:g}", estimate, ".4f", unit)
    yield _row(f"yield (required {stack.required_yield:g})", stack.conforming, ".5f", "")
    yield _row("beyond the limit", stack.ppm, ".0f", "ppm")
    if stack.ppk is not None:
        yield _row("Ppk, (U - X50)/(X99.865 - X50)", stack.ppk, ".3f", "")
    error = stack.rss - stack.required_quantile.value
    yield f"  {'root sum square, same quantile':34s} {stack.rss:9.4f}  ({error:+.4f} against the sample) {unit}"
    if result.worst_case is not None:
        worst = result.worst_case
        bound = "no bound is proven" if worst.bound is None else f"proven: no drive exceeds {worst.bound:.4f}"
        yield f"  {'worst case found':34s} {worst.value:9.4f}  ({bound}) {unit}"
    if result.tail is not None:
        tail = result.tail
        span = f"{tail.probability:.4g} ({tail.low:.4g} to {tail.high:.4g})"
        yield f"  P(above {tail.limit:g} {unit}) = {span}, {tail.method}"
        if tail.note:
            yield f"    {tail.note}"
    yield "  contributions to the variance, linearised at the mean magnitudes"
    for name, share in sorted(line.shares.items(), key=lambda item: -item[1]):
        if share > 5e-4:
            yield f"    {name:34s} {100 * share:5.1f} %"
    for note in (*stack.notes, *result.notes):
        yield f"  note: {note}"
