"""The study section `[concealed]`: how large a blind proof of the diagnosis is, and from which seed it is drawn."""

from __future__ import annotations

from pydantic import Field

from hdopt.study.base import Section


class ConcealedSection(Section):
    """Size of the proof. `share` below 1 keeps that part of every family of cases."""

    seed: int = Field(1, ge=0)
    share: float = Field(1.0, gt=0, le=1)
    families: list[str] = Field(["nothing", "single", "knee", "pair", "decoy", "unknown"])
