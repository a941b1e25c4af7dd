"""Pictures of a diagnosis: recording against model, and the residual before and after over all it was made at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.recordings.passes import synchronous_average
from hdopt.recordings.read import TURN
from hdopt.recordings.rows import Rows
from hdopt.report import Figure, Item, Section, Table
from hdopt.report.sections.words import short
from hdopt.report.theme import BLUE, GREY, VERMILLION, figure
from hdopt.words import listed

if TYPE_CHECKING:
    import plotly.graph_objects as go

    from hdopt.diagnosis.checks.localization import Location
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis


Fits = Sequence[tuple[str, Fit, str]]
"""Fits to one recording, each with its name in the legend and its colour: the drive alone first, then, where something
was found, the drive with it. All have the same rows."""

SIGNIFICANT = 0.01
"""A domain is shown where noise alone would look like it less often than this."""
POINTS = 60
"""Means along an axis."""
MEANS_PER_TURN = 90
"""Means over a turn, where it has the rows for them."""
FEWEST = 5
"""Rows that a mean is made of at least."""
LINES = 400
"""Points of a spectrum: the largest amplitude of each stretch of orders, so that no line is lost."""
CHANNELS = {
    "torque": "torque [Nm]",
    "speed": "input speed [rad/s]",
    "temperature": "temperature [deg C]",
    "time": "time, one recording after the other [s]",
}


def residual_section(diagnosis: Diagnosis) -> Section:
    """Recording and model of a `diagnosis` over two turns, the residual by domain, and a picture for each domain that
    stands out."""
    selection = diagnosis.evidence.selection
    base, best = selection.base, selection.best.fit
    fits: Fits = [("before", base, VERMILLION)] + ([("after", best, BLUE)] if extended_name(diagnosis) else [])
    standing_out = [location for location in diagnosis.located if location.p <= SIGNIFICANT]
    items: list[Item] = [waveform_figure(fits, extended_name(diagnosis))]
    if len(diagnosis.located):
        items.append(located_table(diagnosis.located))
    if not base.problem.rows.locked:
        items.append(spectrum_figure(fits))
    if diagnosis.evidence.high is not None and diagnosis.evidence.high.best.fit.terms:
        items.append(ripple_figure(diagnosis.evidence.high.base, diagnosis.evidence.high.best.fit))
    shown = set()
    for location in standing_out:
        made = domain_figure(location.domain, fits)
        if made is not None and made.key not in shown:
            items.append(made)
            shown.add(made.key)
    names = listed([f"{location.domain} ({short(location.rms_arcmin)} arcmin rms)" for location in standing_out[:3]])
    if not standing_out:
        intro = "Beside the model of the drive alone nothing stands out of the noise."
    elif len(fits) == 1:
        intro = f"Traces show in {names}; they are too weak for any explanation to pay for itself."
    else:
        intro = f"Beside the model of the drive alone, structure stands out in {names}. One cause may show in several."
    return Section("diagnosis-residual", "Where the mismatch lives", tuple(items), intro)


def extended_name(diagnosis: Diagnosis) -> str:
    """What the extended model of a `diagnosis` is called: it has effects, or, of an unknown cause, the best
    description. Empty where the drive alone stands, or where all that was found is ripple on the rows as recorded."""
    if not diagnosis.evidence.selection.best.fit.terms:
        return ""
    if diagnosis.effects:
        return "with what was left out"
    return "with the best description" if diagnosis.verdict == "unknown" else ""


def located_table(located: tuple[Location, ...]) -> Table:
    """Structure of the base's residual by domain, as `located`: at least one domain."""
    import pandas as pd

    return Table(
        "diagnosis-located",
        "The residual of the model alone, by domain",
        pd.DataFrame(
            {
                "lives in": [location.domain for location in located],
                "rms [arcmin]": [location.rms_arcmin for location in located],
                "p": [location.p for location in located],
            }
        ),
        "p: chance that noise alone looks like this, by sign flips of whole turns (0.005 is the least it can be). "
        "Asynchronous orders are the strongest that were seen, so their p is too small.",
        {"rms [arcmin]": ".4f" if located[0].rms_arcmin < 100 else ".1f", "p": ".3f"},
    )


def domain_figure(domain: str, fits: Fits) -> Figure | None:
    """The picture that shows one `domain` of the residual of `fits`; None where the figure by order shows it
    already."""
    samples = fits[0][1].problem.rows
    if domain in CHANNELS:
        values = _channel(domain, samples)
        return None if values is None else channel_figure(domain, values, fits)
    if domain == "integer order":
        return turn_figure(fits)
    if domain in ("direction", "reversal"):
        return reversal_figure(fits)
    if domain in ("output order", "output-synchronous order"):
        return output_turn_figure(fits)
    return None


def waveform_figure(fits: Fits, extended: str) -> Figure:
    """Recorded error and that of `fits` where the explanation matters most: two input turns, in the order recorded.

    `extended` names the last of two fits in the legend (`extended_name`).
    """
    import plotly.graph_objects as go

    (_, base, _), (_, best, _) = fits[0], fits[-1]
    samples = base.problem.rows
    change = (base.prediction - best.prediction - np.mean(base.prediction - best.prediction)) ** 2
    if samples.locked:
        rows, travel = np.arange(len(samples)), np.arange(len(samples), dtype=float)
    else:
        turn = int(np.argmax(np.bincount(samples.block, change) / np.bincount(samples.block)))
        first = int(np.argmax(samples.block == turn))
        recording = np.flatnonzero(samples.record == samples.record[first])
        length = min(int(2 * samples.rows_per_turn), len(recording))
        start = min(first, recording[-1] + 1 - length)
        rows = np.arange(start, start + length)
        travel = np.degrees(np.r_[0.0, np.cumsum(np.abs(np.diff(samples.theta[rows])))])
    zero = float(np.mean(samples.error[rows]))
    chart = figure("row" if samples.locked else "input travel [deg]", "kinematic error [arcmin]")
    marker = {"color": GREY, "size": 4}
    chart.add_trace(go.Scatter(x=travel, y=samples.error[rows] - zero, name="recorded", mode="markers", marker=marker))
    for (_, fit, colour), name in zip(fits, ("drive alone", extended), strict=False):
        chart.add_trace(go.Scatter(x=travel, y=fit.prediction[rows] - zero, name=name, line={"color": colour}))
    where = "all rows" if samples.locked else "two input turns"
    if best is not base and not samples.locked:
        where += " where the explanation changes the model most"
    caption = f"Measured and modelled error over {where}, from their mean."
    return Figure("diagnosis-waveform", "Recording and model", plain_numbers(chart), caption)


def turn_figure(fits: Fits) -> Figure:
    """Input-synchronous average of the residual of `fits`."""
    return _synchronous_figure(
        "diagnosis-turn", "Residual over one input turn", "input angle [deg]", TURN, np.degrees(1.0), fits
    )


def output_turn_figure(fits: Fits) -> Figure:
    """Output-synchronous average of the residual of `fits`."""
    ratio = fits[0][1].problem.rows.ratio
    return _synchronous_figure(
        "diagnosis-output-turn",
        "Residual over one output turn",
        "output angle [deg]",
        TURN * ratio,
        np.degrees(1.0) / ratio,
        fits,
    )


def _synchronous_figure(key: str, title: str, axis: str, period: float, scale: float, fits: Fits) -> Figure:
    import plotly.graph_objects as go

    chart = figure(axis, "mean residual [arcmin]")
    rows_per_period = fits[0][1].problem.rows.rows_per_turn * period / TURN
    bins = int(np.clip(rows_per_period / 2, 12, MEANS_PER_TURN))  # two rows of a turn in each, so that none is empty
    for name, fit, colour in fits:
        angle, mean, error = synchronous_average(fit.problem.rows.theta, fit.residual, period, bins)
        chart.add_trace(go.Scatter(x=angle * scale, y=mean, name=name, line={"color": colour}))
    noise = float(np.nanmedian(error))
    caption = f"Means over all turns; noise alone moves a point of the last curve by about {noise:.2g} arcmin."
    return Figure(key, title, plain_numbers(chart), caption)


def spectrum_figure(fits: Fits) -> Figure:
    """Residual of `fits` by order, from the lowest that the record resolves to 0.4 of the rows in a turn."""
    samples = fits[0][1].problem.rows
    span = max(samples.span_turns, 1.0)
    lowest, highest = min(1.0 / span, 0.5), 0.4 * samples.rows_per_turn
    chart = _envelopes([(name, FitProbe(fit), colour) for name, fit, colour in fits], lowest, highest, span)
    ticks = [1 / samples.ratio, 2 / samples.ratio, 0.1, 0.5, 1, 2, 4, 10, 20, 50, 100]
    words = ["1/N", "2/N", "0.1", "0.5", "1", "2", "4", "10", "20", "50", "100"]
    chart.update_xaxes(type="log", tickvals=ticks, ticktext=words)
    caption = (
        "Amplitude of the residual by order, on a logarithmic axis; the largest of each short stretch of orders. "
        "1/N is once an output turn."
    )
    return Figure("diagnosis-spectrum", "Residual by order", plain_numbers(chart), caption)


def ripple_figure(before: Fit, after: Fit) -> Figure:
    """Orders above what the averaged rows hold, on the rows as recorded: the residual `before` and `after` high orders
    were fitted."""
    samples = before.problem.rows
    span = max(samples.span_turns, 1.0)
    probes = [("before", FitProbe(before), VERMILLION), ("after", FitProbe(after), BLUE)]
    chart = _envelopes(probes, 0.05 * samples.rows_per_turn, 0.49 * samples.rows_per_turn, span)
    caption = "Rows as recorded, without what was found at lower orders."
    return Figure("diagnosis-ripple", "Ripple at high orders", plain_numbers(chart), caption)


def _envelopes(probes: list[tuple[str, FitProbe, str]], lowest: float, highest: float, span: float) -> go.Figure:
    import plotly.graph_objects as go

    fine = np.arange(lowest, highest, 0.25 / span)
    edges = np.searchsorted(fine, np.geomspace(lowest, highest, LINES + 1)[:-1])
    starts = np.unique(np.minimum(edges, len(fine) - 1))
    chart = figure("cycles per input turn", "amplitude [arcmin]")
    for name, probe, colour in probes:
        amplitude = probe.spectrum(fine)
        top = [a + int(np.argmax(amplitude[a:b])) for a, b in zip(starts, [*starts[1:], len(fine)], strict=True)]
        line = {"color": colour, "width": 1.2}
        chart.add_trace(go.Scatter(x=fine[top], y=amplitude[top], name=name, line=line))
    return chart


def reversal_figure(fits: Fits) -> Figure:
    """Residual of `fits` along each direction's passes, from the reversal on."""
    import plotly.graph_objects as go

    samples = fits[0][1].problem.rows
    chart = figure("travel since the last reversal, or since the start [deg of output]", "mean residual [arcmin]")
    if samples.locked:
        chart.update_xaxes(title_text="torque since the last reversal [Nm]")
    for name, fit, colour in fits:
        for direction, dash in ((1, "solid"), (-1, "dot")):
            rows = samples.direction == direction
            if rows.sum() < 20:
                continue
            x, y = means_along(samples.travel[rows], fit.residual[rows], spread_log=True)
            way = "forward" if direction > 0 else "backward"
            chart.add_trace(go.Scatter(x=x, y=y, name=f"{way}, {name}", line={"color": colour, "dash": dash}))
    chart.update_xaxes(type="log")
    caption = (
        "A logarithmic axis, because play and friction cross over in the first degrees. Play steps at once, friction "
        "bends over; a delay keeps its distance only at one speed."
    )
    return Figure("diagnosis-reversal", "Residual after reversals", plain_numbers(chart), caption)


def channel_figure(name: str, values: Array, fits: Fits) -> Figure:
    """Means of the residual of `fits` along the channel `name` of `CHANNELS`, whose `values` (n,) are those of their
    rows."""
    import plotly.graph_objects as go

    chart = figure(CHANNELS[name], "mean residual [arcmin]")
    for label, fit, colour in fits:
        x, y = means_along(values, fit.residual)
        chart.add_trace(go.Scatter(x=x, y=y, name=label, mode="markers", marker={"color": colour}))
    caption = "Each point is the mean of as many rows."
    return Figure(f"diagnosis-{name}", f"Residual over {name}", plain_numbers(chart), caption)


def means_along(values: Array, residual: Array, spread_log: bool = False) -> tuple[Array, Array]:
    """Means of `values` and `residual` (n,) in POINTS groups of neighbours in `values`: as many rows in each, or
    (`spread_log`) as wide in the logarithm, and dropped where it holds too few."""
    order = np.argsort(values, kind="stable")
    if spread_log:
        low = max(float(np.quantile(values, 0.002)), 1e-3 * float(values.max()), 1e-9)
        inner = np.searchsorted(values[order], np.geomspace(low, float(values.max()), POINTS)[:-1])
        parts = [part for part in np.split(order, np.unique(inner)) if len(part) >= FEWEST]
    else:
        parts = np.array_split(order, min(POINTS, len(order)))
    return np.array([values[p].mean() for p in parts]), np.array([residual[p].mean() for p in parts])


def _channel(name: str, samples: Rows) -> Array | None:
    """The values of a channel over all rows, (n,); None where the recordings do not have it."""
    if name == "time":
        return None if samples.time is None else continued(samples.time, samples.record)
    return {"torque": samples.torque, "speed": samples.speed, "temperature": samples.temperature}[name]


def continued(time: Array, record: Index) -> Array:
    """`time` (n,) s from the start of the first recording, each going on where the one before it ended; `record` (n,)
    is the number of the recording that a row is from, 0 first."""
    starts = np.flatnonzero(np.diff(record, prepend=-1))
    ends = np.r_[starts[1:], len(time)] - 1
    lengths = time[ends] - time[starts]
    moved: Array = (time[starts] - np.r_[0.0, np.cumsum(lengths)[:-1]])[record]
    return time - moved


def plain_numbers(chart: go.Figure) -> go.Figure:
    """`chart` with arcmin on its upright axes written out: 0.0008, not 800 micro."""
    chart.update_yaxes(exponentformat="none")
    return chart
