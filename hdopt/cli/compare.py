"""`hdopt compare`: a measured cam against the study's."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: what the command's other options give

import click

from hdopt.cli.common import (
    OutputFile,
    StudyOptions,
    drive_option,
    emit,
    json_option,
    seed_option,
    set_option,
    table_options,
)
from hdopt.cli.completion import a_file, offered, studies
from hdopt.words import counted

if TYPE_CHECKING:
    from hdopt.workflow.compare import CompareResult


@click.command()
@table_options
@click.argument("cam", metavar="CAM.csv", shell_complete=a_file)
@click.option(
    "--study",
    metavar="STUDY",
    shell_complete=offered(studies, files=True),
    help="A study file or a shipped study; the shipped drive if omitted.",
)
@drive_option
@set_option
@click.option(
    "--probe-radius-mm", type=float, default=0.0, show_default=True, help="Of the ball whose centre is given."
)
@click.option(
    "--surface",
    type=click.Choice(["cam", "bearing"]),
    default="cam",
    show_default=True,
    help="What was measured: the cam itself, or the outside of the bearing on it.",
)
@click.option(
    "--part",
    metavar="NAME",
    shell_complete=offered(lambda: ("disc_1", "disc_2")),
    help="disc_1 or disc_2 of a two-disk wave generator.",
)
@click.option(
    "--fit",
    type=click.Choice(["least_squares", "minimum_zone"]),
    default="least_squares",
    show_default=True,
    help="Least sum of squares, or least largest deviation (ISO 1101): whose deviations are judged.",
)
@click.option("--plot", metavar="FILE", type=OutputFile(), help="Deviations over the angle, with the zone (SVG).")
@click.option("--write-study", metavar="FILE", type=OutputFile(), help="The study with the measured cam (TOML).")
@json_option
@seed_option
def command(cam: str, study: str | None, drive: str | None, overrides: tuple[str, ...], **options: Any) -> int:
    """A measured cam against the one that the study designs: best fit, deviations, verdict.

    CAM.csv has the columns angle_deg,radius_mm (clockwise from the major axis) or x_mm,y_mm: the cam's surface, or the
    centre of a ball with --probe-radius-mm. Between semicolons or tabs, numbers may have decimal commas. Exit status 1
    says that a point lies outside the profile's tolerance zone. The study that --write-study writes goes to `hdopt ke`
    and `hdopt stack`.
    """
    from hdopt.workflow.compare import compare, write_comparison

    loaded = StudyOptions(study, drive, overrides).load()
    how = {name: options[name] for name in ("probe_radius_mm", "surface", "part", "fit")}
    result = compare(loaded, cam, **how)
    wanted = {"plot": options["plot"], "study": options["write_study"]}
    table = write_comparison(result, {kind: path for kind, path in wanted.items() if path}, loaded, cam)
    emit(result.to_dict(), options["json_file"], _lines(result, options["write_study"], table), tables=result)
    return 0 if result.met else 1


def _lines(result: CompareResult, study: Path | None, table: Path | None) -> Iterator[str]:
    values = result.to_dict()
    fit, deviation = values["fit"], values["deviation_um"]
    points = counted(values["points"], "point")
    yield f"{result.study}: {points} of the {result.part.replace('_', ' ')} ({result.surface})"
    x, y = fit["shift_um"]
    name = fit["method"].replace("_", " ")
    yield f"  best fit ({name}): turned by {fit['rotation_deg']:.4f} deg, moved by ({x:.3f}, {y:.3f}) um"
    yield f"  deviation: {deviation['largest']:.3f} um at most, {deviation['rms']:.3f} um rms"
    yield f"  least zone that holds every point: {values['minimum_zone_um']:.3f} um"
    yield f"  scatter of a single point: {values['noise_um']:.3f} um"
    word = "within" if result.met else "OUTSIDE"
    yield f"  form: {word} the profile's zone of {values['zone_um']:.4g} um (half of it to either side)"
    off = f"  location: off the axis by {values['eccentricity_um']:.3f} um"
    if values["eccentricity_allowed_um"] is not None:
        word = "within" if result.eccentricity_met else "BEYOND"
        yield f"{off}, {word} the {values['eccentricity_allowed_um']:.4g} um of the tolerances"
    else:
        yield f"{off}, which no tolerance of the study bounds"
    kept = [name for name, met in (("form", result.met), ("location", result.eccentricity_met)) if met is False]
    yield f"  not kept: {' and '.join(kept)}" if kept else "  kept: all that the study asks of the cam"
    if result.met and kept:
        yield "  the verdict is on the form: the location counts where the table's zero is the bore's axis"
    if study is not None:
        yield f"  next: hdopt ke {study}, which reads the cam from {table}"
