"""`hdopt inspect`: the acceptance sheet of one drive from its recordings, with the files that it may leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from hdopt.errors import HdoptError
from hdopt.files import write_text
from hdopt.recordings.decision import checked_limits
from hdopt.recordings.recording import Recording
from hdopt.recordings.sheet import Inspection
from hdopt.workflow.acceptance_sheet import NO_LABEL, SheetLabel, acceptance_sheet
from hdopt.workflow.output_files import Files, checked_files, write_table_files
from hdopt.workflow.placed import recordings_named
from hdopt.workflow.recorded_drive import AnyDrive, AnyRecordings, RecordedDrive, recorded_drive
from hdopt.workflow.requirement import required_limits

FILES = ("csv", "xlsx", "report", "bench")


@recordings_named
def inspect(
    recordings: AnyRecordings,
    drive: AnyDrive = None,
    limits: Mapping[str, float] | str | None = None,
    *,
    speed_rpm: float | None = None,
    mountings: Sequence[str] = (),
    label: SheetLabel = NO_LABEL,
    seed: int = 1,
    files: Files | None = None,
) -> Inspection:
    """The acceptance sheet of one drive.

    `recordings`: files or records of one drive. `drive`: its record, a study, a shipped name or the path of a study
    file; None leaves out what needs a model (the beat of a short record, the origin of the orders). `limits` by name
    in arcmin (`hdopt.recordings.decision.LIMIT_NAMES`), or in words ("peak_to_peak=1.0arcmin"); None for the
    requirement of the drive's study, where it has one. `speed_rpm` of the input for the slope in time, by default the
    recording's own. `mountings` labels each recording for the gauge study. `label` goes on the sheet; `seed` is that
    of the fit. `files` to write: {"csv": PATH} the figures, {"report": PATH} one HTML page, {"bench": PATH} what was
    understood of the first file. Raises `HdoptError` where there is nothing to inspect, and before any work where a
    file cannot be written.
    """
    source, wanted = recorded_drive(drive), checked_files(files, FILES)
    found = acceptance_sheet(
        source.recordings(recordings),
        source.drive,
        limits_for(source, limits),
        speed_rpm=speed_rpm,
        mountings=mountings,
        label=label,
        seed=seed,
    )
    write_inspection(found, wanted, recordings, source)
    return found


def limits_for(source: RecordedDrive, limits: Mapping[str, float] | str | None) -> Mapping[str, float]:
    """The `limits` (by name in arcmin, or in words) if any are given, else what the study of `source` requires.

    Raises `HdoptError` for a name that is no figure and for a limit that is not above 0.
    """
    if limits is not None or source.study is None:
        return checked_limits(limits or {})
    return required_limits(source.study)


def write_inspection(
    found: Inspection, files: Mapping[str, Path], recordings: AnyRecordings, source: RecordedDrive
) -> None:
    """Write of a sheet `found` what `files` asks for ("csv", "xlsx", "report", "bench" -> path).

    `recordings` and their `source` are those inspected; a bench file says how the first of them was read. Raises
    `HdoptError` where a file cannot be written.
    """
    write_table_files(found, files)
    if "report" in files:
        from hdopt.report.html import render
        from hdopt.report.sections.inspection import inspection_report

        write_text(files["report"], render(inspection_report(found)))
    if "bench" in files:
        write_text(files["bench"], _bench_text(recordings, source))


def _bench_text(recordings: AnyRecordings, source: RecordedDrive) -> str:
    from hdopt.recordings.bench import bench_text
    from hdopt.recordings.read import read_channels

    first = recordings if isinstance(recordings, Recording | str | Path) else recordings[0]
    if isinstance(first, Recording) or source.ratio is None:
        raise HdoptError("a bench file says how a file was read; give the recordings as files, with a drive or a ratio")
    channels = read_channels(Path(first), source.columns, source.bench)
    return bench_text(channels.columns, source.ratio)
