"""Put known physics on the residuals of real recordings, have it diagnosed, and show what was said, case by case."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError
from hdopt.report import Points, Section, Table
from hdopt.report.sections.words import label
from hdopt.studies.sections import ResidualsSection
from hdopt.study import Study
from hdopt.workflow.doing import counted
from hdopt.workflow.steps import Context, StepResult

if TYPE_CHECKING:
    from hdopt.bench.real_residuals import RealResidual
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis

REVERSING = "planetary-7to1-reversing.csv"
REVERSING_COLUMNS = "time=time_s:s,input=odrive_pos_rad:rad,output=output_pos_rad:rad"
REVERSING_RATIO = 7.2
TRAILS = "csf-17-100-mount.csv"
TRAIL_COLUMNS = ("altair", "trail2_V6.25", "omi_aql")


def recordings_folder() -> Path:
    """Where the real recordings are: $HDOPT_RECORDINGS, else ../shared/recordings."""
    path = Path(os.environ.get("HDOPT_RECORDINGS") or "../shared/recordings")
    if all((path / name).is_file() for name in (REVERSING, TRAILS)):
        return path
    raise HdoptError(
        f"no recordings: real-residuals works on {REVERSING} and {TRAILS}, recordings of others, which are not part of "
        f"hdopt and not in {path}; set HDOPT_RECORDINGS to their folder"
    )


def real_residuals(study: Study, context: Context) -> StepResult:
    """How often known physics is named in real noise, by severity, and how often physics that is not there; the drive
    and [residuals] are those of the `study`, the seed of the diagnosis that of the `context`.

    Three kinds of cases: a reversing actuator's own motion and residual, and a simulated drive whose only noise is that
    residual, or the difference between star trails of one exposure, scaled to a share of the drive's error.
    """
    from hdopt.bench.cases import CATALOGUE
    from hdopt.bench.real_residuals import ON_REAL_MOTION

    size = study.section("residuals", ResidualsSection, "real-residuals")
    total = len(planned(size, ON_REAL_MOTION)) + 2 * len(planned(size, CATALOGUE))
    answered = answered_cases(study.drive, size, recordings_folder(), context.seed)
    cases = pd.DataFrame(list(counted(answered, total, "case")))
    table = (
        cases.groupby(["noise", "severity"])
        .agg(
            cases=("hidden", "size"),
            exact=("exact", "sum"),
            among=("among", "sum"),
            unknown=("unknown", "sum"),
            wrong=("wrong", "sum"),
        )
        .reset_index()
    )
    missed = cases[~cases.exact]
    section = residuals_section(cases, table)
    says = [*table.to_string(index=False).splitlines(), "not answered exactly:"]
    says += (
        missed[["noise", "hidden", "severity", "verdict", "said"]].to_string(index=False).splitlines()
        if len(missed)
        else ["none"]
    )
    results = {"summary": table.to_dict("records"), "cases": cases.to_dict("records")}
    return StepResult((section,), results, says=tuple(says))


MISSED = "Every case not answered exactly"
SUMMARY = "Answered exactly, among the explanations offered, unknown, or named wrongly"
SEVERITY = (
    "Severity is the hidden rms in units of the real residual's (real motion) or of the drive's own error; none where "
    "nothing was hidden."
)


def residuals_section(cases: pd.DataFrame, table: pd.DataFrame) -> Section:
    """The page of all `cases` (as `judged` puts them) and the `table` of how they came out by noise and severity."""
    hidden, empty = cases[cases.hidden != "nothing"], cases[cases.hidden == "nothing"]
    says = [
        f"With nothing put there, a name was given in {int(empty.wrong.sum())} of {len(empty)} records, and "
        f"{int(empty.unknown.sum())} were called unknown.",
        f"With physics put there, {int(hidden.exact.sum())} of {len(hidden)} were named exactly, "
        f"{int(hidden.among.sum())} were among the explanations offered, and {int(hidden.wrong.sum())} got a wrong "
        "name.",
    ]
    missed = cases[~cases.exact]
    rows = pd.DataFrame(
        {
            "hidden": missed.hidden.map(lambda name: label(name) if name != "nothing" else "nothing"),
            "in the noise of": missed.noise,
            "severity": missed.severity.where(missed.severity > 0),
            "verdict": missed.verdict,
            "said": missed.said.map(_in_words),
            "came out as": missed.apply(_outcome, axis=1) if len(missed) else [],
        }
    ).reset_index(drop=True)
    counts = table.assign(severity=table.severity.where(table.severity > 0)).rename(
        columns={"noise": "in the noise of", "among": "among the offered", "wrong": "wrong name"}
    )
    return Section(
        "real-residuals",
        "Known physics in real noise",
        (
            Points(tuple(says)),
            Table("residuals-summary", SUMMARY, counts, SEVERITY, {"severity": "g"}),
            *((Table("residuals-missed", MISSED, rows, "", {"severity": "g"}),) if len(rows) else ()),
        ),
    )


def _outcome(case: pd.Series) -> str:
    """How a case that was not answered exactly came out, in words."""
    if case.wrong:
        return "a wrong name"
    if case.unknown:
        return "the right name, said beside more that is unknown" if case.among else "unknown"
    return "among the explanations offered" if case.among else "not found"


def _in_words(effects: str) -> str:
    return ", ".join(label(effect) for effect in effects.split(", ")) if effects else ""


def answered_cases(
    drive: Drive, size: ResidualsSection, folder: Path, seed: int
) -> Iterator[dict[str, str | float | bool]]:
    """Every case with what was hidden and what was said, as `judged` puts it.

    `drive` is the one simulated; `size` says how many cases, what in them and how large, and draws them from its own
    seed; the recordings are in `folder`; `seed` is that of the diagnosis.
    """
    from hdopt.bench.cases import CATALOGUE
    from hdopt.bench.real_residuals import ON_REAL_MOTION, on_real_motion, on_simulated_drive
    from hdopt.diagnosis import diagnose
    from hdopt.recordings.read import recording_from_table

    rng = np.random.default_rng(size.seed)
    real = actuator_residual(folder)

    for effect, severity in planned(size, ON_REAL_MOTION):
        recording = recording_from_table(on_real_motion(real, effect, severity, rng), real.ratio)
        yield judged("actuator, its own motion", effect, severity, diagnose(recording, None, real.ratio, seed=seed))
    for noise, residual in (
        ("actuator, simulated drive", real.residual),
        ("star trails, simulated drive", trails(folder)),
    ):
        for effect, severity in planned(size, CATALOGUE):
            tables = on_simulated_drive(residual, effect, severity, size.noise_share, rng)
            recordings = [recording_from_table(table, drive.geometry.ratio) for table in tables]
            yield judged(noise, effect, severity, diagnose(recordings, drive, seed=seed))


def planned(size: ResidualsSection, effects: Iterable[str]) -> list[tuple[str, float]]:
    """(effect, severity) of each case in one noise, of those `effects` that `size` asks for: those with nothing
    first."""
    wanted = [name for name in effects if not size.effects or name in size.effects]
    return [("", 0.0)] * size.nothing + [(name, severity) for name in wanted for severity in size.severities]


def judged(noise: str, hidden: str, severity: float, diagnosis: Diagnosis) -> dict[str, str | float | bool]:
    """One case, in this `noise` with the effect `hidden` ("" for none) at this `severity`, and what the `diagnosis`
    says of it: answered exactly (nothing said where nothing is), among the explanations offered (said beside more that
    is `unknown`, too), `unknown`, or wrong: a name for what is not there."""
    said = tuple(sorted(found.id for found in diagnosis.effects))
    truth = (hidden,) if hidden else ()
    offered = {said, *(tuple(sorted(ids)) for ids in diagnosis.ambiguous_with)}
    unknown = diagnosis.verdict == "unknown"
    exact = said == truth and not unknown and diagnosis.verdict != "ambiguous"
    return {
        "noise": noise,
        "hidden": hidden or "nothing",
        "severity": severity,
        "verdict": diagnosis.verdict,
        "said": ", ".join(said),
        "exact": exact,
        "among": truth in offered and bool(truth or not unknown),
        "unknown": unknown,
        "wrong": bool(said) and truth not in offered,
    }


def actuator_residual(folder: Path) -> RealResidual:
    """What the diagnosis leaves of the reversing actuator's recording in `folder`, with its motion."""
    from hdopt.bench.real_residuals import RealResidual
    from hdopt.diagnosis import diagnose
    from hdopt.recordings.read import read_recording

    recording = read_recording(folder / REVERSING, REVERSING_RATIO, REVERSING_COLUMNS)
    fit = diagnose(recording, None, REVERSING_RATIO).evidence.selection.best.fit
    samples = fit.problem.rows
    assert samples.time is not None, "the columns of this recording include time"
    return RealResidual(samples.time, samples.theta, fit.residual, REVERSING_RATIO)


def trails(folder: Path) -> Array:
    """Reading noise of one star trail in `folder` against the mean of the three, arcsec, (n,): the mount's motion is in
    all of them."""
    table = pd.read_csv(folder / TRAILS)[list(TRAIL_COLUMNS)]
    return (table[TRAIL_COLUMNS[0]] - table.mean(axis=1)).to_numpy(float)
