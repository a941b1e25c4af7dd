"""`hdopt compensate`: what a controller can subtract, chosen on parts of the recordings that the fit did not see."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: values of JSON

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.compensation.applied import crosses, how_counted
from hdopt.compensation.expected import NORMAL, peak_to_peak_again
from hdopt.compensation.of_speed import OfSpeed, shows_lag, signed_rpm, with_speed
from hdopt.compensation.path import half_about, paths_of
from hdopt.compensation.writers import FORMATS, Found, homing_arcmin, written
from hdopt.compensation.zones import MOST_TERMS, SMALL
from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError
from hdopt.figures import drawn
from hdopt.files import ShownAsTable, write_text
from hdopt.recordings.recording import Recording, turns_with_ends
from hdopt.recordings.rows import Rows, gather
from hdopt.workflow.compensation_samples import Samples, samples_of
from hdopt.workflow.compensation_speeds import TERMS as OWN_TERMS
from hdopt.workflow.compensation_speeds import lag_in, of_each_speed, own_of_each_speed, speeds_rpm
from hdopt.workflow.compensation_trials import (
    HARMONICS,
    STRETCHES,
    candidates,
    centred,
    choose,
    folds,
    met_elsewhere,
    model_of,
    neighbours_of,
    said_of,
    tried,
)
from hdopt.workflow.output_files import Files, checked_files
from hdopt.workflow.placed import recordings_named
from hdopt.workflow.recorded_drive import AnyDrive, AnyRecordings, recorded_drive
from hdopt.workflow.waveform_fit import WaveformFit

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure

SURE = 2.0
"""Standard errors by which the held-out squares must fall for a compensation to be worth writing (one-sided 98 %)."""
GROUPS_PER_BEAT = 8
"""Stretches an output turn over which held-out squares are taken together: neighbouring turns hang together."""
FEWEST_STRETCHES = 3
"""Of which a standard error of the fall is taken."""
LEAVES_MORE = 1.2
"""What the model leaves over what harmonics alone leave from which it is said not to be the drive's."""
NONE = "none"
EACH_SPEED = ", and what each speed has of its own"


@dataclass(frozen=True)
class PerRecording:
    """Held-out peak-to-peak (arcmin) of one recording at its usual input speed (r/min, None without a clock), and what
    to expect of a fresh one under its conditions, with its 95 % interval `low`, `high`."""

    name: str
    speed_rpm: float | None
    before: float
    after: float
    expected: float
    low: float
    high: float


@dataclass(frozen=True)
class Expected:
    """Peak-to-peak (arcmin) to expect of a fresh recording, and its 95 % interval `low`, `high`."""

    expected: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.expected:.4g} ({self.low:.4g} to {self.high:.4g}) arcmin"


@dataclass(frozen=True)
class Compensated(ShownAsTable):
    """A compensation, and what it leaves on parts that the fit did not see; peak-to-peak in arcmin, of samples as
    recorded however many of them were averaged for the fit.

    `before` and `after` of the held-out parts together, each part scored by a choice made without it; `predicted` for a
    fresh recording of the same length, with its 95 % interval `low`, `high`; `both` is what is left in each direction,
    `ways` what to expect of it there, and `speeds` (r/min) what to expect at each speed where the recordings differ.
    `strain_wave` says whether it is of a harmonic drive, `counted` how the channels were read, `worth` whether the fall
    is beyond chance (`evidence` standard errors, over so many `stretches` of the record; fewer than three say nothing).
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
    stretches: int = 0
    ways: Mapping[str, Expected] = field(default_factory=dict)
    speeds: Mapping[float, Expected] = field(default_factory=dict)
    strain_wave: bool = True
    counted: Mapping[str, str] = field(default_factory=dict)

    @property
    def judged(self) -> bool:
        """Whether the record is long enough to say that the fall is beyond chance, or is not."""
        return self.stretches >= FEWEST_STRETCHES

    @property
    def void(self) -> str:
        """When it holds no more, after the word 'void'."""
        return VOID_OF_STRAIN_WAVE if self.strain_wave else VOID

    def facts(self) -> dict[str, Any]:
        """What the file says of itself: method, what it leaves, what it needs, what makes it void."""
        return {
            **self.counted,
            "ratio": self.ratio,
            "method": self.method,
            "peak_to_peak_before_arcmin": round(self.before, 4),
            "peak_to_peak_expected_arcmin": round(self.predicted, 4),
            **{f"peak_to_peak_expected_at_{speed:.4g}_rpm": str(one) for speed, one in self.speeds.items()},
            "homing": homing_words(self.homing),
            "void": self.void,
        }

    def to_dict(self, file: str | None) -> dict[str, Any]:
        """The JSON of `hdopt compensate`; `file` is where the table went, None where none was written."""
        return {
            "schema": 1,
            "file": file,
            "worth": self.worth,
            "method": self.method,
            "terms": len(self.found),
            "heldout_peak_to_peak_arcmin": {
                "before": self.before,
                "after": self.after,
                "predicted": self.predicted,
                "low": self.low,
                "high": self.high,
            },
            "directions": self.both,
            "expected_by_direction": {way: vars(one) for way, one in self.ways.items()},
            "expected_by_speed": [{"speed_rpm": speed, **vars(one)} for speed, one in self.speeds.items()],
            "of_speed": of_speed(self.found),
            "return": {
                "half_arcmin": self.found.back,
                "crossing_output_deg": self.found.crossing.deg,
                "crosses": crosses(self.found.crossing),
                "path_at_start": self.found.crossing.start,
            },
            "recordings": [vars(part) for part in self.recordings],
            "held_out": self.held_out,
            "evidence": self.evidence,
            "heldout_rms_arcmin": self.scores,
            "homing_rms_arcmin_per_deg": {"input": self.homing[0], "output": self.homing[1]},
            "needs": homing_words(self.homing),
            "void": self.void,
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row a recording: held-out peak-to-peak without and with the compensation."""
        import pandas as pd

        columns = ["before_arcmin", "after_arcmin", "expected_arcmin", "low_arcmin", "high_arcmin"]
        rows = [list(vars(part).values()) for part in self.recordings]
        return pd.DataFrame(rows, columns=["recording", "speed_rpm", *columns])

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


def of_speed(found: Found) -> dict[str, Any] | None:
    """How `found` depends on the input's speed, as JSON says it; None where it does not."""
    if not isinstance(found, OfSpeed):
        return None
    own = [{"speed_rpm": rpm, "terms": len(one)} for rpm, one in zip(found.speeds, found.own, strict=True)]
    return {"lag_arcmin_per_rpm": found.lag, "speeds": own}


_ANY = "after an encoder or its zero was changed, and at a load or temperature far from the recording's"
VOID = f"after the gear was taken apart or one of its shafts was coupled anew, {_ANY}"
VOID_OF_STRAIN_WAVE = f"after the wave generator, circular spline or flexspline was taken out or turned, {_ANY}"


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
    terms: int | None = MOST_TERMS,
    seed: int = 1,
    files: Files | None = None,
) -> Compensated:
    """What to subtract, from `recordings` (files or records) of one drive.

    `drive`: its record, a study, a shipped name or the path of a study file; None leaves the model out and takes
    harmonics alone. `terms` coefficients at most, 0 for a table over both angles; None for 64 coefficients, or a table
    where these would be off by more than a twentieth of what is left anyway. `seed` for fits and resampling.
    `files` to write, where it is worth it: {"csv": PATH}, {"json": PATH} or {"c": PATH}. Raises `HdoptError` where
    nothing moves or `terms` is out of range, and before any work where a file cannot be written.
    """
    from threadpoolctl import threadpool_limits

    source, wanted = recorded_drive(drive), checked_files(files, FORMATS)
    # Matrices of a few hundred rows: a second thread of the linear algebra only waits, at six times the processor time.
    with threadpool_limits(1, user_api="blas"):
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
    moving = _moving(recordings, terms)
    rows, samples = _gathered(moving)
    each = samples.each
    still, lag, whole = _without_lag(rows, drive, seed)
    still_samples = samples.with_error(each.error - lag * signed_rpm(each))
    fold, held_out = folds(rows)
    part = fold[samples.row]
    paths = paths_of(rows, half_about(still, still.error))
    trials = tried(
        (still, fold),
        terms,
        paths,
        lambda train: None if whole is None or drive is None else model_of(train, drive, seed, whole.sign),
        still_samples,
    )
    before = centred(each.error, each, part)
    made = candidates(still, whole, terms, paths)
    nested, method = choose({name: left for name, left in trials.items() if name in made}, part)
    common, off = made[method]
    # What no other recording met is extrapolated in angle when held out; a fresh run over the same angles is not.
    again = centred(still_samples.each.error - said_of(common, still_samples.each), each, np.zeros_like(part))
    own, with_own = own_of_each_speed(rows, samples, again, min(OWN_TERMS, terms or OWN_TERMS))
    found = with_speed(common, lag, own)
    if isinstance(found, OfSpeed) and found.own:
        gained = with_own != again
        nested, again = np.where(gained, with_own, nested), with_own
        trials[method + EACH_SPEED] = np.where(gained, with_own, trials[method])
        method += EACH_SPEED
    worth, evidence, stretches = _worth(before, nested, each)
    left = np.where(met_elsewhere(rows)[samples.row], trials[method], again)
    rng = np.random.default_rng(seed)
    of_each = _each(each, left, np.ones(len(each), np.bool_), rng)
    return Compensated(
        found,
        method,
        worth and _peaks_fall(samples, before, nested),
        evidence,
        float(np.ptp(before)),
        float(np.ptp(nested)),
        *_predicted(of_each),
        {name: float(np.ptp(nested[each.direction == way])) for name, way in _ways(rows).items()},
        _per_recording(moving, each, (before, nested), of_each),
        held_out,
        {NONE: float(np.std(before))} | {name: float(np.std(left)) for name, left in trials.items()},
        homing_arcmin(found, rows.ratio),
        rows.ratio,
        (
            *_warnings(rows, held_out, moving),
            *(_too_few(len(common), terms, off, float(np.ptp(again))) if worth else ()),
            *_without_the_model(method, trials),
        ),
        stretches,
        _by_way(each, left, rng),
        _by_speed(rows, of_each),
        drive is not None,
        how_counted(moving),
    )


def _without_the_model(method: str, trials: Mapping[str, Array]) -> tuple[str, ...]:
    """A warning where harmonics alone are the `method`, though the model of the drive was among the `trials` (what each
    leaves, (n,) arcmin): a drive that is the one recorded leaves no more than they."""
    ways = [name for name in trials if "model" in name]
    if "model" in method or not ways:
        return ()
    alone, best = float(np.std(trials[HARMONICS])), min(float(np.std(trials[name])) for name in ways)
    if best < LEAVES_MORE * alone:
        return ()
    return (
        f"the model of the drive is not in it: with it {best:.3g} arcmin rms are left of what the fit did not see, "
        f"with harmonics alone {alone:.3g}; check --drive, and zero, direction and sign of measured teeth "
        "(hdopt inspect), or leave --drive out",
    )


def _ways(rows: Rows) -> dict[str, float]:
    """The directions that `rows` were recorded in, +1 and -1; {} where nothing reverses."""
    return {"forward": 1.0, "backward": -1.0} if rows.reverses else {}


def _by_way(each: Rows, left: Array, rng: np.random.Generator) -> dict[str, Expected]:
    """What to expect in each direction of the samples `each`, of which so much is `left` (n,)."""
    ways = _ways(each).items()
    return {name: Expected(*_predicted(_each(each, left, each.direction == way, rng))) for name, way in ways}


def _by_speed(rows: Rows, each: Sequence[tuple[float, float]]) -> dict[float, Expected]:
    """What to expect at each speed (r/min ->) of the records in `rows`, of `each` of which it is known with its
    standard deviation; {} where all turn at one."""
    known = speeds_rpm(rows)
    groups = of_each_speed(known)
    return {known[one[0]] or 0.0: Expected(*_predicted([each[n] for n in one])) for one in groups if len(groups) > 1}


def _moving(recordings: Sequence[Recording], terms: int | None) -> list[Recording]:
    """Those of the `recordings` whose input turns. Raises `HdoptError` where none does or `terms` is out of range."""
    if terms is not None and not 0 <= terms <= MOST_TERMS:
        raise HdoptError(f"--terms is {terms}; give 1 to {MOST_TERMS} coefficients, 0 for a table, or auto")
    moving = [r for r in recordings if not r.input_locked]
    if not moving:
        raise HdoptError("the input is locked in every recording; a compensation needs recordings that turn")
    return moving


def _gathered(recordings: Sequence[Recording]) -> tuple[Rows, Samples]:
    """The rows that are fitted, and the samples of the `recordings` behind them, which are judged."""
    neighbours = neighbours_of(recordings)
    rows = gather(recordings, neighbours)
    return rows, samples_of(recordings, rows, neighbours)


def _without_lag(rows: Rows, drive: Drive | None, seed: int) -> tuple[Rows, float, WaveformFit | None]:
    """`rows` without what grows with the speed, how much that is (arcmin for each r/min), and the model of the `drive`
    fitted to them, None without one.

    Before the model is known the lag stands beside its whole error: it is asked for once more of what the model leaves.
    """
    rpm = signed_rpm(rows)
    lag = lag_in(rows, rows.error)
    still = replace(rows, error=rows.error - lag * rpm)
    whole = None if drive is None else model_of(still, drive, seed)
    if whole is not None and shows_lag(rpm):
        lag += lag_in(still, still.error - whole.predict(still.theta))
    return replace(rows, error=rows.error - lag * rpm), lag, whole


def _each(rows: Rows, left: Array, some: Mask, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Peak-to-peak to expect and its standard deviation (arcmin) of each record, by what is `left` (n,) of `some` (n,)
    of its rows; records without any are left out."""
    records = [some & (rows.record == n) for n in range(rows.records)]
    return [peak_to_peak_again(left[mine], rows.block[mine], rng) for mine in records if mine.any()]


def _worth(before: Array, after: Array, rows: Rows) -> tuple[bool, float, int]:
    """Whether the squares fall beyond chance, by how many standard errors, over how many stretches of the record."""
    size = max(1, round(rows.ratio / GROUPS_PER_BEAT))
    _, group = np.unique(rows.block // size, return_inverse=True)
    fall = np.bincount(group, before**2 - after**2) / np.bincount(group)
    if len(fall) < FEWEST_STRETCHES:
        return False, 0.0, len(fall)
    error = float(fall.std(ddof=1)) / math.sqrt(len(fall))
    evidence = float(fall.mean()) / max(error, 1e-300)
    return evidence > SURE, min(evidence, 1e6), len(fall)


def _peaks_fall(samples: Samples, before: Array, after: Array) -> bool:
    """Whether peak-to-peak falls from `before` to `after`, (n,) each of the `samples`, by the means that were fitted:
    noise makes the extremes of samples, and its chance must not decide."""
    return bool(np.ptp(samples.means(after)) < np.ptp(samples.means(before)))


def _predicted(each: Sequence[tuple[float, float]]) -> tuple[float, float, float]:
    """Peak-to-peak to expect of a fresh recording of this length, with a 95 % interval: the mean over the recordings,
    of `each` of which value and standard deviation are known."""
    value = float(np.mean([value for value, _ in each]))
    return value, *_interval(value, math.sqrt(float(np.mean([spread**2 for _, spread in each]))))


def _interval(value: float, spread: float) -> tuple[float, float]:
    """The 95 % interval of a `value` of which this is the standard deviation, not below zero."""
    return max(value - NORMAL * spread, 0.0), value + NORMAL * spread


def _per_recording(
    recordings: Sequence[Recording], rows: Rows, held_out: tuple[Array, Array], each: Sequence[tuple[float, float]]
) -> tuple[PerRecording, ...]:
    found = []
    for number, (recording, speed) in enumerate(zip(recordings, speeds_rpm(rows), strict=True)):
        mask = rows.record == number
        before, after = (float(np.ptp(left[mask])) for left in held_out)
        found.append(PerRecording(recording.name, speed, before, after, each[number][0], *_interval(*each[number])))
    return tuple(found)


def _too_few(count: int, terms: int | None, off: float, left: float) -> tuple[str, ...]:
    """What is said where `count` coefficients are `off` (arcmin, peak-to-peak) what was fitted, of what is `left`."""
    if not terms or off < SMALL * left:
        return ()
    return (f"{count} coefficients are {off:.3g} arcmin peak-to-peak off what was fitted; --terms 0 writes a table",)


def _warnings(rows: Rows, held_out: str, recordings: Sequence[Recording]) -> tuple[str, ...]:
    said = [w for r in recordings for w in r.warnings]
    if turns_with_ends(rows.span_turns, 1 / rows.rows_per_turn) < rows.ratio:
        said.append(
            f"{rows.span_turns:.3g} of the {rows.ratio:g} input turns of a beat were recorded: beyond them the table "
            "is an extrapolation, and what it leaves there was not seen; record a whole output turn"
        )
    if held_out == STRETCHES:
        said.append("one pass of at most one output turn: held out are stretches of it; record two output turns")
    return tuple(said)
