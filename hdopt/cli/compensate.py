"""`hdopt compensate`: what a controller can subtract, as CSV, JSON or C."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: what click hands over

import click
from click.shell_completion import CompletionItem

from hdopt.cli.common import OutputFile, answer_options, emit, table_options
from hdopt.cli.completion import offered
from hdopt.cli.recorded import RecordingOptions, recording_options
from hdopt.words import counted

if TYPE_CHECKING:
    from hdopt.workflow.compensate import Compensated


class Terms(click.ParamType):  # type: ignore[type-arg]  # generic in newer Click only
    """A whole number, or auto (None)."""

    name = "N|auto"

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> int | None:
        if value is None or value == "auto":
            return None
        try:
            return int(value)
        except ValueError:
            self.fail(f"{value!r} is neither a whole number nor auto", parameter, context)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return offered(lambda: ("auto",))(ctx, param, incomplete)


@click.command()
@table_options
@recording_options
@click.option("-o", "output", metavar="FILE", type=OutputFile(), required=True, help="Where the table goes.")
@click.option("--as", "form", type=click.Choice(["csv", "json", "c"]), help="By default what FILE ends with, else CSV.")
@click.option(
    "--terms",
    type=Terms(),
    default="64",
    show_default=True,
    help="Coefficients at most; 0 for a table, auto for 64 or, where these would not do, a table.",
)
@answer_options
def command(
    given: RecordingOptions, output: Path, form: str | None, terms: int | None, json_file: Path | None, seed: int
) -> int:
    """What a controller can subtract from the output's position.

    Indexed by input angle and output angle. Fitted to REC, chosen and judged on recordings, output turns or reversals
    that the fit did not see. Exit status 1, and no file, where it would be no better than nothing beyond chance.
    """
    from hdopt.compensation.writers import FORMATS
    from hdopt.workflow.compensate import compensate, write_compensation

    found = compensate(given.recordings, given.source(), terms, seed)
    ending = output.suffix.lower().lstrip(".")
    form = form or (ending if ending in FORMATS else "csv")
    try:
        write_compensation(found, {form: output})
    finally:
        emit(found.to_dict(str(output) if found.worth else None), json_file, _lines(found, output), tables=found)
    return 0 if found.worth else 1


def _lines(found: Compensated, output: Path) -> Iterator[str]:
    from hdopt.compensation.applied import crossing_deg

    yield f"held out: {found.held_out}; method: {found.method}"
    yield (
        f"peak-to-peak on what the fit did not see: {found.before:.4g} arcmin without, {found.after:.4g} with; expect "
        f"{found.predicted:.4g} ({found.low:.4g} to {found.high:.4g}) of a fresh recording of this length"
    )
    for way, left in found.both.items():
        one = found.ways[way]
        yield f"  {way}: {left:.4g} arcmin left, expect {one.expected:.4g} ({one.low:.4g} to {one.high:.4g})"
    if found.found.crossing.deg:
        straight = found.found.crossing.straight
        way = "play crosses" if straight else "nine tenths of the return error cross"
        yield f"  after a reversal {way} over about {crossing_deg(found.found.crossing):.2g} deg of output"
    if len(found.recordings) > 1:
        for part in found.recordings:
            rate = "" if part.speed_rpm is None else f" at {part.speed_rpm:.4g} r/min"
            expected = f"expect {part.expected:.4g} ({part.low:.4g} to {part.high:.4g})"
            yield f"  {part.name}{rate}: {part.before:.4g} -> {part.after:.4g} arcmin, {expected}"
    for speed, one in found.speeds.items():
        yield f"  at {speed:.4g} r/min: expect {one.expected:.4g} ({one.low:.4g} to {one.high:.4g}) arcmin"
    yield from _speed_lines(found.to_dict(None)["of_speed"])
    for warning in found.warnings:
        yield f"note: {warning}"
    if found.worth:
        from hdopt.workflow.compensate import homing_words

        yield homing_words(found.homing)
        yield f"void {found.void}"
    elif not found.judged:
        yield (
            f"nothing written: {counted(found.stretches, 'stretch', 'stretches')} of an eighth of an output turn: "
            "too few to say whether that is chance; record three of them at least (more than a quarter of an output "
            "turn in all), better two output turns"
        )
    else:
        yield (
            f"nothing written: no better than no compensation beyond chance ({found.evidence:.2g} standard errors on "
            "held-out stretches); record more output turns or less noise"
        )


def _speed_lines(told: dict[str, Any] | None) -> Iterator[str]:
    """How the table depends on the speed, as `told` in JSON; nothing where it does not."""
    if told is None:
        return
    if told["lag_arcmin_per_rpm"]:
        yield (
            f"  grows with the speed by {told['lag_arcmin_per_rpm']:.3g} arcmin for each r/min of the input: a delay "
            "of one channel, or drag; where the controller reads other channels than the recording, record with those"
        )
    for one in told["speeds"]:
        if one["terms"]:
            yield f"  at {one['speed_rpm']:.4g} r/min {counted(one['terms'], 'term')} of its own"
    yield "the table takes the input's speed: hdopt_error_arcmin(input_rad, output_rad, path, input_rpm)"
