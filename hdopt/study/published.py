"""The section that names published numbers to recompute."""

from __future__ import annotations

from pydantic import Field

from hdopt.study.base import Positive, Section


class PublishedSection(Section):
    """[published]"""

    file: str
    """CSV of table,case,quantity,published,sampling_deg,set: one published number a line, relative to the study file.
    `set` holds what the case changes of this study, KEY=VALUE; KEY=VALUE."""
    source: str
    tolerance_arcmin: Positive = 0.02
    """What still counts as reproduced: published values have two to four decimals."""
    remarks: tuple[str, ...] = Field(default=(), strict=False)
    """What the comparison shows, in words; a paragraph each."""
