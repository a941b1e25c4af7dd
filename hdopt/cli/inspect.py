"""`hdopt inspect`: the acceptance sheet of a drive from its recordings, or one line for each of many drives."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: what the command's other options give

import click

from hdopt.cli.common import OutputFile, answer_options, emit, engine_option, table_options
from hdopt.cli.recorded import RecordingOptions, recording_options

if TYPE_CHECKING:
    from hdopt.recordings.sheet import Batch, Inspection

UNITS = {"slope": "arcmin/deg"}


@click.command()
@table_options
@recording_options
@click.option("--limit", "limits", metavar="NAME=VALUEarcmin,...", help="Limits, such as peak_to_peak=1.0arcmin.")
@click.option("--each", is_flag=True, help="Each file is a drive of its own: one table, one plot, Ppk.")
@click.option("--mounting", "mountings", metavar="A,A,B,...", help="The mounting of each file: gauge study.")
@click.option("--speed-rpm", type=float, help="Input speed for the slope in time.")
@click.option("--serial", default="", help="Serial number, for the sheet.")
@click.option("--conditions", default="", help="Conditions in words, for the sheet.")
@click.option("--check", is_flag=True, help="End with status 1 where a limit is missed (not where it is undecided).")
@click.option("--report", "report_file", metavar="FILE", type=OutputFile(), help="Write a one-page HTML report.")
@click.option("--write-bench", "bench_out", metavar="FILE", type=OutputFile(), help="Write what was understood.")
@engine_option
@answer_options
def command(given: RecordingOptions, **options: Any) -> int:
    """The acceptance sheet of a drive: peak-to-peak, return error, repeatability, slope, orders, checks, limits.

    REC are files of one drive (with --each, of one drive each): .csv and other text, .parquet, .mat, .h5, .tdms, .mcap,
    ROS bags, PHD2 guide logs, .mf4. Exit status 1 with --check where a limit is missed.
    """
    from hdopt.recordings.decision import parse_limits

    limits = parse_limits(options["limits"]) or None
    return (_each if options["each"] else _one)(given, limits, options)


def _one(given: RecordingOptions, limits: dict[str, float] | None, options: dict[str, Any]) -> int:
    from hdopt.workflow.acceptance_sheet import SheetLabel
    from hdopt.workflow.inspect import inspect, write_inspection

    source = given.source()
    found = inspect(
        given.recordings,
        source,
        limits,
        speed_rpm=options["speed_rpm"],
        mountings=[name.strip() for name in (options["mountings"] or "").split(",") if name.strip()],
        label=SheetLabel(options["serial"], options["conditions"]),
        seed=options["seed"],
    )
    try:
        write_inspection(found, _files(options), given.recordings, source)
    finally:
        emit(found.to_dict(), options["json_file"], _lines(found), tables=found)
    return 1 if options["check"] and found.missed else 0


def _files(options: dict[str, Any]) -> dict[str, Path]:
    wanted = {"report": options["report_file"], "bench": options["bench_out"]}
    return {kind: path for kind, path in wanted.items() if path is not None}


def _each(given: RecordingOptions, limits: dict[str, float] | None, options: dict[str, Any]) -> int:
    from hdopt.workflow.inspect_many import inspect_many, write_batch

    batch = inspect_many(given.recordings, given.source(), limits, options["seed"])
    try:
        write_batch(batch, _files(options))
    finally:
        emit(batch.to_dict(), options["json_file"], _batch_lines(batch), tables=batch)
    return 1 if options["check"] and batch.missed else 0


def _lines(found: Inspection) -> Iterator[str]:
    from hdopt.recordings.decision import verdict_line

    for said in found.understood:
        yield f"read: {said}"
    if len(found.one_turn):
        t = found.one_turn
        spread = f"{t.mean():.4g} arcmin mean, {t.min():.4g} to {t.max():.4g}"
        yield f"peak-to-peak over one input turn: {spread}, {len(t)} turns"
    yield f"peak-to-peak over the recording ({found.turns:.4g} input turns): {found.recording_peak_to_peak:.4g} arcmin"
    if found.beat is not None:
        b = found.beat
        yield f"peak-to-peak over the full beat ({b.source}): {b.value:.4g} arcmin ({b.low:.4g} to {b.high:.4g})"
        yield "  this is what a maker's angular transmission accuracy means: one output turn, one direction"
    else:
        yield "peak-to-peak over the full beat: not known; record a whole output turn, or a quarter of one with --drive"
    yield f"rms: {found.rms:.4g} arcmin; steepest slope: {found.slope_per_deg:.4g} arcmin per deg of input" + (
        f", {found.slope_arcsec_per_s:.4g} arcsec/s" if found.slope_arcsec_per_s is not None else ""
    )
    yield from _lines_of_repeats(found)
    for line in sorted(found.orders, key=lambda o: -o.amplitude_arcmin)[:6]:
        apart = "" if line.separable else " (not separable from its neighbours in this record)"
        yield f"order {line.symbol:10s} {line.amplitude_arcmin:.4f} arcmin  {line.origin}{apart}"
    for name, said in found.checks.items():
        yield f"check {name}: {said}"
    for warning in found.warnings:
        yield f"note: {warning}"
    for limit in found.limits:
        yield verdict_line(limit, UNITS)


def _lines_of_repeats(found: Inspection) -> Iterator[str]:
    if found.returned is not None:
        yield f"return error: {found.returned.median:.4g} arcmin median, {found.returned.largest:.4g} largest"
    if found.repeatability is not None:
        yield f"repeatability: {found.repeatability:.4g} arcmin"
    if found.gauge is not None:
        g = found.gauge
        yield f"gauge: repeatability {g.repeatability:.3g}, reproducibility of mountings {g.reproducibility:.3g} arcmin"
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
            yield f"{drive.name}: peak-to-peak {drive.peak_to_peak:.4g} arcmin ({drive.verdict or 'no limit'}){mark}"
    if batch.performance is not None:
        p = batch.performance
        yield f"Ppk {p.ppk:.3g} ({p.low:.3g} to {p.high:.3g}), {p.n} drives, limit {batch.limit:g} arcmin"
    elif batch.limit is not None:
        yield "Ppk: too few drives (8 at least)"
