"""`hdopt stack`: Monte Carlo stack of the tolerances."""

from __future__ import annotations

from typing import Any

import click

from hdopt.cli.common import (
    check_option,
    drive_option,
    emit,
    engine_option,
    finished_parts_kept,
    json_option,
    resume_option,
    seed_option,
    set_option,
    status,
    study_argument,
    watched,
)


@click.command()
@study_argument
@drive_option
@set_option
@click.option("-n", "n", type=click.IntRange(1, 10**13), default=2**18, show_default=True, help="Samples in all.")
@click.option("--tail", type=float, metavar="LIMIT", help="Also the probability of exceeding LIMIT, down to 1e-7.")
@click.option("--worst-case", is_flag=True, help="Also the worst case over the tolerance box, with its certificate.")
@click.option("--quantile", "quantiles", type=float, multiple=True, help="A further quantile; may be repeated.")
@click.option(
    "--sampling",
    default="sobol",
    metavar="KIND",
    show_default=True,
    help="'sobol', 16 scramblings, or 'monte-carlo', independent points.",
)
@resume_option
@engine_option
@check_option
@json_option
@seed_option
def command(study: str | None, drive: str | None, overrides: tuple[str, ...], resume: bool, **options: Any) -> int:
    """Monte Carlo stack of the tolerances: distribution, yield, Ppk; tails and worst case on request.

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken.
    """
    from hdopt.study import load_study
    from hdopt.workflow.requirement import of_stack
    from hdopt.workflow.stack import stack

    loaded, json_file = load_study(study, overrides, drive), options.pop("json_file")
    with finished_parts_kept(loaded, resume):
        result = stack(loaded, engine=watched("samples"), **options)
    verdict = of_stack(result)
    emit(result.to_dict(), json_file, _lines(result), verdict)
    return status(True, verdict)


def _lines(result):
    stack = result.stack
    unit, line = stack.unit, stack.linearisation

    def row(label, estimate, form=".4f", unit=unit):
        text = f"{estimate.value:9{form}}  ({estimate.low:{form}} to {estimate.high:{form}})"
        return f"  {label:34s} {text} {unit}"

    yield f"{result.study}: {stack.n} drives, {stack.sampling}; limit {stack.limit:g} {unit}"
    yield row("mean", stack.mean)
    yield row("standard deviation", stack.std)
    for q, estimate in stack.quantiles.items():
        yield row(f"quantile {q:g}", estimate)
    yield row(f"yield (required {stack.required_yield:g})", stack.conforming, ".5f", "")
    yield row("beyond the limit", stack.ppm, ".0f", "ppm")
    if stack.ppk is not None:
        yield row("Ppk, (U - X50)/(X99.865 - X50)", stack.ppk, ".3f", "")
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
