"""`hdopt diagnose`: what physics recordings hold that the model leaves out, with its report and the fitted study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hdopt.diagnosis import diagnose as diagnose_records
from hdopt.errors import HdoptError
from hdopt.files import write_text
from hdopt.workflow.output_files import Files, checked_files
from hdopt.workflow.placed import recordings_named
from hdopt.workflow.recorded_drive import AnyDrive, AnyRecordings, recorded_drive
from hdopt.workflow.stated_tolerances import with_tolerances_of

if TYPE_CHECKING:
    from hdopt.diagnosis.settings import DiagnosisSettings
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis

FILES = ("report", "study")


@recordings_named
def diagnose(
    recordings: AnyRecordings,
    drive: AnyDrive = None,
    ratio: float | None = None,
    columns: str | None = None,
    seed: int = 1,
    nuisance: Sequence[str] = (),
    settings: DiagnosisSettings | None = None,
    files: Files | None = None,
) -> Diagnosis:
    """Say whether the model of `drive` explains the recordings, and if not, what physics was left out.

    `recordings`: files or records of one drive, fitted jointly. `drive`: its record, a study, a shipped name or the
    path of a study file; None for a gear of `ratio` without a harmonic-drive model. `columns` says which column of a
    file is what (as `--columns`); a bench file goes in with `recorded_drive`. `nuisance` ("drift", "time-warp") is
    fitted beside every model and never named. The same `seed` gives the same answer. `settings` are the thresholds
    (None: as shipped); a fitted drive that surely lies outside the [tolerances] of its study is warned of. `files` to
    write: {"report": PATH} an HTML page, {"study": PATH} a study with the drive's fitted errors and the effects found.

    Raises `HdoptError` where there is no recording, the ratio is unknown or contradicts the drive's, or a recording
    cannot be used; and before any work where a file cannot be written.
    """
    source = recorded_drive(drive, ratio, columns)
    wanted = checked_files(files, FILES)
    if "study" in wanted and source.study is None:
        raise HdoptError("a fitted study starts from a study; give `drive` as a study, a shipped name or a path")
    read = source.recordings(recordings)
    known = source.ratio if source.ratio is not None or not read else read[0].ratio
    settings = with_tolerances_of(source.study, settings)
    found = diagnose_records(read, source.drive, known, None, seed, nuisance, settings)
    write_diagnosis(found, wanted, [recording.name for recording in read], drive)
    return found


def write_diagnosis(found: Diagnosis, files: Mapping[str, Path], names: Sequence[str], drive: AnyDrive) -> None:
    """Write the report and the study of a diagnosis `found`, as far as `files` asks ("report", "study" -> path).

    `names` are those of the recordings, for the report; `drive` is the one diagnosed with, whose study the fitted one
    starts from. Raises `HdoptError` where a file cannot be written, or there is no such study.
    """
    if "report" in files:
        from hdopt.report.html import render
        from hdopt.report.sections.diagnosis import diagnosis_report

        write_text(files["report"], render(diagnosis_report(found, names)))
    if "study" in files:
        from hdopt.workflow.write_fitted import write_study

        write_study(found, drive, files["study"])
