"""What the commands that read recordings share: their options, and how files become recordings of one drive."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from hdopt.drive.geometry import Drive
    from hdopt.recordings.bench import Bench
    from hdopt.recordings.recording import Recording
    from hdopt.study import Study

R = TypeVar("R")


@dataclass(frozen=True)
class Source:
    """The drive that was recorded, its `ratio`, its `study` (None without one), and how its files are laid out."""

    drive: Drive | None
    study: Study | None
    ratio: float
    columns: str | None
    bench: Bench | None

    def read(self, path: Path) -> Recording:
        """One recording of this drive."""
        from hdopt.recordings.read import read_recording

        return read_recording(path, self.ratio, self.columns, self.bench)

    def read_all(self, paths: Iterable[Path]) -> list[Recording]:
        """The recordings of this drive in `paths`, in their order."""
        return [self.read(path) for path in paths]


@dataclass(frozen=True)
class RecordingOptions:
    """The files `recordings`, and what is said of them: `drive` a shipped name, a study file or "none"; its `ratio`,
    the `columns` and the `bench_file` as the options have them."""

    recordings: tuple[Path, ...]
    drive: str
    ratio: float | None
    columns: str | None
    bench_file: Path | None

    def source(self) -> Source:
        """What was recorded and how; `HdoptError` where the options disagree or no ratio is known."""
        return source_of(self.drive, self.ratio, self.columns, self.bench_file)


def recording_options(command: Callable[..., R]) -> Callable[..., R]:
    """REC..., --drive, --ratio, --columns and --bench of a `command`, which gets them as its first argument, a
    `RecordingOptions`."""

    @functools.wraps(command)
    def bundled(
        *,
        recordings: tuple[Path, ...],
        drive: str,
        ratio: float | None,
        columns: str | None,
        bench_file: Path | None,
        **others: Any,  # what the command's own options give
    ) -> R:
        return command(RecordingOptions(recordings, drive, ratio, columns, bench_file), **others)

    options = (
        click.argument("recordings", nargs=-1, required=True, metavar="REC...", type=click.Path(path_type=Path)),
        click.option(
            "--drive", metavar="NAME|STUDY|none", default="csf-25-80", show_default=True, help="The drive recorded."
        ),
        click.option("--ratio", type=float, help="Reduction ratio, with --drive none."),
        click.option(
            "--columns",
            metavar="CHANNEL=NAME:UNIT,...",
            help="Layout: input, output or error, time, torque, temperature; NAME may be a path in the file, UNIT "
            "counts/16384, -rad, deg/gear3.",
        ),
        click.option(
            "--bench",
            "bench_file",
            metavar="FILE",
            type=click.Path(path_type=Path),
            help="A bench file (TOML) that says the layout once for all recordings.",
        ),
    )
    decorated: Callable[..., R] = bundled
    for option in reversed(options):
        decorated = option(decorated)
    return decorated


def source_of(drive: str, ratio: float | None, columns: str | None, bench_file: Path | None) -> Source:
    """What was recorded and how: `drive` a shipped name, a study file or "none"; `ratio`, `columns` and `bench_file` as
    the options have them. Raises `HdoptError` where they disagree or no ratio is known."""
    from hdopt.errors import HdoptError
    from hdopt.recordings.bench import load_bench
    from hdopt.study import load_study, shipped_drives

    bench = load_bench(bench_file) if bench_file is not None else None
    stated = ratio if ratio is not None else (bench.ratio if bench is not None else None)
    if drive == "none":
        if stated is None:
            raise HdoptError("--drive none needs the gear's ratio; give --ratio X, or ratio in the bench file")
        return Source(None, None, stated, columns, bench)
    study = load_study(drive=drive) if drive in shipped_drives() else load_study(drive)
    own = float(study.drive.geometry.ratio)
    if stated is not None and abs(stated - own) > 1e-9:
        raise HdoptError(
            f"the ratio given is {stated:g}, that of the drive {drive} is {own:g}; give the drive that was recorded, "
            "or --drive none with the ratio"
        )
    return Source(study.drive, study, own, columns, bench)
