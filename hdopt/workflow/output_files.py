"""The files that a call writes beside its result: checked before the work, so that none is in vain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from hdopt.errors import HdoptError, unknown_name
from hdopt.files import HasTables, claim_output, write_tables

Files = Mapping[str, str | Path]
"""Kind of file, such as "report", to its path."""


TABLE_KINDS = ("csv", "xlsx")


def write_table_files(result: HasTables, files: Mapping[str, Path]) -> None:
    """Write the tables of `result` to those of `files` (kind -> path) that are tables. Raises `HdoptError` where one
    cannot be written."""
    for kind in TABLE_KINDS:
        if kind in files:
            write_tables(result, files[kind], kind)


def checked_files(files: Files | None, kinds: Sequence[str]) -> dict[str, Path]:
    """The paths of `files` (None for none) by their kind, each of which can be written. Raises `HdoptError` for a kind
    that is none of `kinds`, and for a path that cannot be written."""
    checked: dict[str, Path] = {}
    for kind, path in (files or {}).items():
        if kind not in kinds:
            raise HdoptError(unknown_name("file to write", kind, kinds))
        checked[kind] = Path(path)
        claim_output(checked[kind])
    return checked
