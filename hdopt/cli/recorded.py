"""What the commands that read recordings share: their options, as one record."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from hdopt.cli.common import DEFAULTS
from hdopt.cli.completion import offered, recorded

if TYPE_CHECKING:
    from hdopt.workflow.recorded_drive import RecordedDrive

R = TypeVar("R")


@dataclass(frozen=True)
class RecordingOptions:
    """The files `recordings`, and what is said of them: `drive` a shipped name, a study file or "none"; its `ratio`,
    the `columns` and the `bench_file` as the options have them."""

    recordings: tuple[Path, ...]
    drive: str
    ratio: float | None
    columns: str | None
    bench_file: Path | None

    def source(self) -> RecordedDrive:
        """What was recorded and how; `HdoptError` where the options disagree or no ratio is known."""
        from hdopt.workflow.recorded_drive import recorded_drive

        return recorded_drive(self.drive, self.ratio, self.columns, self.bench_file)

    def fingerprint(self) -> str:
        """Paths and hashes of all that the work reads: study, bench file and every recording, read or not yet. They
        stand in the provenance then, whatever process reads the recordings."""
        from hdopt.files import files_of_work, note_input

        self.source()
        for recording in self.recordings:
            note_input(recording)
        work = files_of_work()
        return "" if work is None else repr(sorted(work.inputs.items()))


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
        context = click.get_current_context()
        if context.get_parameter_source("drive") is ParameterSource.DEFAULT:
            context.meta[DEFAULTS] = (f"no drive given: the shipped {drive}",)
        return command(RecordingOptions(recordings, drive, ratio, columns, bench_file), **others)

    options = (
        click.argument("recordings", nargs=-1, required=True, metavar="REC...", type=click.Path(path_type=Path)),
        click.option(
            "--drive",
            metavar="NAME|STUDY|none",
            default="csf-25-80",
            show_default=True,
            shell_complete=offered(recorded, files=True),
            help="The drive recorded.",
        ),
        click.option("--ratio", type=float, help="Reduction ratio, with --drive none."),
        click.option(
            "--columns",
            metavar="CHANNEL=NAME:UNIT,...",
            help="Layout: input, output or error (input/N - output), time, torque, temperature; NAME may be a path in "
            "the file, UNIT counts/16384, -rad, deg/gear3.",
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
