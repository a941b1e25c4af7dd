"""`hdopt ke`: kinematic error of one drive."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import (
    StudyOptions,
    check_option,
    emit,
    json_option,
    status,
    structure_option,
    study_options,
    table_options,
)
from hdopt.cli.completion import geometries, offered, unhyphened
from hdopt.cli.whole_number import WholeNumber
from hdopt.words import counted

if TYPE_CHECKING:
    from hdopt.workflow.kinematic_error import KinematicErrorResult


@click.command()
@table_options
@study_options
@structure_option
@click.option("--sampling-deg", type=float, help="Also take the peak-to-peak only on this grid, from 0.")
@click.option("--turns", type=float, help="Input turns of that grid; one full relative turn if omitted.")
@check_option
@click.option(
    "--method",
    default="exact",
    shell_complete=offered(geometries),
    callback=unhyphened,
    help="exact (the default) or closed-form, to second order in the errors.",
)
@json_option
@click.option(
    "--seed",
    type=WholeNumber(0, 2**63 - 1),
    expose_value=False,
    help="Taken as in every command; nothing here is random.",
)
def command(
    asked: StudyOptions,
    structure: str | None,
    sampling_deg: float | None,
    turns: float | None,
    method: str,
    json_file: Path | None,
) -> int:
    """Kinematic error of one drive: peak-to-peak, orders, contact, lag.

    STUDY is a study file or a shipped study; without one, the shipped drive csf-25-80 is taken.
    """
    from hdopt.workflow.kinematic_error import kinematic_error
    from hdopt.workflow.requirement import of_kinematic_error

    chosen = (f"wave_generator.structure={structure}",) if structure else ()
    loaded = asked.load(*chosen)
    result = kinematic_error(loaded, sampling_deg=sampling_deg, turns=turns, method=method)
    verdict = of_kinematic_error(loaded, result)
    emit(result.to_dict(), json_file, _lines(result), verdict, tables=result)
    return status(True, verdict)


NIL_ARCMIN = 5e-5
"""An order below it would be shown as 0.0000."""


def _lines(result: KinematicErrorResult) -> Iterator[str]:
    yield f"{result.study}: {result.profile} wave generator, {result.structure}"
    yield f"  peak-to-peak, converged (k_e = 1)    {result.peak_to_peak_arcmin:9.4f} arcmin"
    yield f"    that holds over a tooth's width      {result.tooth_width_peak_to_peak_arcmin:9.4f} arcmin"
    if result.effects:
        yield f"    of the base model, without effects   {result.base_peak_to_peak_arcmin:9.4f} arcmin"
    for effect in result.effects:
        added = f"adds {effect['adds_arcmin']:9.4f} arcmin" if effect["counted"] else "not counted"
        yield f"    {effect['id']:28s} ({effect['origin']})  {added}"
    if result.sampled_peak_to_peak_arcmin is not None:
        yield f"  peak-to-peak, on the grid asked for  {result.sampled_peak_to_peak_arcmin:9.4f} arcmin"
    if result.nonuniform_arcmin is not None:
        k_e = result.homogenization_coefficient
        yield f"  evened out by the teeth in mesh      {result.nonuniform_arcmin:9.4f} arcmin  (k_e = {k_e:.4f})"
        yield f"  contact angle                        {result.contact_angle_deg:9.2f} deg"
    if result.lag_arcmin is not None:
        lag = result.lag_arcmin
        yield f"  lag, mean ({lag['min']:.3f} to {lag['max']:.3f})         {lag['mean']:9.4f} arcmin"
        if lag["interference_share"] > 0:
            share = 100 * lag["interference_share"]
            yield f"  flanks interfere over {share:.1f} % of the angles: this drive needs more backlash"
    yield "  order         amplitude  from"
    large = [order for order in result.orders if order["amplitude_arcmin"] >= NIL_ARCMIN]
    for order in large:
        yield f"  {order['symbol']:12s}  {order['amplitude_arcmin']:9.4f}  {order['origin']}"
    if few := len(result.orders) - len(large):
        yield f"  {counted(few, 'order')} below {NIL_ARCMIN:g} arcmin left out"
    for note in result.notes:
        yield f"  note: {note}"
