"""Many drives of one type, a recording each: what physics each holds that the model leaves out, in one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from hdopt.diagnosis.settings import DiagnosisSettings
from hdopt.diagnosis.verdict.many import DiagnosedBatch, DiagnosedDrive
from hdopt.errors import HdoptError
from hdopt.files import write_text
from hdopt.recordings.recording import Recording
from hdopt.workflow.diagnose import diagnose
from hdopt.workflow.output_files import Files, checked_files, write_table_files
from hdopt.workflow.recorded_drive import AnyDrive, recorded_drive

FILES = ("csv", "xlsx", "report")


def diagnose_many(
    recordings: Sequence[Recording | str | Path],
    drive: AnyDrive = None,
    seed: int = 1,
    nuisance: Sequence[str] = (),
    settings: DiagnosisSettings | None = None,
    files: Files | None = None,
) -> DiagnosedBatch:
    """Diagnose each of `recordings` (files or records) as a drive of its own, on the engine in force: on processes or a
    cluster side by side, else one after another with all threads.

    `drive`, `seed`, `nuisance` and `settings` as for `diagnose`, which answers the same of each. A file that cannot be
    used is a row that says so. `files` to write: {"csv": PATH} the table, {"report": PATH} one HTML page. Raises
    `HdoptError` where none can be used, and before any work where a file cannot be written.
    """
    from hdopt.parallel.engine import engine_from, for_large_items

    source, wanted = recorded_drive(drive), checked_files(files, FILES)
    work = partial(_diagnosed, drive=source, seed=seed, nuisance=tuple(nuisance), settings=settings)
    drives = tuple(for_large_items(engine_from(None)).map(work, list(recordings)))
    if all(found.error for found in drives):
        first = f"; the first: {drives[0].error[:200]}" if drives else ""
        raise HdoptError(f"none of {len(drives)} recordings can be diagnosed{first}")
    batch = DiagnosedBatch(drives)
    write_diagnoses(batch, wanted)
    return batch


def write_diagnoses(batch: DiagnosedBatch, files: Mapping[str, Path]) -> None:
    """Write of a `batch` of diagnoses what `files` asks for ("csv", "xlsx", "report" -> path).

    Raises `HdoptError` where a file cannot be written.
    """
    write_table_files(batch, files)
    if "report" in files:
        from hdopt.report.html import render
        from hdopt.report.sections.diagnosis_many import diagnoses_report

        write_text(files["report"], render(diagnoses_report(batch)))


def _diagnosed(
    recording: Recording | str | Path,
    drive: AnyDrive,
    seed: int,
    nuisance: Sequence[str],
    settings: DiagnosisSettings | None,
) -> DiagnosedDrive:
    name = recording.name if isinstance(recording, Recording) else Path(recording).name
    try:
        found = diagnose(recording, drive, seed=seed, nuisance=nuisance, settings=settings)
    except HdoptError as error:
        return DiagnosedDrive(name, error=str(error))
    return DiagnosedDrive.of(name, found)
