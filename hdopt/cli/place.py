"""Where a refusal points to: the option, or the file, whose content the message speaks of."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import click
from click.core import ParameterSource

from hdopt.errors import shown
from hdopt.files import FilesOfWork
from hdopt.study.named import shows, without_numbers

MOST_FILES = 3
FILE = re.compile(r"(?:(?:read|write)(?: to)?|folder) \S*[/.]")
OPTION = re.compile(r"(?:^|[\s'(])--?[a-z]")


def placed(message: str, context: click.Context | None, work: FilesOfWork) -> str:
    """`message` with the options of the command and the values of the study that it speaks of before it; where it
    names neither an option nor a file, with the study's or the recordings' names."""
    said = _without_names(message, context, work)
    places = [] if context is None else list(dict.fromkeys(_options(message, said, context)))
    of_study = work.facts.get("source", "") not in message and "--set " not in message
    if work.values is not None and of_study and not _begins_with_an_input(message, work):
        of_options = () if context is None else _numbers_of_options(said, context)
        places += work.values(without_numbers(said, of_options))
    if places:
        return f"{'; '.join(places[:MOST_FILES])}: {message}"
    if OPTION.search(message) or FILE.search(message) or _names_an_input(message, context, work):
        return message
    files = [work.facts["source"]] if work.facts.get("source") else [path.name for path in work.inputs]
    return f"{', '.join(files[:MOST_FILES])}: {message}" if files else message


class _Given(NamedTuple):
    """One value of an `option` as it is spelt, the option's `name` as keys are written, and whether it is the
    `default`."""

    option: str
    name: str
    value: object
    default: bool


def _values(context: click.Context) -> Iterator[_Given]:
    """Every value that an option of the command has."""
    for parameter in context.command.params:
        if not isinstance(parameter, click.Option) or parameter.name is None:
            continue
        option = max(parameter.opts, key=len)
        value = context.params.get(parameter.name)
        default = context.get_parameter_source(parameter.name) is not ParameterSource.COMMANDLINE
        for one in value if isinstance(value, tuple) else (value,):
            yield _Given(option, option.lstrip("-").replace("-", "_"), one, default)


def _options(message: str, said: str, context: click.Context) -> Iterator[str]:
    """'-n 20' for every option whose name and value stand in what the `message` has `said` beside names of files, or
    whose text in quotes, and not yet its spelling."""
    for option, name, one, default in _values(context):
        if re.search(rf"{option}\b", message):
            continue
        text = one if isinstance(one, str) and not default else None
        if text is not None and repr(text) != shown(text) and shown(text) in message:
            yield option  # the message shows of its long text what there is room for
        elif (text is not None and repr(text) in message) or shows(said, one, name):
            yield f"{option} {one}" + (" (the default)" if default else "")


def _numbers_of_options(message: str, context: click.Context) -> Iterator[float]:
    """The numbers of options of which the `message` speaks, by their spelling or by name and value."""
    for option, name, one, _ in _values(context):
        if isinstance(one, int | float) and (re.search(rf"{option}\b", message) or shows(message, one, name)):
            yield float(one)


def _begins_with_an_input(message: str, work: FilesOfWork) -> bool:
    """Whether `message` speaks of a file that was read: its numbers are of that file, whatever a study holds."""
    return message.startswith(tuple(name for path in work.inputs for name in _ends_of(path)))


def _ends_of(path: Path) -> list[str]:
    """What `path` may be called from a folder above it: 'cam.csv', 'cams/cam.csv', and so on up to all of it."""
    return [str(Path(*path.parts[start:])) for start in range(len(path.parts))]


def _names_an_input(message: str, context: click.Context | None, work: FilesOfWork) -> bool:
    """Whether `message` names a file, or what the user gave in place of one."""
    names = {path.name for path in (*work.inputs, *work.outputs)} | _given_as_inputs(context, work)
    return any(re.search(_standing_alone(name), message) for name in names if name)


def _without_names(message: str, context: click.Context | None, work: FilesOfWork) -> str:
    """`message` without the names of files that it has: their digits are no numbers of anything."""
    ends = {end for path in (*work.inputs, *work.outputs) for end in _ends_of(path)}
    for name in sorted(ends | _given_as_inputs(context, work), key=len, reverse=True):
        message = re.sub(_standing_alone(name), "", message) if name else message
    return message


def _standing_alone(name: str) -> str:
    """Pattern of `name` where it is no part of a longer one."""
    return rf"(?<![\w.-]){re.escape(name)}(?![\w-])"


def _given_as_inputs(context: click.Context | None, work: FilesOfWork) -> set[str]:
    """What the user gave as the command's arguments, and where the study came from."""
    names = {work.facts.get("source", "")}
    parameters = [] if context is None else [p for p in context.command.params if isinstance(p, click.Argument)]
    for parameter in parameters:
        value = context.params.get(parameter.name or "") if context else None
        names |= {str(one) for one in (value if isinstance(value, tuple) else (value,)) if one is not None}
    return names
