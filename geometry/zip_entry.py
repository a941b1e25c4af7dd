"""Entries of ZIP archives that bear no time of their own: the same content gives the same bytes."""

from __future__ import annotations

import zipfile


def add_entry(archive: zipfile.ZipFile, name: str, text: str) -> None:
    """Add a `text` to an `archive` under a `name`, compressed, with the first date that the format knows."""
    entry = zipfile.ZipInfo(name)
    entry.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(entry, text)
