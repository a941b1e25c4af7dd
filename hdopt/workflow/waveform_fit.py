"""The model of a drive fitted to recordings: its twelve errors, how the angles were counted, and the full beat.

The diagnosis fits the same model beside physics that it may lack; an acceptance sheet and a compensation need only the
waveform, and whether it is enough.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.base_fit import fit_base
from hdopt.diagnosis.inference.fit import Fit, FitProblem
from hdopt.diagnosis.inference.noise import Noise
from hdopt.drive.geometry import Drive
from hdopt.kinematics.cartesian import PARAMETERS, CartesianModel
from hdopt.recordings.recording import TURN, Recording
from hdopt.recordings.rows import Rows, gather, neighbours_for

SIGN_EVIDENCE = 6.0
"""Difference of log-likelihood (four independent values an input turn) from which the data decide the error's sign."""
VALUES_PER_TURN = 4.0
DRAWS = 200
"""Draws of the errors' posterior for the interval of the beat."""
BEAT_CELLS = 180


@dataclass(frozen=True)
class WaveformFit:
    """A drive's model fitted to recordings.

    `errors` (12,) mm, Cartesian, `covariance` (12, 12) mm^2; `sign` -1 where the angles count the other way round, so
    that the recorded error is that of the mirrored drive; `decided` whether the data decide that; `evidence` the
    difference of log-likelihood. `rms_arcmin` is what the model leaves, `trend_arcmin` the straight drift per input
    turn and `back_arcmin` half the return error that were fitted beside it.
    """

    model: CartesianModel
    errors: Array
    covariance: Array
    sign: float
    decided: bool
    evidence: float
    rms_arcmin: float
    trend_arcmin: float
    ratio: float
    back_arcmin: float = 0.0

    def predict(self, theta: Array) -> Array:
        """Error (arcmin, n) at input angles `theta` (n,) rad, as the recordings count it, without its mean."""
        return self.sign * self.model.evaluate(theta, self.errors)[0]

    def beat_peak_to_peak(self, seed: int) -> tuple[float, float, float]:
        """Peak-to-peak (arcmin) over a full output turn, and its 95 % interval by draws of the errors from `seed`."""
        rng = np.random.default_rng(seed)
        theta: Array = np.asarray(np.arange(round(self.ratio) * BEAT_CELLS) * (TURN / BEAT_CELLS), float)
        rotation = self.model.rotation(theta)
        value = float(np.ptp(self.model.evaluate_at(rotation, self.errors)[0]))
        values, vectors = np.linalg.eigh((self.covariance + self.covariance.T) / 2)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = [
            float(np.ptp(self.model.evaluate_at(rotation, self.errors + root @ rng.normal(size=PARAMETERS))[0]))
            for _ in range(DRAWS)
        ]
        low, high = np.quantile(draws, [0.025, 0.975])
        return value, min(float(low), value), max(float(high), value)


def fit_waveform(recordings: Sequence[Recording], drive: Drive, seed: int = 1, both_signs: bool = True) -> WaveformFit:
    """The model of `drive` fitted to `recordings` of it, jointly, each with its own zero and with one return error.

    `both_signs` tries the error as recorded and mirrored (the angles counted the other way round) and takes what the
    data choose. The same `seed` gives the same fit.
    """
    return fit_rows(gather(recordings, neighbours_for(recordings)), drive, seed, (1.0, -1.0) if both_signs else (1.0,))


def fit_rows(rows: Rows, drive: Drive, seed: int, signs: Sequence[float], free: Array | None = None) -> WaveformFit:
    """The model of `drive` fitted to `rows`, trying the error with each of `signs` (1.0, -1.0 or both) from `seed`;
    `free` (n, q) are columns fitted beside it, if any."""
    from threadpoolctl import threadpool_limits

    model = CartesianModel.of(drive)
    with threadpool_limits(1, user_api="blas"):
        fits = {sign: _fit(rows, model, sign, seed, free) for sign in signs}
    size = {sign: max(float(np.std(fit.residual)), 1e-9) for sign, fit in fits.items()}
    best = min(size, key=lambda sign: size[sign])
    evidence = 0.0
    if len(size) > 1:
        evidence = VALUES_PER_TURN * max(rows.span_turns, 1.0) * math.log(size[-best] / size[best])
    decided = evidence >= SIGN_EVIDENCE
    sign = best if decided else signs[0]
    fit = fits[sign]
    back = sign * float(fit.offsets[rows.records]) if rows.reverses else 0.0
    return WaveformFit(
        model,
        fit.errors,
        fit.covariance()[:PARAMETERS, :PARAMETERS],
        sign,
        decided,
        evidence,
        size[sign],
        sign * float(fit.offsets[rows.records + rows.reverses]) if _has_trend(rows) else 0.0,
        rows.ratio,
        back,
    )


def _fit(rows: Rows, model: CartesianModel, sign: float, seed: int, free: Array | None) -> Fit:
    mine = replace(rows, error=sign * (rows.error - float(np.median(rows.error))))
    nuisance = offset_columns(rows) if free is None else np.column_stack([offset_columns(rows), free])
    left = mine.error - nuisance @ np.linalg.lstsq(nuisance, mine.error, rcond=None)[0]
    scale = float(np.std(left))
    problem = FitProblem(mine, model, nuisance, Noise.white(mine, max(0.3 * scale, 1e-9)), max(1.0, scale / 0.3))
    first = fit_base(problem, np.random.default_rng(seed))
    sigma = max(float(np.std(first.residual)), 1e-9)
    again = replace(problem, noise=Noise.white(mine, sigma))
    return fit_base(again, np.random.default_rng(seed), starts=2, near=first)


def offset_columns(rows: Rows) -> Array:
    """Columns free beside the model: a zero for each recording of `rows`, the half return error where it reverses,
    and a straight trend over the input angle (in input turns) where the record covers half an output turn."""
    columns = [(rows.record[:, None] == np.arange(rows.records)).astype(float)]
    if rows.reverses:
        columns.append(rows.direction[:, None])
    if _has_trend(rows):
        columns.append((rows.theta - rows.theta.mean())[:, None] / TURN)
    return np.column_stack(columns)


def _has_trend(rows: Rows) -> bool:
    return rows.span_turns >= 0.5 * rows.ratio
