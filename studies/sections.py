"""The sections that the steps of this package bring to a study file; the general schema asks for them by name."""

from __future__ import annotations

from pydantic import Field

from hdopt.study.base import Section


class ConcealedSection(Section):
    """`[concealed]`: size of a blind proof of the diagnosis. `share` below 1 keeps that part of every family of cases,
    `families` only these (empty: all)."""

    seed: int = Field(1, ge=0)
    share: float = Field(1.0, gt=0, le=1)
    families: list[str] = Field([])


class ResidualsSection(Section):
    """`[residuals]`: `severities` of hidden physics in units of the residual's rms (on a real motion) or of the drive's
    own error; `nothing` records without any; `noise_share` of the real noise on a simulated drive; `effects` none for
    all."""

    seed: int = Field(1, ge=0)
    severities: list[float] = Field([0.25, 0.5, 1.0])
    nothing: int = Field(8, ge=1)
    noise_share: float = Field(0.2, gt=0)
    effects: list[str] = Field([])
