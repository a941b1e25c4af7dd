"""What the commands share that take recordings of one drive or, with --each, of many."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar  # Any: values of JSON; what the command's other options give

import click

from hdopt.cli.common import emit, finished_parts_kept, resume_option, watched
from hdopt.cli.recorded import RecordingOptions
from hdopt.files import HasTables

R = TypeVar("R")


class Result(HasTables, Protocol):
    """What `emit` takes, of one drive or of many."""

    def to_dict(self) -> Mapping[str, Any]: ...


@dataclass(frozen=True)
class EachOptions:
    """Whether the files are of one drive or `each` of a drive of its own, and whether to `resume`."""

    each: bool
    resume: bool

    def work(
        self, given: RecordingOptions, one: Callable[[], R], many: Callable[[], R], of_one: Iterable[str] = ()
    ) -> R:
        """Do `one()`, or with --each `many()`: its drives watched, and kept for --resume. `of_one` are options given
        that say something of a single drive only; `click.UsageError` for what does not go together."""
        if not self.each:
            if self.resume:
                raise click.UsageError("--resume goes on with many drives; give it with --each")
            return one()
        if names := ", ".join(of_one):
            raise click.UsageError(f"{names}: said of one drive; leave it out with --each")
        from hdopt.parallel.engine import engine_in_force

        with finished_parts_kept(given.fingerprint(), self.resume), engine_in_force(watched("drives")):
            return many()


def each_options(text: str) -> Callable[[Callable[..., R]], Callable[..., R]]:
    """--each (its help is `text`) and --resume of a command, which gets them as `batch`, an `EachOptions`."""

    def decorate(command: Callable[..., R]) -> Callable[..., R]:
        @functools.wraps(command)
        def bundled(*arguments: Any, each: bool, resume: bool, **others: Any) -> R:
            return command(*arguments, batch=EachOptions(each, resume), **others)

        return click.option("--each", is_flag=True, help=text)(resume_option(bundled))

    return decorate


def emit_written(result: Result, json_file: Path | None, lines: Iterable[str], write: Callable[[], None]) -> None:
    """Let `write` leave the files of a `result` and say it: a file that cannot be written after minutes of work must
    not take the answer with it. `json_file` and `lines` as for `emit`."""
    try:
        write()
    finally:
        emit(result.to_dict(), json_file, lines, tables=result)
