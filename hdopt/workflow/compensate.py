"""`hdopt compensate`: what a controller can subtract, chosen on parts of the recordings that the fit did not see."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: values of JSON

import numpy as np

from hdopt.arrays import Array, Index, Mask
from hdopt.compensation.expected import NORMAL, peak_to_peak_again
from hdopt.compensation.path import AT_ONCE, crossing_of, half_return, path_of, paths_of, some_of
from hdopt.compensation.pursuit import dictionary, independent_share, pursue
from hdopt.compensation.surface import Harmonics, Surface, nothing, surface_of
from hdopt.compensation.teeth import Teeth, fit_teeth
from hdopt.compensation.writers import FORMATS, homing_arcmin, written
from hdopt.compensation.zones import MOST_TERMS, Zones, formed
from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError
from hdopt.figures import drawn
from hdopt.files import ShownAsTable, write_text
from hdopt.recordings.recording import TURN, Recording
from hdopt.recordings.rows import Rows, gather, neighbours_for
from hdopt.workflow.output_files import Files, checked_files
from hdopt.workflow.placed import recordings_named
from hdopt.workflow.recorded_drive import AnyDrive, AnyRecordings, recorded_drive
from hdopt.workflow.waveform_fit import WaveformFit, fit_rows

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure

Found = Harmonics | Zones | Surface

FOLDS = 4
SURE = 2.0
"""Standard errors by which the held-out squares must fall for a compensation to be worth writing (one-sided 98 %)."""
GROUPS_PER_BEAT = 8
"""Stretches an output turn over which held-out squares are taken together: neighbouring turns hang together."""
ROWS_PER_TURN, MOST_ROWS = 128, 40_000
"""Rows an input turn that show single teeth, and how many rows there may be for their sake."""
NONE = "none"
STRETCHES = "stretches of the one output turn"


@dataclass(frozen=True)
class PerRecording:
    """Held-out peak-to-peak (arcmin) of one recording at its usual input speed (r/min, None without a clock), and what
    to expect of a fresh one under its conditions."""

    name: str
    speed_rpm: float | None
    before: float
    after: float
    expected: float


@dataclass(frozen=True)
class Compensated(ShownAsTable):
    """A compensation, and what it leaves on parts that the fit did not see; peak-to-peak in arcmin.

    `before` and `after` of the held-out parts together, each part scored by a choice made without it; `predicted` for a
    fresh recording of the same length, with its 95 % interval `low`, `high`; `both` the same for each direction.
    `worth` says whether the fall is beyond chance (`evidence` standard errors).
    """

    found: Found
    method: str
    worth: bool
    evidence: float
    before: float
    after: float
    predicted: float
    low: float
    high: float
    both: dict[str, float]
    recordings: tuple[PerRecording, ...]
    held_out: str
    scores: dict[str, float]
    homing: tuple[float, float]
    ratio: float
    warnings: tuple[str, ...] = field(default=())

    def facts(self) -> dict[str, Any]:
        """What the file says of itself: method, what it leaves, what it needs, what makes it void."""
        return {
            "ratio": self.ratio,
            "method": self.method,
            "peak_to_peak_before_arcmin": round(self.before, 4),
            "peak_to_peak_expected_arcmin": round(self.predicted, 4),
            "homing": homing_words(self.homing),
            "void": VOID,
        }

    def to_dict(self, file: str | None) -> dict[str, Any]:
        """The JSON of `hdopt compensate`; `file` is where the table went, None where none was written."""
        return {
            "schema": 1,
            "file": file,
            "worth": self.worth,
            "method": self.method,
            "terms": self.found.values.size if isinstance(self.found, Surface) else len(self.found),
            "heldout_peak_to_peak_arcmin": {
                "before": self.before,
                "after": self.after,
                "predicted": self.predicted,
                "low": self.low,
                "high": self.high,
            },
            "directions": self.both,
            "return": {"half_arcmin": self.found.back, "crossing_output_deg": self.found.crossing_deg},
            "recordings": [vars(part) for part in self.recordings],
            "held_out": self.held_out,
            "evidence": self.evidence,
            "heldout_rms_arcmin": self.scores,
            "homing_rms_arcmin_per_deg": {"input": self.homing[0], "output": self.homing[1]},
            "needs": homing_words(self.homing),
            "void": VOID,
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row a recording: held-out peak-to-peak without and with the compensation."""
        import pandas as pd

        rows = [(part.name, part.speed_rpm, part.before, part.after, part.expected) for part in self.recordings]
        columns = ["recording", "speed_rpm", "before_arcmin", "after_arcmin", "expected_arcmin"]
        return pd.DataFrame(rows, columns=columns)

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """Held-out peak-to-peak of every recording, without and with the compensation.
        `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        table = self.to_frame()
        bars = [go.Bar(x=table["recording"], y=table[f"{when}_arcmin"], name=when) for when in ("before", "after")]
        layout = {"xaxis_title": "recording", "yaxis_title": "held-out peak-to-peak, arcmin"}
        return drawn(go.Figure(bars, layout), backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: recordings, directions, the methods that were tried."""
        import pandas as pd

        return {
            "recordings": self.to_frame(),
            "directions": pd.DataFrame(list(self.both.items()), columns=["direction", "left_arcmin"]),
            "methods": pd.DataFrame(list(self.scores.items()), columns=["method", "heldout_rms_arcmin"]),
        }


VOID = (
    "void after the wave generator, circular spline or flexspline was taken out or turned, after an encoder or its "
    "zero was changed, and at a load or temperature far from the recording's"
)


def homing_words(homing: tuple[float, float]) -> str:
    """What homing the table needs, in a sentence; `homing` is the rms (arcmin) a degree off at input and output."""
    return (
        "home both shafts: input_rad from the zero of the recording's input count, output_rad = input_rad/N counted on "
        "from there, so the controller must know which input turn of the output's turn it is in; a degree off "
        f"adds {homing[0]:.2g} arcmin rms at the input, {homing[1]:.2g} at the output"
    )


@recordings_named
def compensate(
    recordings: AnyRecordings,
    drive: AnyDrive = None,
    terms: int | None = None,
    seed: int = 1,
    files: Files | None = None,
) -> Compensated:
    """What to subtract, from `recordings` (files or records) of one drive.

    `drive`: its record, a study, a shipped name or the path of a study file; None leaves the model out and takes
    harmonics alone. `terms` coefficients at most, 0 for a table over both angles; None for 64, or a table
    where these would be off by more than a twentieth of what is left anyway. `seed` for fits and resampling.
    `files` to write, where it is worth it: {"csv": PATH}, {"json": PATH} or {"c": PATH}. Raises `HdoptError` where
    nothing moves or `terms` is out of range, and before any work where a file cannot be written.
    """
    source, wanted = recorded_drive(drive), checked_files(files, FORMATS)
    made = compensation_of(source.recordings(recordings), source.drive, terms, seed)
    write_compensation(made, wanted)
    return made


def write_compensation(made: Compensated, files: Mapping[str, Path]) -> None:
    """Write a compensation `made` in the formats that `files` asks for ("csv", "json", "c" -> path); nothing where it
    would be no better than none beyond chance. Raises `HdoptError` where a file cannot be written."""
    for form, path in files.items():
        if made.worth:
            write_text(path, written(made.found, form, made.facts()))


def compensation_of(recordings: Sequence[Recording], drive: Drive | None, terms: int | None, seed: int) -> Compensated:
    """The compensation from the records of `recordings`; `drive`, `terms`, `seed` and errors as for `compensate`."""
    if terms is not None and not 0 <= terms <= MOST_TERMS:
        raise HdoptError(f"--terms is {terms}; give 1 to {MOST_TERMS} coefficients, or 0 for a table")
    moving = [r for r in recordings if not r.input_locked]
    if not moving:
        raise HdoptError("the input is locked in every recording; a compensation needs recordings that turn")
    rows = gather(moving, neighbours_of(moving))
    sign: tuple[float, ...] = (1.0, -1.0)
    whole: WaveformFit | None = None
    if drive is not None:
        whole = fit_rows(rows, drive, seed, sign)
        sign = (whole.sign,)
    fold, held_out = _folds(rows)
    paths = paths_of(rows)
    trials = _trials(
        (rows, fold), terms, paths, lambda train: None if drive is None else fit_rows(train, drive, seed, sign)
    )
    before = _centred(rows.error, rows, fold)
    nested, method = _choose(trials, fold)
    found = _candidates(rows, whole, terms, paths)[method]
    worth, evidence = _worth(before, nested, rows)
    # Parts of one recording are extrapolated in angle when held out; a fresh run over the same angles is not.
    again = _centred(rows.error - said_of(found, rows), rows, np.zeros_like(fold))
    left = again if rows.records == 1 else trials[method]
    rng = np.random.default_rng(seed)
    each = [peak_to_peak_again(left[rows.record == n], rows.block[rows.record == n], rng) for n in range(rows.records)]
    predicted, low, high = _predicted(each)
    ways = {"forward": 1.0, "backward": -1.0} if rows.reverses else {}
    return Compensated(
        found,
        method,
        worth and bool(np.ptp(nested) < np.ptp(before)),
        evidence,
        float(np.ptp(before)),
        float(np.ptp(nested)),
        predicted,
        low,
        high,
        {name: float(np.ptp(nested[rows.direction == way])) for name, way in ways.items()},
        _per_recording(moving, rows, (before, nested), each),
        held_out,
        {NONE: float(np.std(before))} | {name: float(np.std(left)) for name, left in trials.items()},
        homing_arcmin(found, rows.ratio),
        rows.ratio,
        _warnings(rows, held_out, moving),
    )


def _trials(
    split: tuple[Rows, Index],
    terms: int | None,
    paths: Mapping[float, Array],
    fit: Callable[[Rows], WaveformFit | None],
) -> dict[str, Array]:
    """What each way leaves (n,) on every part, fitted to the others; `split` is the rows and the part of each."""
    rows, fold = split
    trials: dict[str, Array] = {}
    for k in range(int(fold.max()) + 1):
        train, test = _rows(rows, fold != k), fold == k
        for name, found in _candidates(train, fit(train), terms, some_of(paths, fold != k)).items():
            left = trials.setdefault(name, np.full(len(rows), np.nan))
            left[test] = rows.error[test] - said_of(found, rows)[test]
    return {name: _centred(left, rows, fold) for name, left in trials.items()}


def neighbours_of(recordings: Sequence[Recording]) -> int:
    """How many neighbouring samples of these `recordings` make a row: fewer than elsewhere, where a record of no more
    than `MOST_ROWS` rows can so show single teeth."""
    samples = sum(len(recording) for recording in recordings)
    turns = sum(float(np.abs(np.diff(recording.input_angle)).sum()) / TURN for recording in recordings)
    usual = neighbours_for(recordings)
    fewer = max(1, min(usual, int(samples / max(turns, 1.0) / ROWS_PER_TURN)))
    return fewer if samples / fewer <= MOST_ROWS else usual


def _folds(rows: Rows) -> tuple[Index, str]:
    """The part that each row belongs to, and what the parts are: recordings, output turns, passes, or stretches."""
    if rows.records >= 2:
        return np.asarray(rows.record % max(FOLDS, 2), np.int64), "recordings"
    beat = np.floor((rows.theta - rows.theta.min()) / (TURN * rows.ratio)).astype(np.int64)
    if beat.max() >= 1 and (beat == 1).sum() > 0.5 * (beat == 0).sum():
        return np.asarray(beat % FOLDS, np.int64), "output turns"
    passes = np.r_[0, np.cumsum(np.diff(rows.direction) != 0)]
    if passes.max() >= 3:
        # By length, so that no part holds all that reaches round the output.
        rank = np.argsort(np.argsort(-np.bincount(passes), kind="stable"), kind="stable")
        return np.asarray(rank[passes] % FOLDS, np.int64), "reversals"
    order = (rows.theta - rows.theta.min()) / max(float(np.ptp(rows.theta)), 1e-9)
    return np.asarray(np.minimum((order * FOLDS).astype(int), FOLDS - 1), np.int64), STRETCHES


def _rows(rows: Rows, mask: Mask) -> Rows:
    """Some rows, their recordings numbered anew."""
    part = rows.rows(mask)
    return replace(part, record=np.unique(part.record, return_inverse=True)[1])


def _candidates(
    rows: Rows, fit: WaveformFit | None, terms: int | None, paths: Mapping[float, Array]
) -> dict[str, Found]:
    """Every way to compensate, fitted to `rows`, in the form that will be written; `paths` are those that the return
    error may take along them."""
    angles = (rows.theta, rows.theta / rows.ratio)
    zeros = (rows.record[:, None] == np.arange(rows.records)).astype(float)
    if rows.span_turns >= 0.5 * rows.ratio:
        zeros = np.column_stack([zeros, (rows.theta - rows.theta.mean()) / TURN])
    pairs = dictionary(rows.span_turns / rows.ratio)
    most = terms or MOST_TERMS
    alone = pursue(angles, rows.error, zeros, paths.get(AT_ONCE), pairs, most)
    crossing = _crossing(rows.error - alone.at(*angles), zeros, paths)
    path = paths.get(crossing)
    if crossing:
        alone = replace(pursue(angles, rows.error, zeros, path, pairs, most), crossing_deg=crossing)
    made: dict[str, Found] = {"harmonics": surface_of([alone], None, alone.back, crossing) if terms == 0 else alone}
    if fit is None:
        return made
    free = zeros if path is None else np.column_stack([zeros, path])
    bare = Teeth.bare(fit.model, fit.errors, fit.sign)
    teeth = fit_teeth(rows, free, bare, np.diag(fit.covariance))
    count = round(rows.averaged)
    for name, one in {"model": bare, "model and harmonics": bare, "model, teeth and harmonics": teeth}.items():
        left = rows.error - one.at(rows.theta)
        rest = nothing(0.0 if path is None else half_return(left, zeros, path))
        if name != "model":
            rest = pursue(angles, left, zeros, path, pairs, most // 2)
        rest = replace(rest, crossing_deg=crossing)
        made[name] = formed(
            one.sharpened(TURN / rows.rows_per_turn, count), rest, terms, float(np.ptp(left - rest.at(*angles)))
        )
    return made


def _crossing(left: Array, zeros: Array, paths: Mapping[float, Array]) -> float:
    """The output's travel (deg) over which the return error in what is `left` crosses after a reversal."""
    if not paths:
        return AT_ONCE
    columns = np.column_stack([zeros, paths[AT_ONCE]])
    rest = left - columns @ np.linalg.lstsq(columns, left, rcond=1e-8)[0]
    return crossing_of(left, zeros, paths, independent_share(rest))


def said_of(found: Found, rows: Rows) -> Array:
    """What `found` says of all `rows` (n,), means of samples as they are: the path since a reversal needs those
    before."""
    count = max(1, round(rows.averaged))
    apart = TURN / rows.rows_per_turn / count
    value = found.back * path_of(rows, found.crossing_deg)
    for place in range(count):
        theta = rows.theta + (place - (count - 1) / 2) * apart
        value = value + found.at(theta, theta / rows.ratio) / count
    return value


def _centred(values: Array, rows: Rows, fold: Index) -> Array:
    """Values less the mean of their recording within their fold: a zero is nobody's error."""
    key = rows.record * (int(fold.max()) + 1) + fold
    _, inverse = np.unique(key, return_inverse=True)
    return np.asarray(values - (np.bincount(inverse, values) / np.bincount(inverse))[inverse], float)


def _choose(trials: dict[str, Array], fold: Index) -> tuple[Array, str]:
    """What is left where each part is scored by the choice of the others, and the choice of all parts."""
    names = list(trials)
    squares = np.array([[float(np.sum(trials[n][fold == k] ** 2)) for k in range(int(fold.max()) + 1)] for n in names])
    nested = np.empty(len(fold))
    for k in range(squares.shape[1]):
        others = np.delete(squares, k, axis=1).sum(axis=1)
        nested[fold == k] = trials[names[int(np.argmin(others))]][fold == k]
    return nested, names[int(np.argmin(squares.sum(axis=1)))]


def _worth(before: Array, after: Array, rows: Rows) -> tuple[bool, float]:
    """Whether the squares fall beyond chance, and by how many standard errors, over stretches of the record."""
    size = max(1, round(rows.ratio / GROUPS_PER_BEAT))
    _, group = np.unique(rows.block // size, return_inverse=True)
    fall = np.bincount(group, before**2 - after**2) / np.bincount(group)
    if len(fall) < 3:
        return False, 0.0
    error = float(fall.std(ddof=1)) / math.sqrt(len(fall))
    evidence = float(fall.mean()) / max(error, 1e-300)
    return evidence > SURE, min(evidence, 1e6)


def _predicted(each: Sequence[tuple[float, float]]) -> tuple[float, float, float]:
    """Peak-to-peak to expect of a fresh recording of this length, with a 95 % interval: the mean over the recordings,
    of `each` of which value and standard deviation are known."""
    value = float(np.mean([value for value, _ in each]))
    spread = NORMAL * math.sqrt(float(np.mean([spread**2 for _, spread in each])))
    return value, max(value - spread, 0.0), value + spread


def _per_recording(
    recordings: Sequence[Recording], rows: Rows, held_out: tuple[Array, Array], each: Sequence[tuple[float, float]]
) -> tuple[PerRecording, ...]:
    found = []
    for number, recording in enumerate(recordings):
        mask = rows.record == number
        speed = None if rows.speed is None else float(np.median(np.abs(rows.speed[mask]))) * 60 / TURN
        before, after = (float(np.ptp(left[mask])) for left in held_out)
        found.append(PerRecording(recording.name, speed, before, after, each[number][0]))
    return tuple(found)


def _warnings(rows: Rows, held_out: str, recordings: Sequence[Recording]) -> tuple[str, ...]:
    said = [w for r in recordings for w in r.warnings]
    if rows.span_turns < rows.ratio:
        said.append(
            f"{rows.span_turns:.3g} of the {rows.ratio:g} input turns of a beat were recorded: beyond them the table "
            "is an extrapolation, and what it leaves there was not seen; record a whole output turn"
        )
    if held_out == STRETCHES:
        said.append("one pass of at most one output turn: held out are stretches of it; record two output turns")
    return tuple(said)
