"""`hdopt check`: what can be computed from a study, and what is missing for the rest."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdopt.cli.common import emit, json_option, table_options
from hdopt.cli.completion import offered, studies

if TYPE_CHECKING:
    from hdopt.workflow.check_study import StudyCheck


@click.command()
@table_options
@click.argument("study", metavar="FILE", shell_complete=offered(studies, files=True))
@json_option
def command(study: str, json_file: Path | None) -> int:
    """What can be computed from FILE, a study file or a shipped study, and which keys are missing for the rest.

    Exit status 1: nothing can be computed yet.
    """
    from hdopt.workflow.check_study import check_study

    found = check_study(study)
    emit(found.to_dict(), json_file, _lines(found), tables=found)
    return 0 if found.complete else 1


def _always_missing(found: StudyCheck) -> list[str]:
    """The keys that everything lacks, where that is more than one calculation's concern."""
    first, *others = [one.missing for one in found.capabilities]
    return [key for key in first if all(key in missing for missing in others)]


def _lines(found: StudyCheck) -> Iterator[str]:
    yield f"{found.study}:"
    always = _always_missing(found)
    if always:
        yield f"  nothing can be computed without {', '.join(always)}; each line says what it needs besides"
    for one in found.capabilities:
        commands = ", ".join(f"hdopt {name}" for name in one.commands)
        if one.can:
            yield f"  yes  {one.what} ({commands})"
        elif one.missing:
            besides = [key for key in one.missing if key not in always]
            yield f"  no   {one.what}" + (f": give {', '.join(besides)}" if besides else "")
        else:
            yield f"  no   {one.what}: {one.why}"
    for doubt in found.doubts:
        yield f"doubt: {doubt}"
    for said in found.defaults:
        yield f"default: {said}"
