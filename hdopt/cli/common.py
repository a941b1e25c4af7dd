"""What the commands share: their options, and how a result leaves the program."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import click

from hdopt.errors import HdoptError

T = TypeVar("T")

json_option = click.option(
    "--json", "json_file", metavar="FILE", help="Write the result as JSON; '-' writes it, alone, to standard output."
)
seed_option = click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Random seed.")
set_option = click.option(
    "--set", "overrides", metavar="KEY=VALUE", multiple=True, help="Change a key of the study; may be repeated."
)
drive_option = click.option("--drive", metavar="NAME", help="A shipped drive, by name.")
study_argument = click.argument("study", required=False, metavar="[STUDY]")


def emit(result: Mapping[str, Any], json_file: str | None, lines: Iterable[str]) -> None:
    """Write `result` as JSON where asked, and `lines` for a person unless JSON takes standard output."""
    if json_file == "-":
        click.echo(to_json(result))
        return
    for line in lines:
        click.echo(line)
    if json_file:
        write_text(Path(json_file), to_json(result) + "\n")


def to_json(result: Mapping[str, Any]) -> str:
    """JSON text of `result`; numpy numbers and arrays become plain ones, numbers that are not finite become null."""
    return json.dumps(_plain(result), indent=2, allow_nan=False)


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def write_text(path: Path, text: str) -> None:
    """Write a text file, or say in one sentence why that cannot be done."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise HdoptError(
            f"cannot write {path}: {error.strerror}; give a file in a folder that can be written"
        ) from error


def progress(items: Iterable[T], label: str, total: int | None = None) -> Iterable[T]:
    """`items`, with a progress bar on standard error where that is a terminal."""
    from tqdm import tqdm

    return tqdm(items, desc=label, total=total, file=sys.stderr, disable=not sys.stderr.isatty(), leave=False)


def progress_bar(label: str, total: int) -> Callable[[int], None]:
    """A function to call with each number of steps done; shows a bar on standard error where that is a terminal."""
    from tqdm import tqdm

    bar = tqdm(desc=label, total=total, file=sys.stderr, disable=not sys.stderr.isatty(), leave=False)
    return lambda steps: bar.update(steps)
