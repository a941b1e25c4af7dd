"""`hdopt export`: the wave generator as files that a shop can trust."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar  # Any: what the command's other options give; values of JSON

import click

from hdopt.cli.common import (
    CHECK,
    OutputFile,
    StudyOptions,
    answer_options,
    emit,
    structure_option,
    study_options,
    table_options,
)
from hdopt.cli.completion import a_file
from hdopt.words import settled

if TYPE_CHECKING:
    from hdopt.geometry.export import ExportResult

R = TypeVar("R")

FILES = {
    "step": "STEP assembly (AP214, or --set export.step_schema=AP242).",
    "dxf": "DXF of all parts for wire cutting: through and blind outlines, tolerance zone.",
    "stl": "STL mesh of all parts in their places.",
    "3mf": "3MF mesh with named, coloured parts.",
    "svg": "Drawing: front view with dimensions, section, key dimensions.",
    "png": "Rendered picture of the parts, pulled apart.",
    "pdf": "Drawings: assembly and a sheet for each part.",
    "drawings": "ZIP of the same sheets as SVG and DXF.",
    "cam": "CSV of the cam: angle, radius, normal, curvature.",
    "gcode": "G-code for a two-axis cam grinder (RS-274).",
    "inspection": "CSV of the inspection plan.",
    "mating": "CSV of what shaft, housing and seats must keep.",
}
"""Format, which names the option -> its help."""


def file_options(command: Callable[..., R]) -> Callable[..., R]:
    """An option for each of `FILES`; the `command` gets those that were given as `files`, format -> path."""
    names = {f"file_{kind}": kind for kind in FILES}

    @functools.wraps(command)
    def bundled(*args: Any, **options: Any) -> R:  # what all options of the command give
        files = {names[name]: options.pop(name) for name in tuple(options) if name in names}
        return command(*args, files={kind: path for kind, path in files.items() if path}, **options)

    decorated: Callable[..., R] = bundled
    for name, kind in reversed(names.items()):
        decorated = click.option(f"--{kind}", name, metavar="FILE", type=OutputFile(), help=FILES[kind])(decorated)
    return decorated


@click.command()
@table_options
@study_options
@structure_option
@file_options
@click.option("--context", is_flag=True, help="With bearing races, flexspline ring and circular spline.")
@click.option(
    "--check",
    is_flag=True,
    expose_value=False,
    callback=lambda ctx, parameter, value: ctx.meta.__setitem__(CHECK, value),
    help="End with status 1 where a budget is not kept.",
)
@click.option(
    "--allocation",
    metavar="FILE",
    shell_complete=a_file,
    help="Tolerances from the JSON that `hdopt allocate` wrote.",
)
@answer_options
def command(
    asked: StudyOptions,
    structure: str | None,
    files: Mapping[str, Path],
    context: bool,
    allocation: str | None,
    json_file: Path | None,
    seed: int,
) -> int:
    """The wave generator as checked files: STEP, DXF, STL, 3MF, a drawing (SVG) and a picture (PNG).

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken. Every file is read back
    from disk and compared with closed-form values before it bears its name; exit status 1 says that one failed, and
    then none is left. Without a file, the key dimensions are printed and nothing is written. The last line says whether
    fits, clearances and tolerances keep the bounds of eccentricity and tilt; files are written in either case, and
    --check makes it exit status 1 where they do not.
    """
    from hdopt.geometry.check import CheckFailed
    from hdopt.workflow.export import export

    chosen = [f"wave_generator.structure={structure}"] if structure else []
    chosen += ["export.context=true"] if context else []
    loaded = asked.load(*chosen)
    try:
        result = export(loaded, files, allocation)
    except CheckFailed as failed:
        print(f"hdopt: {failed}", file=sys.stderr)
        return 1
    emit(result.to_dict(), json_file, _lines(result), tables=result, of_files=_of_files(result))
    return 0 if result.budgets_kept or not click.get_current_context().meta.get(CHECK) else 1


def _of_files(result: ExportResult) -> dict[str, str]:
    """What is said of each of the files, by its path."""
    instead = {kind: ", in place of an earlier file" for kind in result.to_dict()["replaced"]}
    return {
        str(path): f"{kind}, read back and checked{instead.get(kind, '')}"
        for kind, path in result.to_dict()["files"].items()
    }


def _lines(result: ExportResult) -> Iterator[str]:
    values = result.to_dict()
    yield f"{result.identity.title}, {values['structure']}, fingerprint {values['fingerprint']}"
    yield ""
    yield f"  {'part':16s} {'volume, mm^3':>14s}   {'x, mm':>10s} {'y, mm':>10s} {'z, mm':>10s}"
    for part in values["parts"]:
        size = " ".join(f"{extent:10.4f}" for extent in part["bounding_box_mm"])
        yield f"  {part['name']:16s} {part['volume_mm3']:14.3f}   {size}"
    yield ""
    yield f"  {'key dimension':52s} {'mm':>9s}  tolerance"
    for row in result.dimensions:
        nominal = "" if row.nominal is None else f"{row.nominal:.4f}"
        yield f"  {row.part + ': ' + row.name:52s} {nominal:>9s}  {row.tolerance}  [{row.source}]"
    yield from _budget_lines(values["budgets"])
    if result.model.assumptions:
        yield ""
        yield "  assumed, not given by the study:"
        for assumption in result.model.assumptions:
            yield f"    {assumption}"
    for note in values["notes"]:
        yield f"  note: {note}"
    yield ""
    if result.profile_deviation_um is not None:
        off = settled(result.profile_deviation_um)
        within = f"within {off:.2g} um of" if off else "to rounding"
        yield f"  profile in the files: {within} the analytic curve"
    if not values["files"]:
        yield "  nothing written: give --step, --dxf, --svg, --cam or another option that names a file"
    for budget in result.model.plan.budgets:
        if not budget.met:
            yield f"  {budget.verdict}"
    if result.model.plan.budgets and result.budgets_kept:
        yield "  all budgets are kept"


def _budget_lines(budgets: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for budget in budgets:
        verdict = "kept" if budget["met"] else "NOT KEPT"
        yield ""
        spent, unit = settled(budget["spent"]), budget["unit"]
        yield f"  budget of {budget['of']}: {spent:.4g} of {budget['allowed']:.4g} {unit}, {verdict}"
        for share in budget["shares"]:
            label = f"{share['feature']}: {share['callout']}"
            yield f"    {label:72s} {settled(share['takes']):9.4g} {unit}"
