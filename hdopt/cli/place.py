"""Where a refusal points to: the option, or the file, whose content the message speaks of."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any  # Any: values of options

import click
from click.core import ParameterSource

from hdopt.files import FilesOfWork
from hdopt.study.named import shows

MOST_FILES = 3
FILE = re.compile(r"(?:read|write) (?:to )?\S*[/.]")
OPTION = re.compile(r"(?:^|[\s'(])--?[a-z]")


def placed(message: str, context: click.Context | None, work: FilesOfWork) -> str:
    """`message` with the options of the command and the values of the study that it speaks of before it; where it
    names neither an option nor a file, with the study's or the recordings' names."""
    places = [] if context is None else list(dict.fromkeys(_options(message, context)))
    if work.values is not None and work.facts.get("source", "") not in message and "--set " not in message:
        places += work.values(message)
    if places:
        return f"{'; '.join(places[:MOST_FILES])}: {message}"
    if OPTION.search(message) or FILE.search(message) or any(name in message for name in _given(context, work)):
        return message
    files = [work.facts["source"]] if work.facts.get("source") else [path.name for path in work.inputs]
    return f"{', '.join(files[:MOST_FILES])}: {message}" if files else message


def _options(message: str, context: click.Context) -> Iterator[str]:
    """'-n 20' for every option whose name and value stand in the `message`, and not yet its spelling."""
    for parameter in context.command.params:
        if not isinstance(parameter, click.Option) or parameter.name is None:
            continue
        option = max(parameter.opts, key=len)
        name = option.lstrip("-").replace("-", "_")
        if re.search(rf"{option}\b", message):
            continue
        value = context.params.get(parameter.name)
        default = context.get_parameter_source(parameter.name) is not ParameterSource.COMMANDLINE
        for one in value if isinstance(value, tuple) else (value,):
            if shows(message, one, name):
                yield f"{option} {one}" + (" (the default)" if default else "")


def _given(context: click.Context | None, work: FilesOfWork) -> Iterator[str]:
    """Names of files and values that the user gave, which a message may hold as its place."""
    yield from (path.name for path in (*work.inputs, *work.outputs))
    if source := work.facts.get("source"):
        yield source
    values: list[Any] = [] if context is None else list(context.params.values())
    for value in values:
        for one in value if isinstance(value, tuple) else (value,):
            if isinstance(one, str) and len(one) > 1:
                yield one
