"""`hdopt inspect`: the acceptance sheet of a drive from its recordings, or one line for each of many drives."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar  # Any: what the command's other options give

import click

from hdopt.cli.common import OutputFile, answer_options, engine_option, table_options
from hdopt.cli.each import EachOptions, each_options, emit_written
from hdopt.cli.recorded import RecordingOptions, recording_options
from hdopt.words import counted

if TYPE_CHECKING:
    from hdopt.recordings.sheet import Batch, Inspection

R = TypeVar("R")

UNITS = {"slope": "arcmin/deg"}
NIL_ARCMIN = 5e-5
"""An order below it would be shown as 0.0000."""


@dataclass(frozen=True)
class SheetOptions:
    """What is asked of a sheet: `limits` by name (arcmin; None for those of the study), `speed_rpm` of the input for
    the slope in time, the `mountings` of the files, `serial` number and `conditions` in words, and the `files` to write
    ("report", "bench" -> path)."""

    limits: Mapping[str, float] | None
    speed_rpm: float | None
    mountings: tuple[str, ...]
    serial: str
    conditions: str
    files: Mapping[str, Path]

    def of_one_drive(self) -> tuple[str, ...]:
        """The options given that say something of a single drive only."""
        given = {
            "--mounting": self.mountings,
            "--speed-rpm": self.speed_rpm,
            "--serial": self.serial,
            "--conditions": self.conditions,
            "--write-bench": "bench" in self.files,
        }
        return tuple(name for name, value in given.items() if value)


def sheet_options(command: Callable[..., R]) -> Callable[..., R]:
    """What is asked of a sheet, as options of a `command`, which gets them as its second argument, a `SheetOptions`."""

    @functools.wraps(command)
    def bundled(
        given: RecordingOptions,
        *,
        limits: tuple[str, ...],
        speed_rpm: float | None,
        mountings: str | None,
        serial: str,
        conditions: str,
        report_file: Path | None,
        bench_out: Path | None,
        **others: Any,  # what the command's own options give
    ) -> R:
        from hdopt.recordings.decision import parse_limits

        wanted = {"report": report_file, "bench": bench_out}
        asked = SheetOptions(
            parse_limits(",".join(limits)) or None,
            speed_rpm,
            tuple(name.strip() for name in (mountings or "").split(",") if name.strip()),
            serial,
            conditions,
            {kind: path for kind, path in wanted.items() if path is not None},
        )
        return command(given, asked, **others)

    options = (
        click.option(
            "--limit",
            "limits",
            metavar="NAME=VALUEarcmin,...",
            multiple=True,
            help="Limits, such as peak_to_peak=1.0arcmin; may be repeated.",
        ),
        click.option("--mounting", "mountings", metavar="A,A,B,...", help="The mounting of each file: gauge study."),
        click.option("--speed-rpm", type=float, help="Input speed for the slope in time."),
        click.option("--serial", default="", help="Serial number, for the sheet."),
        click.option("--conditions", default="", help="Conditions in words, for the sheet."),
        click.option(
            "--report", "report_file", metavar="FILE", type=OutputFile(), help="Write a one-page HTML report."
        ),
        click.option(
            "--write-bench", "bench_out", metavar="FILE", type=OutputFile(), help="Write what was understood."
        ),
    )
    decorated: Callable[..., R] = bundled
    for option in reversed(options):
        decorated = option(decorated)
    return decorated


@click.command()
@table_options
@recording_options
@sheet_options
@each_options("Each file is a drive of its own: one table, one plot, Ppk.")
@click.option("--check", is_flag=True, help="End with status 1 where a limit is missed (not where it is undecided).")
@engine_option
@answer_options
def command(
    given: RecordingOptions,
    asked: SheetOptions,
    batch: EachOptions,
    check: bool,
    json_file: Path | None,
    seed: int,
) -> int:
    """The acceptance sheet of a drive: peak-to-peak, return error, repeatability, slope, orders, checks, limits.

    REC are files of one drive (with --each, of one drive each): .csv and other text, .parquet, .mat, .h5, .tdms, .mcap,
    ROS bags, PHD2 guide logs, .mf4. Exit status 1 with --check where a limit is missed.
    """
    options = (given, asked, json_file, seed)
    missed = batch.work(given, lambda: _one(*options), lambda: _each(*options), asked.of_one_drive())
    return 1 if check and missed else 0


def _one(given: RecordingOptions, asked: SheetOptions, json_file: Path | None, seed: int) -> bool:
    """The sheet of one drive, said and written; whether a limit is missed."""
    from hdopt.workflow.acceptance_sheet import SheetLabel
    from hdopt.workflow.inspect import inspect, write_inspection

    source = given.source()
    found = inspect(
        given.recordings,
        source,
        asked.limits,
        speed_rpm=asked.speed_rpm,
        mountings=asked.mountings,
        label=SheetLabel(asked.serial, asked.conditions),
        seed=seed,
    )
    files, names = asked.files, given.recordings
    lines = _lines(found, given.drive == "none")
    emit_written(found, json_file, lines, lambda: write_inspection(found, files, names, source))
    return found.missed


def _each(given: RecordingOptions, asked: SheetOptions, json_file: Path | None, seed: int) -> bool:
    """The table of many drives, said and written; whether one of them misses a limit."""
    from hdopt.workflow.inspect_many import inspect_many, write_batch

    batch = inspect_many(given.recordings, given.source(), asked.limits, seed)
    emit_written(batch, json_file, _batch_lines(batch), lambda: write_batch(batch, asked.files))
    return batch.missed


def _lines(found: Inspection, no_drive: bool) -> Iterator[str]:
    from hdopt.recordings.decision import verdict_line

    for said in found.understood:
        yield f"read: {said}"
    if len(found.one_turn):
        t = found.one_turn
        spread = f"{t.mean():.4g} arcmin mean, {t.min():.4g} to {t.max():.4g}"
        yield f"peak-to-peak over one input turn: {spread}, {counted(len(t), 'turn')}"
    if found.locked:
        yield "peak-to-peak, rms, slope and drift over the input's turns: none, the input is locked"
    else:
        yield from _lines_of_turning(found, no_drive)
    yield from _lines_of_repeats(found)
    for line in sorted(found.orders, key=lambda o: -o.amplitude_arcmin)[:6]:
        if line.amplitude_arcmin < NIL_ARCMIN:
            break
        apart = "" if line.separable else " (not separable from its neighbours in this record)"
        yield f"order {line.symbol:10s} {line.amplitude_arcmin:.4f} arcmin  {line.origin}{apart}"
    for name, said in found.checks.items():
        yield f"check {name}: {said}"
    for warning in found.warnings:
        yield f"note: {warning}"
    for limit in found.limits:
        yield verdict_line(limit, UNITS)


def _lines_of_turning(found: Inspection, no_drive: bool) -> Iterator[str]:
    """The figures that need an input that turns."""
    turns = counted(f"{found.turns:.4g}", "input turn")
    yield f"peak-to-peak over the recording ({turns}): {found.recording_peak_to_peak:.4g} arcmin"
    if found.beat is not None:
        b = found.beat
        yield f"peak-to-peak over the full beat ({b.source}): {b.value:.4g} arcmin ({b.low:.4g} to {b.high:.4g})"
        yield "  this is what a maker's angular transmission accuracy means: one output turn, one direction"
    else:
        how = " with --drive" if no_drive else ""
        yield f"peak-to-peak over the full beat: not known; record a whole output turn, or a quarter of one{how}"
    slope = "steepest slope: not known, the input turns too little"
    if found.slope_per_deg is not None:
        slope = f"steepest slope: {found.slope_per_deg:.4g} arcmin per deg of input"
    rate = "" if found.slope_arcsec_per_s is None else f", {found.slope_arcsec_per_s:.4g} arcsec/s"
    yield f"rms: {found.rms:.4g} arcmin; {slope}{rate}"


def _lines_of_repeats(found: Inspection) -> Iterator[str]:
    if found.returned is not None:
        yield f"return error: {found.returned.median:.4g} arcmin median, {found.returned.largest:.4g} largest"
    if found.repeatability is not None:
        yield f"repeatability: {found.repeatability:.4g} arcmin"
    if found.gauge is not None:
        g = found.gauge
        yield f"gauge: repeatability {g.repeatability:.3g}, reproducibility of mountings {g.reproducibility:.3g} arcmin"
    if found.drift is not None:
        yield f"drift over the recording: {found.drift:.3g} arcmin"
    if found.torsion is not None:
        k, t = found.torsion.stiffness, found.torsion.knees
        yield f"stiffness K1 {k[0]:.4g}, K2 {k[1]:.4g}, K3 {k[2]:.4g} Nm/rad, knees {t[0]:.3g} and {t[1]:.3g} Nm"
        if found.torsion.hysteresis_loss_arcmin is not None:
            yield f"hysteresis loss: {found.torsion.hysteresis_loss_arcmin:.3g} arcmin at zero torque"
    if found.starting_torque is not None:
        yield f"starting torque: {found.starting_torque:.3g} Nm"


def _batch_lines(batch: Batch) -> Iterator[str]:
    for drive in batch.drives:
        if drive.error:
            yield f"{drive.name}: not read: {drive.error}"
        else:
            mark = "  <- outlier" if drive.outlier else ""
            height = "none, the input is locked" if drive.peak_to_peak is None else f"{drive.peak_to_peak:.4g} arcmin"
            yield f"{drive.name}: peak-to-peak {height} ({drive.verdict or 'no limit'}){mark}"
    if batch.performance is not None:
        p = batch.performance
        yield f"Ppk {p.ppk:.3g} ({p.low:.3g} to {p.high:.3g}), {counted(p.n, 'drive')}, limit {batch.limit:g} arcmin"
    elif batch.limit is not None:
        yield "Ppk: not known, too few drives (8 at least) or no two that differ"
