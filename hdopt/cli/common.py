"""What the commands share: their options, and how a result leaves the program."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import click

from hdopt.files import to_json, write_text

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


def progress(items: Iterable[T], label: str, total: int | None = None) -> Iterable[T]:
    """`items`, with a progress bar on standard error where that is a terminal."""
    from tqdm import tqdm

    return tqdm(items, desc=label, total=total, file=sys.stderr, disable=not sys.stderr.isatty(), leave=False)


def watched(engine, label: str):
    """An engine by its name, with a progress bar over what it maps where standard error is a terminal."""
    from hdopt.engine import engine_from

    chosen = engine_from(engine)
    return Watched(chosen, label) if sys.stderr.isatty() else chosen


@dataclass(frozen=True)
class Watched:
    """An engine whose results pass a progress bar."""

    engine: Any
    label: str

    def map(self, function, items):
        items = list(items)
        return progress(self.engine.map(function, items), self.label, len(items))
