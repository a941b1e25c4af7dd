"""`hdopt new`: a study to begin with."""

from __future__ import annotations

from pathlib import Path

import click

from hdopt.cli.common import emit, json_option
from hdopt.cli.completion import offered, studies_and_drives


@click.command()
@click.argument("name", metavar="NAME")
@click.option(
    "--from",
    "source",
    metavar="STUDY",
    default="csf-25-80",
    show_default=True,
    shell_complete=offered(studies_and_drives, files=True),
    help="Whose numbers it gets: a shipped drive or study, or a study file.",
)
@json_option
def command(name: str, source: str, json_file: Path | None) -> None:
    """Write NAME.toml, a study that works, with every key explained; change what differs in your drive."""
    from hdopt.workflow.new_study import new_study

    made = new_study(name, source)
    lines = (
        f"{made.file} has the numbers of {made.source}, every key explained: change what differs",
        f"next: hdopt check {made.file}",
    )
    emit(made.to_dict(), json_file, lines)
