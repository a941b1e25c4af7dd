"""`hdopt allocate`: least-cost tolerances."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import StudyOptions, emit, status, study_options, table_options, work_options
from hdopt.cli.completion import offered, rules
from hdopt.cli.log import looked_at

if TYPE_CHECKING:
    from hdopt.allocation.results import AllocateResult


@click.command()
@table_options
@study_options
@click.option(
    "--rule",
    metavar="RULE",
    shell_complete=offered(rules),
    help="worst_case, rss or yield; the study's own if omitted.",
)
@click.option("--compare/--no-compare", default=None, help="Also the other rules, in one table.")
@work_options
def command(asked: StudyOptions, rule: str | None, compare: bool | None, json_file: Path | None, seed: int) -> int:
    """Least-cost tolerances that keep the requirement, verified once on a fresh seed.

    STUDY is a study file or a shipped study with costs. Exit status 1: the requirement cannot be met.
    """
    from threading import get_ident

    from hdopt.allocation.convex import Infeasible
    from hdopt.workflow.allocate import allocate
    from hdopt.workflow.allocation_stages import AllocationWatch
    from hdopt.workflow.requirement import of_allocation

    loaded, watch = asked.load(), AllocationWatch(get_ident())
    try:
        with looked_at("allocation", watch.words):
            result = allocate(loaded, rule, compare=compare, seed=seed, progress=watch.rules)
    except Infeasible as error:
        answer = {
            "study": loaded.name,
            "status": "infeasible",
            "reason": str(error),
            "best_reachable": error.best_reachable,
        }
        emit(answer, json_file, ())
        print(f"hdopt: {error}", file=sys.stderr)
        return 1
    verdict = of_allocation(result)
    emit(result.to_dict(), json_file, _lines(result), verdict, tables=result)
    return status(result.accepted, verdict)


def _lines(result: AllocateResult) -> Iterator[str]:
    yield f"{result.study}: {result.rule} rule, limit {result.limit:g} {result.unit}: {result.status}"
    yield f"  {'':32s} {'tolerance':>12s} {'present':>12s} {'cost':>9s} {'present':>9s}"
    for name, row in result.errors.items():
        grade = f"  {row.grade}" if row.grade else ""
        flag = f" (extrapolated: {row.extrapolated})" if row.extrapolated else ""
        yield (
            f"  {name:32s} {row.tolerance:12.6g} {row.present:12.6g} {row.cost:9.4f} {_cost(row.present_cost)} "
            f"{row.unit}{grade}{flag}"
        )
    yield f"  {'total cost':58s} {result.total_cost:9.4f} {_cost(result.present_cost)}"
    gap = "not known" if result.optimality_gap is None else f"{result.optimality_gap:.2g}"
    yield f"  optimality gap {gap}: {result.optimality_gap_reason}"
    if result.marginal_cost is not None:
        yield f"  marginal cost of the requirement {result.marginal_cost:.5g} ({result.marginal_cost_reason})"
    check = result.verified_yield
    yield f"  verified yield {check.value:.6f} ({check.low:.6f} to {check.high:.6f}), n = {result.verify_n}"
    for outcome in result.comparison:
        share = outcome.conforming
        if not outcome.tolerances:
            yield f"  {outcome.rule:14s} {outcome.note}"
            continue
        yield (
            f"  {outcome.rule:14s} cost {_cost(outcome.total_cost)}  yield {share.value:.5f} "
            f"({share.low:.5f} to {share.high:.5f}) {outcome.note}"
        )
    if result.cost_curve:
        yield "  least cost over the limit, before the correction by a larger sample that the total has:"
    for limit, cost in result.cost_curve:
        yield f"  limit {limit:9.5g} {result.unit}: cost {cost:.4f}"
    for note in result.notes:
        yield f"  note: {note}"


def _cost(value: float) -> str:
    return f"{'unknown':>9s}" if isnan(value) else f"{value:9.4f}"
