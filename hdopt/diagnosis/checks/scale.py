"""The recording's scale: what ratio, or what gain of an encoder, the error's slope by the input angle means."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hdopt.diagnosis.inference.catalogue import SCALE
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.nuisance import Nuisances, slices_by_kind
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import NORMAL_95, TINY


@dataclass(frozen=True)
class Scale:
    """`ratio`: the drive's, were the encoders right; `gain`: the output encoder's, were the ratio right, with its 95 %
    interval `low` to `high`; `found`: whether the recording shows that one of them is off; `input_gain`: the input
    encoder's, where the base shows that it is this one that counts wrongly, else 1.
    """

    ratio: float
    gain: float
    low: float
    high: float
    found: bool
    input_gain: float = 1.0

    def to_dict(self) -> dict[str, float]:
        """As in the JSON."""
        return {
            "ratio": self.ratio,
            "gain": self.gain,
            "low": self.low,
            "high": self.high,
            "input_gain": self.input_gain,
        }


def fitted_scale(fit: Fit, nuisances: Nuisances) -> Scale | None:
    """The scale beside everything else in `fit`; None for a record too short to have one. `nuisances` are the columns
    that are always free: what is left of a slope that was taken out is one of them.

    The error's slope s by the input angle is 1/N - 1/N' for a ratio N' in place of N, (1 - g)/N for a gain g.
    """
    rows, taken = fit.problem.rows, nuisances.taken
    if taken is not None:
        place = slices_by_kind(fit, nuisances)["scale"].start
        at = fit.problem.base_width + place
        half = NORMAL_95 * float(np.sqrt(fit.covariance()[at, at])) / taken.input_gain
        slope = taken.slope + float(fit.offsets[place]) / taken.input_gain
        scale = _scale(rows.ratio, slope, half, abs(slope) > half)
        return scale if taken.input_gain == 1 else replace(scale, input_gain=1 / scale.gain)
    names = [term.effect for term in fit.terms]
    explanation = fit.problem.explanations[SCALE]
    if explanation.lacks(rows) is not None:
        return None
    found = SCALE in names
    term = fit.terms[names.index(SCALE)] if found else explanation.term(rows, {})
    probe = FitProbe(fit, keep=fit.all_but(names.index(SCALE)) if found else None)
    slope = float(probe.solve(term)[1][0])
    power = float(probe.table(term)[0][0, 0])
    half = NORMAL_95 * fit.problem.noise.sigma / float(np.sqrt(max(power, TINY)))
    return _scale(rows.ratio, slope, half, found)


def _scale(ratio: float, slope: float, half: float, found: bool) -> Scale:
    """From a `slope` of the error, rad/rad, known to +- `half`."""
    gain = 1 - ratio * slope
    return Scale(1 / (1 / ratio - slope), gain, gain - ratio * half, gain + ratio * half, found)
