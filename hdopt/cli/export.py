"""`hdopt export`: the wave generator as files that a shop can trust."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from hdopt.cli.common import OutputFile, drive_option, emit, json_option, seed_option, set_option, study_argument


@click.command()
@study_argument
@drive_option
@set_option
@click.option("--structure", metavar="S", help="integral, automatic, one_way_major or one_way_minor.")
@click.option(
    "--step", metavar="FILE", type=OutputFile(), help="STEP assembly (AP214, or --set export.step_schema=AP242)."
)
@click.option(
    "--dxf",
    metavar="FILE",
    type=OutputFile(),
    help="DXF of the profile for wire cutting, with bore and tolerance zone.",
)
@click.option("--stl", metavar="FILE", type=OutputFile(), help="STL mesh of all parts in their places.")
@click.option("--3mf", "threemf", metavar="FILE", type=OutputFile(), help="3MF mesh with named, coloured parts.")
@click.option(
    "--svg", metavar="FILE", type=OutputFile(), help="Drawing: front view with dimensions, section, key dimensions."
)
@click.option("--png", metavar="FILE", type=OutputFile(), help="Rendered picture of the parts, pulled apart.")
@click.option("--pdf", metavar="FILE", type=OutputFile(), help="Drawings: assembly and a sheet for each part.")
@click.option("--drawings", metavar="FILE", type=OutputFile(), help="ZIP of the same sheets as SVG and DXF.")
@click.option("--cam", metavar="FILE", type=OutputFile(), help="CSV of the cam: angle, radius, normal, curvature.")
@click.option("--gcode", metavar="FILE", type=OutputFile(), help="G-code for a two-axis cam grinder (RS-274).")
@click.option("--inspection", metavar="FILE", type=OutputFile(), help="CSV of the inspection plan.")
@click.option("--mating", metavar="FILE", type=OutputFile(), help="CSV of what shaft, housing and seats must keep.")
@click.option("--context", is_flag=True, help="With bearing races, flexspline ring and circular spline.")
@click.option("--allocation", metavar="FILE", help="Tolerances from the JSON that `hdopt allocate` wrote.")
@json_option
@seed_option
def command(study, drive, overrides, structure, context, allocation, json_file, seed, threemf, **files) -> int:
    """The wave generator as checked files: STEP, DXF, STL, 3MF, a drawing (SVG) and a picture (PNG).

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken. Every file is read back
    from disk and compared with closed-form values before it bears its name; exit status 1 says that one failed, and
    then none is left. Without a file, the key dimensions are printed and nothing is written.
    """
    from hdopt.geometry.check import CheckFailed
    from hdopt.study import load_study
    from hdopt.workflow.allocation_file import read_allocation
    from hdopt.workflow.export import export

    chosen = [f"wave_generator.structure={structure}"] if structure else []
    chosen += ["export.context=true"] if context else []
    wanted = {kind: path for kind, path in {**files, "3mf": threemf}.items() if path}
    loaded = load_study(study, (*overrides, *chosen), drive)
    tolerances = read_allocation(Path(allocation), loaded) if allocation else None
    try:
        result = export(loaded, wanted, tolerances)
    except CheckFailed as failed:
        print(f"hdopt: {failed}", file=sys.stderr)
        return 1
    emit(result.to_dict(), json_file, _lines(result))
    return 0


def _lines(result):
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
        yield f"  profile in the files: within {result.profile_deviation_um:.2g} um of the analytic curve"
    for kind, path in values["files"].items():
        instead = ", in place of an earlier file" if kind in values["replaced"] else ""
        yield f"  wrote and checked {path} ({kind}){instead}"
    if not values["files"]:
        yield "  nothing written: give --step, --dxf, --svg, --cam or another option that names a file"


def _budget_lines(budgets):
    for budget in budgets:
        verdict = "kept" if budget["met"] else "NOT KEPT"
        yield ""
        yield (
            f"  budget of {budget['of']}: {budget['spent']:.4g} of {budget['allowed']:.4g} {budget['unit']}, {verdict}"
        )
        for share in budget["shares"]:
            label = f"{share['feature']}: {share['callout']}"
            yield f"    {label:72s} {share['takes']:9.4g} {budget['unit']}"
