"""Many drives of one type, a recording each: one table, the performance against the limit, outliers named."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from hdopt.errors import HdoptError
from hdopt.files import write_text
from hdopt.recordings.capability import outliers, performance
from hdopt.recordings.recording import Recording
from hdopt.recordings.repeats import fingerprint
from hdopt.recordings.sheet import Batch, Unit
from hdopt.workflow.acceptance_sheet import acceptance_sheet
from hdopt.workflow.inspect import limits_for
from hdopt.workflow.output_files import Files, checked_files, write_table_files
from hdopt.workflow.recorded_drive import AnyDrive, RecordedDrive, recorded_drive

FILES = ("csv", "xlsx", "report")


def inspect_many(
    recordings: Sequence[Recording | str | Path],
    drive: AnyDrive = None,
    limits: Mapping[str, float] | str | None = None,
    seed: int = 1,
    files: Files | None = None,
) -> Batch:
    """Inspect each of `recordings` (files or records) as a drive of its own, on the engine in force.

    `drive` and `limits` as for `inspect`; `seed` for fits and intervals. A file that cannot be read is a row that says
    so, and one that holds the rows of another before it: it is no second drive. `files` to write: {"csv": PATH} the
    table, {"report": PATH} one HTML page. Raises `HdoptError` where none can be read, and before any work where a file
    cannot be written.
    """
    from hdopt.parallel.engine import engine_from

    source, wanted = recorded_drive(drive), checked_files(files, FILES)
    required = dict(limits_for(source, limits))
    work = partial(_unit, source=source, limits=required, seed=seed)
    units = _once_each(engine_from(None).map(work, list(recordings)))
    sound = [unit for unit in units if not unit.error]
    if not sound:
        raise HdoptError(f"none of {len(units)} recordings can be read; the first: {units[0].error[:200]}")
    measured = [(unit.name, unit.peak_to_peak) for unit in sound if unit.peak_to_peak is not None]
    values = [value for _, value in measured]
    far = {measured[k][0] for k in outliers(values)}
    limit = required.get("peak_to_peak")
    batch = Batch(
        tuple(replace(unit, outlier=unit.name in far and not unit.error) for unit in units),
        limit,
        None if limit is None else performance(values, limit, seed),
    )
    write_batch(batch, wanted)
    return batch


def write_batch(batch: Batch, files: Mapping[str, Path]) -> None:
    """Write of a `batch` of sheets what `files` asks for ("csv", "xlsx", "report" -> path). Raises `HdoptError` where a
    file cannot be written."""
    write_table_files(batch, files)
    if "report" in files:
        from hdopt.report.html import render
        from hdopt.report.sections.inspection import batch_report

        write_text(files["report"], render(batch_report(batch)))


def _once_each(units: Iterable[tuple[Unit, str]]) -> list[Unit]:
    """The `units`, each with its recording's fingerprint ("" where it could not be read): of equal ones the first
    counts, the others say so."""
    found: list[Unit] = []
    seen: dict[str, str] = {}
    for unit, print_of in units:
        if print_of in seen:
            said = f"the same rows as {seen[print_of]}: a recording counts for one drive; give this drive's own"
            found.append(Unit(unit.name, error=said))
            continue
        if print_of:
            seen[print_of] = unit.name
        found.append(unit)
    return found


def _unit(
    recording: Recording | str | Path, source: RecordedDrive, limits: dict[str, float], seed: int
) -> tuple[Unit, str]:
    """The figures of one drive, and its recording's fingerprint, "" where it could not be read."""
    name = recording.name if isinstance(recording, Recording) else Path(recording).name
    try:
        read = source.recordings(recording)
        sheet = acceptance_sheet(read, source.drive, limits, seed=seed)
    except HdoptError as error:
        return Unit(name, error=str(error)), ""
    verdict = next((d.verdict for d in sheet.limits if d.name == "peak_to_peak"), "")
    unit = Unit(
        name,
        sheet.recording_peak_to_peak if sheet.beat is None else sheet.beat.value,
        "" if sheet.locked else "recording" if sheet.beat is None else "beat",
        float(sheet.one_turn.max()) if len(sheet.one_turn) else None,
        sheet.rms,
        None if sheet.returned is None else sheet.returned.median,
        verdict,
        sheet.missed,
    )
    return unit, fingerprint(read[0])
