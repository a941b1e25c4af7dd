"""The study section `[residuals]`: which physics is put on real residuals, how large, and how often none."""

from __future__ import annotations

from pydantic import Field

from hdopt.study.base import Section


class ResidualsSection(Section):
    """`severities` of hidden physics in units of the residual's rms (on a real motion) or of the drive's own error;
    `nothing` records without any; `noise_share` of the real noise on a simulated drive; `effects` none for all."""

    seed: int = Field(1, ge=0)
    severities: list[float] = Field([0.25, 0.5, 1.0])
    nothing: int = Field(8, ge=1)
    noise_share: float = Field(0.2, gt=0)
    effects: list[str] = Field([])
