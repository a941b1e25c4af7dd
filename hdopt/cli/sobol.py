"""`hdopt sobol`: which tolerances matter."""

from __future__ import annotations

import click

from hdopt.cli.common import drive_option, emit, json_option, seed_option, set_option, study_argument, watched


@click.command()
@study_argument
@drive_option
@set_option
@click.option("-n", "n", type=click.IntRange(min=1), default=2**14, show_default=True, help="Base points in all.")
@click.option("--no-second-order", is_flag=True, help="Leave out the indices of pairs.")
@click.option("--shapley", metavar="PLAYERS", help="Also Shapley effects of 'inputs' or 'groups'.")
@click.option("--engine", metavar="ENGINE", help="process, threads or dask://HOST:PORT; threads if omitted.")
@json_option
@seed_option
def command(study, drive, overrides, n, no_second_order, shapley, engine, json_file, seed) -> None:
    """Which tolerances matter: Sobol' indices with 95 % intervals, Shapley effects where inputs are correlated.

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken.
    """
    from hdopt.study import load_study
    from hdopt.tolerancing import sobol

    result = sobol(
        load_study(study, overrides, drive),
        n,
        second_order=not no_second_order,
        shapley=shapley,
        seed=seed,
        engine=watched(engine, "scramblings"),
    )
    emit(result.to_dict(), json_file, _lines(result))


def _span(estimate) -> str:
    return f"{estimate.value:7.4f} ({estimate.low:7.4f} to {estimate.high:7.4f})"


def _lines(result):
    part = result.sobol or result.shapley
    yield f"{result.study}: n = {part.n}, {part.evaluations} drives; {part.interval}"
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
