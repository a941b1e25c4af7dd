"""What the commands share: their options, and how a result leaves the program."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar  # Any: values of JSON; what the command's other options give

import click
from click.shell_completion import CompletionItem

from hdopt.cli.completion import a_file, drives, engines, offered, structures, studies
from hdopt.cli.log import logged
from hdopt.cli.whole_number import WholeNumber
from hdopt.files import HasTables, claim_output, files_of_work, to_csv, to_json, write_tables, write_text
from hdopt.words import without_minus_nought

if TYPE_CHECKING:
    from hdopt.parallel.engine import Engine
    from hdopt.study import Study
    from hdopt.workflow.requirement import Verdict

T = TypeVar("T")
R = TypeVar("R")


TO_STANDARD_OUTPUT = ("json_file", "csv")
"""Options that take '-' in place of a file."""


class OutputFile(click.ParamType):  # type: ignore[type-arg]  # generic in newer Click only
    """A file that the command will write: checked before any work is done, refused where it is an input as well."""

    name = "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = Path(value)
        if str(value) != "-":
            claim_output(path)
        elif param is not None and param.name not in TO_STANDARD_OUTPUT:
            self.fail("only --json and --csv write to standard output; give the name of a file", param, ctx)
        return path

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return a_file(ctx, param, incomplete)


json_option = click.option(
    "--json",
    "json_file",
    metavar="FILE",
    type=OutputFile(),
    help="Write the result as JSON; '-' writes it, alone, to standard output.",
)
TABLES = "hdopt.tables"
"""The tables' files that were asked for."""


def _tables_asked(ctx: click.Context, parameter: click.Parameter, path: Path | None) -> None:
    if path is None:
        return
    if parameter.name == "xlsx" and path.suffix.lower() != ".xlsx":
        raise click.BadParameter(f"{path} does not end with .xlsx, by which spreadsheets know a workbook")
    ctx.meta.setdefault(TABLES, []).append((parameter.name, path))


def table_options(command: Callable[..., R]) -> Callable[..., R]:
    """--csv and --xlsx of a `command` that gives its result to `emit` as `tables`."""
    texts = {"csv": "Write the table as CSV.", "xlsx": "Write all tables as an Excel workbook, a sheet each."}
    decorated = command
    for name, text in reversed(texts.items()):
        option = click.option(
            f"--{name}", metavar="FILE", type=OutputFile(), expose_value=False, callback=_tables_asked, help=text
        )
        decorated = option(decorated)
    return decorated


def _write_tables(result: HasTables | None) -> None:
    """Write the tables of `result` to the files that the command line asked for."""
    if result is None:
        return  # an answer such as "infeasible" has none
    for kind, path in _tables_wanted():
        if str(path) == "-":
            click.echo(to_csv(next(iter(result.tables().values()))), nl=False)
        else:
            write_tables(result, path, kind)


def _tables_wanted() -> list[tuple[str, Path]]:
    context = click.get_current_context(silent=True)
    return [] if context is None else context.meta.get(TABLES, [])


seed_option = click.option("--seed", type=WholeNumber(0, 2**63 - 1), default=1, show_default=True, help="Random seed.")
set_option = click.option(
    "--set", "overrides", metavar="KEY=VALUE", multiple=True, help="Change a key of the study; may be repeated."
)
drive_option = click.option("--drive", metavar="NAME", shell_complete=offered(drives), help="A shipped drive, by name.")
structure_option = click.option(
    "--structure",
    metavar="S",
    shell_complete=offered(structures),
    help="integral, automatic, one_way_major or one_way_minor.",
)


study_argument = click.argument("study", required=False, metavar="[STUDY]", shell_complete=offered(studies, files=True))
check_option = click.option(
    "--check",
    is_flag=True,
    expose_value=False,
    callback=lambda ctx, parameter, value: ctx.meta.__setitem__(CHECK, value),
    help="End with status 1 where the requirement is missed.",
)
"""For every command that can say whether a study's requirement is met; `status` turns the verdict into the status."""
CHECK = "hdopt.check"
DEFAULTS = "hdopt.defaults"
"""What the command falls back on, for `emit`."""


@dataclass(frozen=True)
class StudyOptions:
    """Which study a command is to work on: `study` its name or path, `drive` a shipped drive in place of its own, and
    `overrides`, KEY=VALUE each."""

    study: str | None
    drive: str | None
    overrides: tuple[str, ...]

    def load(self, *further: str) -> Study:
        """The study that is meant, with `further` KEY=VALUE after those of --set."""
        from hdopt.study import DEFAULT_STUDY, DRIVE_SECTIONS, load_study
        from hdopt.study.defaults import defaults_taken, used_by

        study = load_study(self.study, (*self.overrides, *further), self.drive)
        context = click.get_current_context()
        said = defaults_taken(study.sections, used_by(context.info_name, study.sections), study.document)
        if self.study is None and self.drive is None:
            said = (f"no study given: the shipped {DEFAULT_STUDY}", *said)
        elif self.study is not None and self.drive is not None:
            sections = ", ".join(f"[{name}]" for name in DRIVE_SECTIONS)
            said = (f"--drive: {sections} are those of {self.drive}, whatever {self.study} gives", *said)
        context.meta[DEFAULTS] = said
        return study


def study_options(command: Callable[..., R]) -> Callable[..., R]:
    """[STUDY], --drive and --set of a `command`, which gets them as its first argument, a `StudyOptions`."""

    @functools.wraps(command)
    def bundled(
        *,
        study: str | None,
        drive: str | None,
        overrides: tuple[str, ...],
        **others: Any,  # what the command's own options give
    ) -> R:
        return command(StudyOptions(study, drive, overrides), **others)

    return study_argument(drive_option(set_option(bundled)))


def answer_options(command: Callable[..., R]) -> Callable[..., R]:
    """--json and --seed of a `command`, which gets them as `json_file` and `seed`."""
    return json_option(seed_option(command))


def work_options(command: Callable[..., R]) -> Callable[..., R]:
    """--engine, --check, --json and --seed of a `command` with long work that can say whether a requirement is met."""
    return engine_option(check_option(answer_options(command)))


def status(answer: bool, verdict: Verdict | None) -> int:
    """Exit status: 1 where the answer is "no", or where --check was given and the requirement is missed."""
    missed = verdict is not None and not verdict.met
    return 0 if answer and not (missed and click.get_current_context().meta.get(CHECK)) else 1


def emit(
    result: Mapping[str, Any],
    json_file: str | Path | None,
    lines: Iterable[str],
    verdict: Verdict | None = None,
    tables: HasTables | None = None,
    of_files: Mapping[str, str] | None = None,
) -> None:
    """Write `result` as JSON where asked, and `lines` for a person unless JSON takes standard output.

    After them every file that the command has written by an option is named, with what `of_files` says of it by its
    path.
    The verdict, where there is one, is the last line, and `requirement` in the JSON; `provenance` is there always, and
    `defaults` where the command falls back on any.
    `tables` is what --csv and --xlsx take theirs from. Where a file cannot be written, the lines are printed all the
    same: the work is not lost.
    """
    result = dict(result)
    context = click.get_current_context(silent=True)
    defaults: tuple[str, ...] = () if context is None else context.meta.get(DEFAULTS, ())
    if defaults:
        result["defaults"] = list(defaults)
    if verdict is not None:
        result["requirement"] = verdict.to_dict()
    if json_file is not None:
        result["provenance"] = _provenance()
    alone = [path for path in (json_file, *(path for _, path in _tables_wanted())) if str(path) == "-"]
    if len(alone) > 1:
        raise click.UsageError("standard output can take one of --json and --csv; give the other a file")
    try:
        _write_tables(tables)
        if str(json_file) == "-":
            click.echo(to_json(result))
        elif json_file:
            write_text(Path(json_file), to_json(result) + "\n")
    finally:
        if not alone:
            _say(lines, defaults, verdict, of_files or {})


def _say(lines: Iterable[str], defaults: Iterable[str], verdict: Verdict | None, of_files: Mapping[str, str]) -> None:
    for line in lines:
        click.echo(without_minus_nought(line))
    for said in defaults:
        click.echo(f"default: {said}")
    work = files_of_work()
    for path in () if work is None else work.written:
        said = of_files.get(str(path), "")
        click.echo(f"wrote {path}" + (f" ({said})" if said else ""))
    if verdict is not None:
        click.echo(verdict.line)


def _provenance() -> dict[str, Any]:
    from hdopt.workflow.provenance import provenance

    context = click.get_current_context(silent=True)
    if context is None:
        return provenance()
    return provenance(seed=context.params.get("seed"), command=context.info_name)


def progress(items: Iterable[T], label: str, total: int | None = None) -> Iterable[T]:
    """`items`, with a progress bar on standard error where that is a terminal, else with a line now and then."""
    if not sys.stderr.isatty():
        return logged(items, label, total)
    from tqdm import tqdm

    return tqdm(items, desc=label, total=total, file=sys.stderr, leave=False)


def _put_in_force(ctx: click.Context, parameter: click.Parameter, name: str | None) -> None:
    from hdopt.errors import HdoptError
    from hdopt.parallel.engine import engine_in_force

    if name is None:
        return
    try:
        ctx.with_resource(engine_in_force(name))
    except HdoptError as error:
        raise HdoptError(f"--engine: {error}") from error


engine_option = click.option(
    "--engine",
    metavar="ENGINE",
    shell_complete=offered(engines),
    callback=_put_in_force,
    expose_value=False,
    help="What does the work: process, threads[:N], processes[:N] or dask://HOST:PORT; threads if omitted.",
)
"""For every command with long work. The engine is in force for all that the command does; no function passes it on."""


@contextmanager
def finished_parts_kept(inputs: str, resume: bool) -> Iterator[None]:
    """Keep the finished parts of work of more than some seconds in the user's cache folder until it is done, so that
    the same command with --resume goes on with them: the same `inputs` (hashes of the study or the recordings),
    options, seed and version."""
    import hashlib

    from hdopt.parallel.engine import engine_from, engine_in_force
    from hdopt.parallel.kept import Kept, Parts, cache_folder, forget_old
    from hdopt.workflow.provenance import own_version

    context = click.get_current_context()
    asked = {name: value for name, value in context.params.items() if name not in ("json_file", "resume")}
    key = f"{context.info_name} {inputs} {asked} {own_version()}"
    forget_old(cache_folder())
    parts = Parts.open(cache_folder() / hashlib.sha256(key.encode()).hexdigest()[:32], key, resume)
    with engine_in_force(Kept(engine_from(None), parts, quiet_s=QUIET_S, needed=False)):
        yield
    parts.clear()


QUIET_S = 10.0
"""Work shorter than this is repeated sooner than kept."""

resume_option = click.option("--resume", is_flag=True, help="Go on where the same command was interrupted.")


def watched(label: str) -> Engine:
    """The engine in force, with the progress of what it maps on standard error."""
    from hdopt.parallel.engine import engine_from

    return Watched(engine_from(None), label)


@dataclass(frozen=True)
class Watched:
    """An engine whose results pass a progress bar."""

    engine: Engine
    label: str

    @property
    def elsewhere(self) -> bool:
        return self.engine.elsewhere

    @property
    def threads(self) -> int:
        return self.engine.threads

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        items = list(items)
        return iter(progress(self.engine.map(function, items), self.label, len(items)))
