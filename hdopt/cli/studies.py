"""`hdopt studies`: what ships."""

from __future__ import annotations

from pathlib import Path

import click

from hdopt.cli.common import emit, json_option


@click.command()
@json_option
def command(json_file: Path | None) -> None:
    """The shipped studies, a line each; run one with `hdopt run NAME`."""
    from hdopt.study import shipped_study_titles

    titles = shipped_study_titles()
    width = max(map(len, titles), default=0)
    studies = [{"name": name, "title": title} for name, title in titles.items()]
    emit({"studies": studies}, json_file, (f"{name:{width}s}  {title}" for name, title in titles.items()))
