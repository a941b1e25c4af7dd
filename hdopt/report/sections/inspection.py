"""The acceptance sheet on one page: figures, limits, waveform, beat carpet, both directions, orders, checks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any  # Any: Plotly's dictionaries and traces, which have no types

import numpy as np

from hdopt.recordings.decision import GUARD, unit_of
from hdopt.report import Figure, Item, KeyFigures, Report, Ruling, Section, Table, Text
from hdopt.report.cells import EACH
from hdopt.report.theme import BLUE, DIVERGING, GREY, INK, VERMILLION, figure
from hdopt.words import counted

if TYPE_CHECKING:
    import pandas as pd

    from hdopt.recordings.decision import Decision
    from hdopt.recordings.figures import Cells
    from hdopt.recordings.sheet import Batch, Inspection

TURN = 2 * math.pi
LISTED_ORDERS = 12
DECIDED = "Decided with a guard band of 95 % conformity (ISO 14253-1)."


def inspection_report(found: Inspection) -> Report:
    """The acceptance sheet of `found` as a report."""
    sections = [_summary(found)]
    if found.cells:
        sections.append(_waveform(found))
    if found.orders:
        sections.append(_orders(found))
    if found.torsion is not None:
        sections.append(_torsion(found))
    sections.append(_checks(found))
    title = f"Acceptance sheet{f' of {found.serial}' if found.serial else ''}"
    subtitle = ", ".join(found.names) + (f"; {found.conditions}" if found.conditions else "")
    return Report(title, subtitle, tuple(sections))


def _summary(found: Inspection) -> Section:
    import pandas as pd

    values: dict[str, str] = {}
    if found.beat is not None:
        b = found.beat
        values[f"Peak-to-peak over the full beat, {b.source}"] = f"{b.value:.3f} arcmin"
        values["Its 95 % interval"] = f"{b.low:.3f} to {b.high:.3f} arcmin"
    if len(found.one_turn):
        values["Largest in one input turn"] = f"{found.one_turn.max():.3f} arcmin"
    if found.recording_peak_to_peak is not None:
        values["Over the recording, one direction"] = f"{found.recording_peak_to_peak:.3f} arcmin"
    if found.returned is not None:
        values["Return error, median"] = f"{found.returned.median:.3f} arcmin"
    if found.uncertainty is not None:
        values["Standard uncertainty of a peak-to-peak"] = f"{found.uncertainty:.3f} arcmin"
    if found.locked:
        values["Error along the input's turns"] = "none, the input is locked"
    items: list[Item] = [*(_ruling(decision) for decision in found.limits), KeyFigures(values)]
    if found.limits:
        frame = pd.DataFrame(
            [
                {
                    "figure": _name(d.name),
                    "value": d.value,
                    "limit": d.limit,
                    "guard_band": GUARD * d.uncertainty if d.value is not None else None,
                    "unit": unit_of(d.name),
                    "decision": d.verdict,
                    "what": d.note,
                }
                for d in found.limits
            ]
        )
        items.append(Table("limits", "Limits", frame, DECIDED, {"value": EACH, "limit": EACH, "guard_band": ".2g"}))
    turns = counted(f"{found.turns:.4g}", "input turn was", "input turns were")
    items.append(Text(f"{turns} recorded of a drive of ratio {found.ratio:g}."))
    return Section(
        "sheet",
        "Acceptance",
        tuple(items),
        "Makers state the angular transmission accuracy over one turn of the output in one direction: the full beat.",
    )


def _name(key: str) -> str:
    """A figure's or a check's name as it is read."""
    return key.replace("peak_to_peak", "peak-to-peak").replace("_", " ")


def _ruling(decision: Decision) -> Ruling:
    """A limit's verdict in words, with the figure that was held against it."""
    unit = unit_of(decision.name)
    name, allowed = _name(decision.name).capitalize(), f"{decision.limit:.4g} {unit}"
    if decision.value is None:
        return Ruling(None, f"{name}, at most {allowed}: {decision.note or 'not measured'}.")
    off = decision.limit - abs(decision.value)
    by = f"{abs(off):.3g} {'to spare' if off >= 0 else 'too much'}, guard band {GUARD * decision.uncertainty:.2g}"
    note = f" ({decision.note})" if decision.note else ""
    return Ruling(decision.met, f"{name}{note} {abs(decision.value):.4g} {unit}, at most {allowed}: {by}.")


UPRIGHT = "What stands upright is the input's"
OF_SPLINES = " and the circular spline's; what leans is the flexspline's."
OF_A_GEAR = " or comes with it; what leans turns with another shaft or wheel."
WAYS = ((1.0, BLUE, "forward"), (-1.0, VERMILLION, "backward"))
"""Direction of a pass, its colour and its name."""


def _waveform(found: Inspection) -> Section:
    cells = max(found.cells, key=lambda c: len(c.error))
    ways = [name for direction, _, name in WAYS if (cells.direction == direction).any()]
    said = "forward and backward in their colours" if len(ways) > 1 else f"all of it turned {ways[0]}"
    items: list[Item] = [
        Figure("waveform", "The error as recorded", _line(cells), f"Means over cells of the input angle; {said}.")
    ]
    if (carpet := _carpet(cells)) is not None:
        items.append(
            Figure(
                "carpet",
                "The beat: every input turn, one above the other",
                carpet,
                UPRIGHT + (OF_SPLINES if found.strain_wave else OF_A_GEAR),
            )
        )
    if found.returned is not None:
        back = found.returned
        made = figure("Input angle (turns)", "Return error (arcmin)", 300)
        made.add_scatter(x=back.angle / TURN, y=back.curve, mode="lines", line={"color": INK, "width": 1})
        made.add_hline(y=back.median, line={"color": VERMILLION, "dash": "dash"})
        items.append(
            Figure("return", "Both directions: error forward less error backward", made, "Dashed: the median.")
        )
    return Section("waveform-section", "Waveform", tuple(items))


def _line(cells: Cells) -> Any:
    made = figure("Input angle (turns)", "Error (arcmin)", 320)
    middle = float(np.mean(cells.error))
    for direction, colour, name in WAYS:
        x: list[float] = []
        y: list[float] = []
        for index in np.unique(cells.pass_index[cells.direction == direction]):
            rows = cells.pass_index == index
            x += [*(cells.angle[rows] / TURN).tolist(), math.nan]
            y += [*(cells.error[rows] - middle).tolist(), math.nan]
        if x:
            made.add_scatter(x=x, y=y, mode="lines", name=name, line={"color": colour, "width": 1})
    return made


def _carpet(cells: Cells) -> Any:
    """Error over angle within a turn and turn, of the longest pass; None for less than three turns."""
    longest = max(np.unique(cells.pass_index), key=lambda k: float(np.ptp(cells.angle[cells.pass_index == k])))
    rows = cells.pass_index == longest
    per_turn = round(TURN / cells.width)
    place = cells.place[rows] - int(np.floor(cells.place[rows].min() / per_turn)) * per_turn
    turns = int(place.max()) // per_turn + 1
    if turns < 3:
        return None
    grid = np.full((turns, per_turn), np.nan)
    grid[place // per_turn, place % per_turn] = cells.error[rows] - float(np.mean(cells.error[rows]))
    size = float(np.nanmax(np.abs(grid)))
    made = figure("Input angle (deg)", "Input turn", 420)
    made.add_heatmap(
        z=grid,
        x=(np.arange(per_turn) + 0.5) * 360 / per_turn,
        y=np.arange(turns),
        zmin=-size,
        zmax=size,
        colorscale=[list(stop) for stop in DIVERGING],
        colorbar={"title": {"text": "arcmin"}},
        hovertemplate="turn %{y}, %{x:.1f} deg: %{z:.4f} arcmin<extra></extra>",
    )
    return made


def _orders(found: Inspection) -> Section:
    import pandas as pd

    lines = sorted(found.orders, key=lambda o: -o.amplitude_arcmin)[:LISTED_ORDERS]
    frame = pd.DataFrame([vars(line) for line in lines])
    made = figure("Order (cycles per input turn)", "Amplitude (arcmin)", 300)
    for separable, colour, name in ((True, BLUE, "stands apart"), (False, GREY, "not separable in this record")):
        part = [line for line in found.orders if line.separable == separable]
        if part:
            made.add_bar(
                x=[line.order for line in part],
                y=[line.amplitude_arcmin for line in part],
                name=name,
                width=0.03,
                marker={"color": colour},
            )
    return Section(
        "orders",
        "Orders",
        (
            Figure("order-bars", "Amplitudes at the drive's orders", made, "Fitted together by least squares."),
            Table("order-table", "The largest orders", frame, "", {"order": ".4f", "amplitude_arcmin": ".4f"}),
        ),
    )


def _torsion(found: Inspection) -> Section:
    torsion = found.torsion
    assert torsion is not None
    made = figure("Torque at the output (N m)", "Windup (arcmin)", 360)
    made.add_scatter(x=torsion.torque, y=torsion.windup, mode="lines", line={"color": BLUE})
    for knee in torsion.knees:
        for side in (-knee, knee):
            made.add_vline(x=side, line={"color": GREY, "dash": "dot"})
    loss = torsion.hysteresis_loss_arcmin
    values = {f"K{k + 1}": f"{value:.4g} Nm/rad" for k, value in enumerate(torsion.stiffness)}
    values["Knees"] = f"{torsion.knees[0]:.3g} and {torsion.knees[1]:.3g} Nm"
    if loss is not None:
        values["Hysteresis loss"] = f"{loss:.3g} arcmin"
    return Section(
        "torsion",
        "Stiffness",
        (KeyFigures(values), Figure("torsion-curve", "Mean of both directions; knees dotted", made)),
    )


def _checks(found: Inspection) -> Section:
    import pandas as pd

    frame = pd.DataFrame([{"check": _name(name), "finding": said} for name, said in found.checks.items()])
    notes = [Text(text) for text in (*found.understood, *found.warnings)]
    return Section("checks", "Checks, and how the files were read", (Table("check-table", "Checks", frame), *notes))


PPK_SAYS = "Ppk by percentiles of a log-normal distribution (ISO 22514-2), outliers counted."


def _batch_figures(batch: Batch) -> dict[str, str]:
    """What a batch comes to: the limit and who keeps it, Ppk, what could not be read."""
    sound = [drive for drive in batch.drives if not drive.error]
    values = {"Drives": f"{len(sound)}"}
    if batch.limit is not None:
        values["Limit of the peak-to-peak"] = f"{batch.limit:g} arcmin"
        for verdict in ("met", "missed", "not decidable"):
            count = sum(drive.verdict == verdict for drive in sound)
            if count or verdict != "not decidable":
                values[verdict.capitalize()] = str(count)
    if batch.performance is not None:
        p = batch.performance
        values["Ppk"] = f"{p.ppk:.2f}"
        values["Its 95 % interval"] = f"{p.low:.2f} to {p.high:.2f}"
    if len(sound) < len(batch.drives):
        values["Not read"] = str(len(batch.drives) - len(sound))
    return values


def _drive_rows(batch: Batch) -> pd.DataFrame:
    """One row for each drive that could be read, with units; those that could not stand in a table of their own."""
    import pandas as pd

    columns = ["drive", "peak-to-peak, arcmin", "over", "largest turn, arcmin", "rms, arcmin", "return error, arcmin"]
    rows = [
        (d.name, d.peak_to_peak, d.figure, d.one_turn, d.rms, d.return_error, d.verdict, "outlier" if d.outlier else "")
        for d in batch.drives
        if not d.error
    ]
    return pd.DataFrame(rows, columns=[*columns, "verdict", "marked"])


def batch_report(batch: Batch) -> Report:
    """Many drives: `batch` as one table and one plot."""
    import pandas as pd

    sound = [drive for drive in batch.drives if not drive.error and drive.peak_to_peak is not None]
    made = figure("Drive", "Peak-to-peak (arcmin)", 380)
    for outlier, colour, name in ((False, BLUE, "drive"), (True, VERMILLION, "outlier")):
        part = [drive for drive in sound if drive.outlier == outlier]
        if part:
            made.add_scatter(
                x=[drive.name for drive in part],
                y=[drive.peak_to_peak for drive in part],
                mode="markers",
                name=name,
                marker={"color": colour},
            )
    if batch.limit is not None:
        made.add_hline(y=batch.limit, line={"color": INK, "dash": "dash"})
    items: tuple[Item, ...] = (
        KeyFigures(_batch_figures(batch)),
        Figure("batch", "Peak-to-peak of every drive", made, "Dashed: the limit."),
        Table("batch-table", "Every drive", _drive_rows(batch)),
    )
    unread = [(drive.name, drive.error) for drive in batch.drives if drive.error]
    if unread:
        frame = pd.DataFrame(unread, columns=["recording", "why"])
        items = (*items, Table("unread-table", "Recordings that could not be read", frame))
    section = Section("drives", "Drives", items, PPK_SAYS)
    return Report("Many drives of one type", f"{counted(len(batch.drives), 'recording')}", (section,))
