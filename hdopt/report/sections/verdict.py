"""The first section of a run's page: whether the requirement is met, and why."""

from __future__ import annotations

from collections.abc import Sequence

from hdopt.report import Points, Ruling, Section


def verdict_section(ruling: Ruling, reasons: Sequence[str], key: str = "verdict") -> Section:
    """The section that says the `ruling` first and then the `reasons`, a sentence each, in their order; they may refer
    to figures and tables by [[key]]. `key` names the section."""
    items = (ruling, Points(tuple(reasons))) if reasons else (ruling,)
    return Section(key, "Verdict", items)
