"""`hdopt export`: the wave generator as files that a shop can trust."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from hdopt.cli.common import drive_option, emit, json_option, seed_option, set_option, study_argument
from hdopt.errors import HdoptError


@click.command()
@study_argument
@drive_option
@set_option
@click.option("--structure", metavar="S", help="integral, automatic, one_way_major or one_way_minor.")
@click.option("--step", metavar="FILE", help="STEP assembly (AP214, or --set export.step_schema=AP242).")
@click.option("--dxf", metavar="FILE", help="DXF of the profile for wire cutting, with bore and tolerance zone.")
@click.option("--stl", metavar="FILE", help="STL mesh of all parts in their places.")
@click.option("--3mf", "threemf", metavar="FILE", help="3MF mesh with named, coloured parts.")
@click.option("--svg", metavar="FILE", help="Drawing: front view with dimensions, section, key dimensions.")
@click.option("--png", metavar="FILE", help="Rendered picture of the parts, pulled apart.")
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
    from hdopt.geometry.dimensions import allocated_bounds
    from hdopt.geometry.export import export
    from hdopt.study import load_study

    chosen = [f"wave_generator.structure={structure}"] if structure else []
    chosen += ["export.context=true"] if context else []
    wanted = {kind: path for kind, path in {**files, "3mf": threemf}.items() if path}
    tolerances = allocated_bounds(_read_json(allocation)) if allocation else None
    try:
        result = export(load_study(study, (*overrides, *chosen), drive), wanted, tolerances)
    except CheckFailed as failed:
        print(f"hdopt: {failed}", file=sys.stderr)
        return 1
    emit(result.to_dict(), json_file, _lines(result))
    return 0


def _read_json(path: str) -> dict:
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise HdoptError(
            f"{path}: cannot be read as JSON ({error}); give the file that `hdopt allocate` wrote"
        ) from error


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
        yield f"  wrote and checked {path} ({kind})"
    if not values["files"]:
        yield "  nothing written: give --step, --dxf, --stl, --3mf, --svg or --png"
