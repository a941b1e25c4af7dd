"""The figures, checks and decisions of one drive's acceptance sheet, from its recordings; no diagnosis needed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any  # Any: values of JSON

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive
from hdopt.effects.met import Spline
from hdopt.errors import HdoptError
from hdopt.recordings import figures
from hdopt.recordings.capability import Gauge, gauge
from hdopt.recordings.decision import Decision, decide
from hdopt.recordings.figures import Cells
from hdopt.recordings.orders import ModelOrder, OrderSpectrum, model_orders, order_spectrum
from hdopt.recordings.recording import TURN, Recording, turns_with_ends
from hdopt.recordings.sheet import Beat, Inspection, OrderLine
from hdopt.recordings.stiffness import starting_torque_nm, torsion_of
from hdopt.words import counted
from hdopt.workflow.lying_teeth import fit_with_teeth_as_they_lie, keys_of
from hdopt.workflow.waveform_fit import WaveformFit, fit_waveform

MODEL_LEAVES = 3.0
"""A model whose residual is below so many times the scatter of neighbouring samples explains the waveform: noise that
hangs together over some samples shows a half or a third of itself between neighbours."""
TEETH_SHOW = 0.9
"""What a model leaves with measured teeth over what it leaves without them from which they hardly show: fitted to
162 teeth of 3 um, a table that stands 40 teeth off leaves 0.95 of it, one with the other sign 0.99."""
LIE_OTHERWISE = 0.5
"""What a model leaves with measured teeth laid otherwise, over the least that it leaves with them as they were given or
without them, from which they are said to lie so: right ones leave 0.1 to 0.2 of it, wrong ones 0.7 in 30 turns."""
SPLINES = {Spline.CIRCULAR: "cs_teeth", Spline.FLEX: "fs_teeth"}
"""The table of a study that tells of a spline's teeth."""
LEAST_OF_A_BEAT = 0.25
"""Share of the beat that a record must cover for the model to extrapolate the rest: at 20 of 80 turns the errors of its
orders are 10 times those of the whole beat, at 10 turns 44 times."""
HIGHEST_WHOLE_ORDER = 8
ORIGIN_UNKNOWN = "whole order of the input"
ONCE_AN_OUTPUT_TURN = "once an output turn"
LOCKED = "the input is locked"
MAKERS_FIGURE = (
    "makers state the angular transmission accuracy over one turn of the output in one direction: the full beat"
)


@dataclass(frozen=True)
class SheetLabel:
    """What a sheet says of the drive in words: its serial number, and the conditions of the recordings."""

    serial: str = ""
    conditions: str = ""


NO_LABEL = SheetLabel()


def acceptance_sheet(
    recordings: Sequence[Recording],
    drive: Drive | None,
    limits: Mapping[str, float],
    *,
    speed_rpm: float | None = None,
    mountings: Sequence[str] = (),
    label: SheetLabel = NO_LABEL,
    seed: int = 1,
) -> Inspection:
    """The acceptance sheet of one drive from its `recordings`.

    `drive` None leaves out what needs a model (the beat of a short record, the origin of the orders). `limits` by name
    in arcmin (`hdopt.recordings.decision.LIMIT_NAMES`). `speed_rpm` of the input for the slope in time, by default the
    recording's own. `mountings` labels each recording for the gauge study. `label` goes on the sheet; `seed` is that of
    the fit. Raises `HdoptError` where there is nothing to inspect.
    """
    if not recordings:
        raise HdoptError("no recordings were given; give at least one file")
    if speed_rpm is not None and not 0 < speed_rpm < math.inf:
        raise HdoptError(f"the input speed is {speed_rpm:g} rpm; it must be a finite number above 0")
    if mountings and len(mountings) != len(recordings):
        files = counted(len(recordings), "recording")
        raise HdoptError(f"--mounting names {len(mountings)} for {files}; name one for each")
    moving = [r for r in recordings if not r.input_locked]
    sweeps = [t for t in map(torsion_of, recordings) if t is not None]
    parts = tuple(figures.cells_of(r) for r in moving)
    fit = fit_waveform(moving, drive, seed) if drive is not None and moving else None
    slopes = [slope for slope in map(figures.steepest_slope, parts) if slope is not None]
    slope, slope_sigma = max(slopes, default=(None, 0.0))
    doubt = _uncertainty(moving, parts, fit)
    found = Inspection(
        names=tuple(r.name for r in recordings),
        serial=label.serial,
        conditions=label.conditions,
        ratio=recordings[0].ratio,
        turns=max(r.turns for r in recordings),
        one_turn=np.concatenate([np.empty(0), *(figures.turn_peak_to_peaks(cells)[0] for cells in parts)]),
        recording_peak_to_peak=max((figures.directional_peak_to_peak(c) for c in parts), default=None),
        beat=_beat(moving, parts, fit, doubt, seed),
        rms=math.sqrt(float(np.mean([figures.rms(c) ** 2 for c in parts]))) if parts else None,
        returned=next((back for back in map(figures.return_error, parts) if back is not None), None),
        repeatability=figures.repeatability(parts) if parts else None,
        slope_per_deg=slope,
        slope_arcsec_per_s=_slope_in_time(moving, slope, speed_rpm),
        orders=_orders(moving, drive),
        drift=max((figures.drift(c) for c in parts), key=abs, default=None),
        torsion=sweeps[0] if sweeps else None,
        starting_torque=next((t for t in map(starting_torque_nm, recordings) if t is not None), None),
        gauge=_gauge(recordings, parts, mountings),
        uncertainty=doubt if parts else None,
        checks=_checks(moving, parts, fit),
        limits=(),
        understood=tuple(f"{r.name}: {said}" for r in recordings for said in r.understood),
        warnings=(*(w for r in recordings for w in r.warnings), *_warnings(moving, parts, drive, fit, seed)),
        cells=parts,
        orientation=_orientation(fit),
        strain_wave=drive is not None,
    )
    return replace(found, limits=_decisions(found, limits, slope_sigma))


def _gauge(recordings: Sequence[Recording], parts: Sequence[Cells], mountings: Sequence[str]) -> Gauge | None:
    """The gauge study over the `mountings` of those recordings that turn, whose cells are `parts`; None without any."""
    if not mountings:
        return None
    mounted = [name for name, r in zip(mountings, recordings, strict=True) if not r.input_locked]
    return gauge([figures.directional_peak_to_peak(cells) for cells in parts], mounted)


def _orientation(fit: WaveformFit | None) -> dict[str, Any] | None:
    if fit is None:
        return None
    way = "as counted" if fit.sign > 0 else "the other way round"
    return {"input": way, "output": way, "decided_by": "data" if fit.decided else "as given", "evidence": fit.evidence}


def _uncertainty(recordings: Sequence[Recording], parts: Sequence[Cells], fit: WaveformFit | None) -> float:
    """Standard uncertainty (arcmin) of a peak-to-peak: two cells' scatter, and the encoders' where the bench says.

    Where a model explains the waveform, what it leaves is the noise, coloured as it may be.
    """
    if not parts:
        return 0.0
    cell = max(float(np.median(cells.sigma)) for cells in parts)
    noise = _noise(parts)
    if fit is not None and noise > 0:
        cell *= max(1.0, min(fit.rms_arcmin / noise, MODEL_LEAVES))
    sensor = max(r.sensor_arcmin for r in recordings)
    return math.sqrt(2 * (cell**2 + sensor**2))


def _beat(
    recordings: Sequence[Recording], parts: Sequence[Cells], fit: WaveformFit | None, doubt: float, seed: int
) -> Beat | None:
    """Measured where one recording covers the whole beat, else as the model extrapolates it; None without either."""
    for recording, cells in zip(recordings, parts, strict=True):
        if _turns(recording) >= recording.ratio:
            value = figures.directional_peak_to_peak(cells)
            return Beat(value, max(value - 1.96 * doubt, 0.0), value + 1.96 * doubt, "measured")
    longest = max((_turns(r) for r in recordings), default=0.0)
    if fit is None or longest < LEAST_OF_A_BEAT * fit.ratio:
        return None
    value, low, high = fit.beat_peak_to_peak(seed)
    # What the model leaves is not in its waveform: two extremes of it, as a scatter, widen the interval.
    noise = max((cells.noise_arcmin for cells in parts), default=0.0)
    left = 1.96 * math.sqrt(2 * max(fit.rms_arcmin**2 - noise**2, 0.0) + doubt**2)
    return Beat(value, max(value - math.hypot(value - low, left), 0.0), value + math.hypot(high - value, left), "model")


def _turns(recording: Recording) -> float:
    """Input turns that `recording` may have made, to a sample at either end."""
    return turns_with_ends(recording.turns, float(np.median(np.abs(np.diff(recording.input_angle)))) / TURN)


def _slope_in_time(recordings: Sequence[Recording], slope: float | None, speed_rpm: float | None) -> float | None:
    """The slope (arcmin per deg of input) as a rate at the output, arcsec/s, at a speed or the usual one."""
    if slope is None:
        return None
    if speed_rpm is not None:
        return slope * 60 * speed_rpm * 6
    for recording in recordings:
        if recording.time is not None and np.ptp(recording.time) > 0:
            speed = np.median(np.abs(np.diff(recording.input_angle)) / np.maximum(np.diff(recording.time), 1e-12))
            return float(slope * 60 * math.degrees(float(speed)))
    return None


def _orders(recordings: Sequence[Recording], drive: Drive | None) -> tuple[OrderLine, ...]:
    """Amplitudes at the model's orders and the other whole ones, fitted together on the longest recording."""
    if not recordings:
        return ()
    recording = max(recordings, key=lambda r: r.turns)
    if recording.turns < 1:
        return ()
    known = model_orders(recording.ratio)
    if drive is None:
        known = (replace(known[0], origin=ONCE_AN_OUTPUT_TURN),)
    whole = [ModelOrder(f"{k}", float(k), ORIGIN_UNKNOWN) for k in range(1, HIGHEST_WHOLE_ORDER + 1)]
    wanted = {o.order: o for o in reversed([*known, *whole])}
    cells = figures.cells_of(recording)
    forward = cells.direction == (1.0 if (cells.direction > 0).mean() >= 0.5 else -1.0)
    usable = sorted(
        order for order in wanted if order * recording.turns >= 0.8 and order < 0.4 * 2 * math.pi / cells.width
    )
    spectrum = _separable_spectrum(cells.angle[forward], cells.error[forward], usable)
    if spectrum is None:
        return ()
    together = {order for group in spectrum.inseparable for order in group}
    return tuple(
        OrderLine(wanted[o].symbol, o, float(a), wanted[o].origin, o not in together)
        for o, a in zip(spectrum.orders.tolist(), spectrum.amplitudes.tolist(), strict=True)
    )


def _separable_spectrum(angle: Array, error: Array, orders: list[float]) -> OrderSpectrum | None:
    """The orders fitted together; of those that a short record cannot part, the lowest stands for its neighbours."""
    step = 0.8 * 2 * math.pi / max(float(np.ptp(angle)), 1e-9)
    kept: list[float] = []
    for order in orders:
        if not kept or order - kept[-1] >= step or order == round(order):
            if kept and order - kept[-1] < step:
                kept.pop()
            kept.append(order)
    while kept:
        try:
            return order_spectrum(angle, error, kept)
        except HdoptError:
            kept.pop()
    return None


def _checks(recordings: Sequence[Recording], parts: Sequence[Cells], fit: WaveformFit | None) -> dict[str, str]:
    """Ratio, orientation, skew and slipped counts, a sentence each."""
    if not recordings:
        return {"ratio": f"not checked: {LOCKED}"}
    said = [s for r in recordings for s in (*r.understood, *r.warnings) if "ratio" in s or "against input/" in s]
    found = {"ratio": said[0] if said else "not checked: only an error was recorded, or the angles move too little"}
    if fit is not None:
        way = "the drive counts as the model does" if fit.sign > 0 else "both angles count the other way round"
        found["orientation"] = (
            f"{way} (log-likelihood {fit.evidence:.0f} better than the other)"
            if fit.decided
            else f"not decided by this record: taken as given; {_how_to_decide(recordings)}"
        )
    skew = next((s for s in map(figures.skew_s, recordings) if s is not None), None)
    if skew is None:
        found["skew"] = "not checked: needs passes at two speeds"
    else:
        sure = abs(skew[0]) > 3 * skew[1]
        found["skew"] = (
            f"output {skew[0] * 1e3:.3g} +- {2 * skew[1] * 1e3:.1g} ms later{'' if sure else ' (not significant)'}"
        )
    slipped = [s for r, c in zip(recordings, parts, strict=True) for s in figures.slips(c, r.quantum_arcmin)]
    found["slipped_counts"] = (
        f"{len(slipped)} steps that stay, the largest {max(abs(s[1]) for s in slipped):.3g} arcmin"
        if slipped
        else "none"
    )
    return found


def _noise(parts: Sequence[Cells]) -> float:
    """How far neighbouring samples scatter in the worst of `parts`, arcmin."""
    return max(cells.noise_arcmin for cells in parts)


def _model_warnings(parts: Sequence[Cells], fit: WaveformFit | None) -> list[str]:
    if fit is None:
        return []
    noise = _noise(parts)
    found = []
    if fit.rms_arcmin > MODEL_LEAVES * noise:
        found.append(
            f"the model leaves {fit.rms_arcmin:.3g} arcmin rms where neighbouring samples scatter by {noise:.2g}: "
            "more is in the record than the drive's errors (hdopt diagnose says what); an extrapolated beat lacks it"
        )
    return found


def _how_to_decide(recordings: Sequence[Recording]) -> str:
    """What would tell which way the angles of `recordings` count."""
    if all(r.turns < r.ratio for r in recordings):
        return "cover more of the beat"
    return "a beat is covered, and the drive fits no better either way: check that it and its teeth are those recorded"


def _warnings(
    recordings: Sequence[Recording], parts: Sequence[Cells], drive: Drive | None, fit: WaveformFit | None, seed: int
) -> list[str]:
    """What the model's `fit` leaves of `recordings` of the `drive`, whose cells are `parts`, and what to look at in
    teeth that were measured. Nothing is said where the model leaves no more than noise."""
    left = _model_warnings(parts, fit)
    if not left or drive is None or fit is None or (drive.cs_teeth is None and drive.fs_teeth is None):
        return left
    return [*left, *_words_on_teeth(recordings, drive, fit, _noise(parts), seed)]


def _words_on_teeth(
    recordings: Sequence[Recording], drive: Drive, fit: WaveformFit, noise: float, seed: int
) -> list[str]:
    """What to look at in the measured teeth of `drive`, if another place, direction or sign of theirs would leave far
    less of the `recordings`, whose neighbouring samples scatter by `noise`, arcmin, than the `fit` with them does and
    than one without them, or if they hardly show."""
    without = fit_waveform(recordings, replace(drive, cs_teeth=None, fs_teeth=None), seed)
    other, laid = fit_with_teeth_as_they_lie(recordings, drive, noise, seed)
    left = f"as the drive has them {fit.rms_arcmin:.3g}, without them {without.rms_arcmin:.3g}"
    if other.rms_arcmin < LIE_OTHERWISE * min(fit.rms_arcmin, without.rms_arcmin):
        how = "; ".join(f"[{SPLINES[spline]}] {keys_of(teeth)}" for spline, teeth in laid.items())
        return [
            f"the measured teeth lie otherwise in the record: {how}. So the model leaves {other.rms_arcmin:.3g} arcmin "
            f"rms, {left}. All half a turn on looks alike. The orientation may have come out wrong"
        ]
    if fit.rms_arcmin < TEETH_SHOW * without.rms_arcmin:
        return []
    return [
        f"the measured teeth hardly show in the record: the model leaves, {left} arcmin rms, and with tooth 1 anywhere "
        "else, numbered either way, of either sign, not half of that; check that these teeth and these alone are those "
        "of the drive (of others the orientation may come out wrong too)",
    ]


def _decisions(found: Inspection, limits: Mapping[str, float], slope_sigma: float) -> tuple[Decision, ...]:
    """Every limit held against its figure."""
    made: list[Decision] = []
    doubt = found.uncertainty or 0.0
    for name, limit in limits.items():
        value, sigma, note = _figure(found, name, doubt, slope_sigma)
        decision = decide(name, value, sigma, limit, note)
        if name == "peak_to_peak" and decision.met is not False:
            part = decide(
                name, found.recording_peak_to_peak, doubt, limit, "over the part recorded: the whole beat has no less"
            )
            decision = part if part.met is False else decision
        made.append(decision)
    return tuple(made)


def _figure(found: Inspection, name: str, doubt: float, slope_sigma: float) -> tuple[float | None, float, str]:
    """A figure by its name in `--limit`: value, standard uncertainty, and what it is."""
    beat, back, torsion = found.beat, found.returned, found.torsion
    if found.locked and name != "hysteresis_loss":
        return None, doubt, LOCKED
    if name == "peak_to_peak":
        if beat is None:
            return None, doubt, "too little of the beat was recorded, or there is no drive to extrapolate with"
        if beat.source == "model" and any(w.startswith("the model leaves") for w in found.warnings):
            return None, doubt, f"the model says {beat.value:.3g} arcmin, but does not explain the record"
        half = max(beat.high - beat.value, beat.value - beat.low) / 1.96
        return beat.value, half, f"over the full beat, {beat.source}"
    values: dict[str, tuple[float | None, float, str]] = {
        "one_turn": (float(found.one_turn.max()), doubt, "largest of all input turns")
        if len(found.one_turn)
        else (None, doubt, "no whole input turn was recorded"),
        "recording": (found.recording_peak_to_peak, doubt, "over the recording, one direction"),
        "rms": (found.rms, doubt / math.sqrt(max(found.turns, 1.0)), ""),
        "return_error": (None, 0.0, "one direction only was recorded")
        if back is None
        else (abs(back.median), back.sigma / math.sqrt(len(back.curve)), "median"),
        "repeatability": (None, 0.0, "no stretch of an input turn was passed twice in one direction")
        if found.repeatability is None
        else (found.repeatability, doubt / math.sqrt(max(found.turns, 1.0)), ""),
        "slope": (None, 0.0, f"no {figures.SLOPE_WINDOW_DEG:g} deg of the input were passed without a gap")
        if found.slope_per_deg is None
        else (found.slope_per_deg, slope_sigma, ""),
        "hysteresis_loss": (None, 0.0, "no torque was swept up and down against a locked input")
        if torsion is None or torsion.hysteresis_loss_arcmin is None
        else (torsion.hysteresis_loss_arcmin, torsion.loss_sigma_arcmin, "at zero torque"),
    }
    return values[name]
