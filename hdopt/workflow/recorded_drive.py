"""The drive that recordings are of, in every form that a call takes, and how its files are read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError
from hdopt.recordings.bench import Bench, load_bench
from hdopt.recordings.read import read_recording
from hdopt.recordings.recording import Recording
from hdopt.recordings.repeats import refuse_repeats
from hdopt.study import Study, load_study, shipped_drives
from hdopt.workflow.measured_parts import words_on_measured_parts

SAME_RATIO = 1e-9
"""Ratios that differ by less are one: they are quotients of tooth counts."""


@dataclass(frozen=True)
class RecordedDrive:
    """A recorded `drive`, its `study` (None without one) and `ratio`, and how its files are laid out: `columns` as
    `--columns`, `bench` as a bench file says. A gear without a model has `drive` None; its `ratio` may then be known
    from the recordings alone. `overruled` says what of the bench file does not hold because it was given anew."""

    drive: Drive | None
    study: Study | None = None
    ratio: float | None = None
    columns: str | None = None
    bench: Bench | None = None
    overruled: tuple[str, ...] = ()

    def read(self, path: str | Path) -> Recording:
        """The recording of this drive in the file `path`. Raises `HdoptError` where it cannot be used, or no ratio is
        known."""
        if self.ratio is None:
            raise HdoptError("the ratio is not known; give --drive NAME, or --drive none with --ratio X")
        return read_recording(path, self.ratio, self.columns, self.bench)

    def recordings(self, given: AnyRecordings) -> list[Recording]:
        """The recordings of this drive: those `given` as records stay, files are read. The first one read warns of what
        was `overruled`, and says what was done to tables of measured parts. Raises `HdoptError` where a file cannot be
        used, or a recording was given twice: all that is taken together here counts as measured once each."""
        if isinstance(given, Recording | str | Path):
            given = [given]
        found = []
        said = (*self.overruled, *(words_on_measured_parts(self.drive) if self.drive is not None else ()))
        for item in given:
            if isinstance(item, Recording):
                found.append(item)
                continue
            recording = self.read(item)
            found.append(replace(recording, warnings=(*said, *recording.warnings)))
            said = ()
        refuse_repeats(found)
        return found


AnyRecordings: TypeAlias = Sequence[Recording | str | Path] | Recording | str | Path
"""Files or records of one drive, or a single one."""

AnyDrive: TypeAlias = RecordedDrive | Drive | Study | str | Path | None
"""What every call with recordings takes as their drive: its record, a study, a shipped name, the path of a study file;
None or "none" for a gear without a harmonic-drive model; `recorded_drive(...)` where the files need a layout."""


def recorded_drive(
    drive: AnyDrive, ratio: float | None = None, columns: str | None = None, bench: Bench | str | Path | None = None
) -> RecordedDrive:
    """The recorded drive that `drive` means, with the `ratio` of a gear without a model, and the layout of its files:
    `columns` as `--columns` takes them, `bench` a bench file or its record.

    Raises `HdoptError` where the ratios given disagree, or "none" is given without one.
    """
    if isinstance(drive, RecordedDrive):
        return drive
    layout = load_bench(Path(bench)) if isinstance(bench, str | Path) else bench
    stated = ratio if ratio is not None or layout is None else layout.ratio
    overruled = _overruled(ratio, columns, layout)
    if drive is None or drive == "none":
        if stated is None and drive is not None:
            raise HdoptError("--drive none needs the gear's ratio; give --ratio X, or ratio in the bench file")
        return RecordedDrive(None, None, stated, columns, layout, overruled)
    study, of = (None, drive) if isinstance(drive, Drive) else ((found := _study(drive)), found.drive)
    own = float(of.geometry.ratio)
    if stated is not None and abs(stated - own) > SAME_RATIO:
        said = "ratio given" if ratio is not None else "bench file's ratio"
        raise HdoptError(
            f"the {said} is {stated:g}, that of the drive {_name(drive)} is {own:g}; give the drive that was "
            "recorded, or --drive none with the ratio"
        )
    return RecordedDrive(of, study, own, columns, layout, overruled)


def _overruled(ratio: float | None, columns: str | None, bench: Bench | None) -> tuple[str, ...]:
    """What of a `bench` does not hold beside a `ratio` and `columns` that were given anew, a sentence each."""
    if bench is None:
        return ()
    said = []
    if ratio is not None and bench.ratio is not None and abs(ratio - bench.ratio) > SAME_RATIO:
        said.append(f"the ratio is {ratio:g} as given with --ratio; the {bench.ratio:g} of the bench file is not used")
    if columns and bench.columns:
        said.append(
            "the columns are those given with --columns; those of the bench file, with their signs, steps and "
            "calibration, are not used"
        )
    return tuple(said)


def _study(drive: Study | str | Path) -> Study:
    if isinstance(drive, Study):
        return drive
    return load_study(drive=str(drive)) if str(drive) in shipped_drives() else load_study(drive)


def _name(drive: Drive | Study | str | Path) -> str:
    return drive.name if isinstance(drive, Study) else "given" if isinstance(drive, Drive) else str(drive)
