"""The recording's scale: what ratio, or what gain of the output encoder, the error's slope by the input angle means."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdopt.diagnosis.inference.catalogue import SCALE
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import NORMAL_95, TINY


@dataclass(frozen=True)
class Scale:
    """`ratio`: the drive's, were the encoders right; `gain`: the output encoder's, were the ratio right, with its 95 %
    interval `low` to `high`; `found`: whether the recording shows that one of them is off.
    """

    ratio: float
    gain: float
    low: float
    high: float
    found: bool

    def to_dict(self) -> dict[str, float]:
        """As in the JSON."""
        return {"ratio": self.ratio, "gain": self.gain, "low": self.low, "high": self.high}


def fitted_scale(fit: Fit) -> Scale | None:
    """The scale beside everything else in `fit`; None for a record too short to have one.

    The error's slope s by the input angle is 1/N - 1/N' for a ratio N' in place of N, (1 - g)/N for a gain g.
    """
    rows, names = fit.problem.rows, [term.effect for term in fit.terms]
    explanation = fit.problem.explanations[SCALE]
    if explanation.lacks(rows) is not None:
        return None
    found = SCALE in names
    term = fit.terms[names.index(SCALE)] if found else explanation.term(rows, {})
    probe = FitProbe(fit, keep=fit.all_but(names.index(SCALE)) if found else None)
    slope = float(probe.solve(term)[1][0])
    power = float(probe.table(term)[0][0, 0])
    half = NORMAL_95 * fit.problem.noise.sigma / float(np.sqrt(max(power, TINY)))
    gain = 1 - rows.ratio * slope
    ratio = 1 / (1 / rows.ratio - slope)
    return Scale(ratio, gain, gain - rows.ratio * half, gain + rows.ratio * half, found)
