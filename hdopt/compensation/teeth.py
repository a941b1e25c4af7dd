"""What teeth and rings add inside the meshing zones, as waves round each spline of every length that a record carries.

Long waves of the teeth, lobes of a ring and a single damaged tooth are all a deviation that stands on a spline, met by
the driving zone. Their waves are fitted together with the model's errors, each band of waves as large as the record
says that it is (evidence, D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4, 1992): what is noise stays
near zero, so that nothing need be chosen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.compensation.pursuit import independent_share
from hdopt.compensation.surface import DIMMEST
from hdopt.effects.met import Spline, Waves, met_angles, met_at
from hdopt.kinematics.cartesian import PARAMETERS, CartesianModel, rotation_of
from hdopt.recordings.rows import Rows

SHORTEST = 64
"""Highest waves round a spline: of a raised tooth, its neighbours half as much, they leave an eighth of the tip."""
ROWS_PER_WAVE = 2.5
MOST_ROWS = 20_000
"""Rows that the fit takes, evenly spread: 45 MB for every 20 000 with both splines' waves."""
LONE = 10
"""Waves up to this number are weighed one by one (lobes), shorter ones in bands of half an octave."""
ROUNDS, EVIDENCE_ROUNDS = 8, 25
STEPS = (1.0, 0.5, 0.2)
ENOUGH = 1e-3
"""Share by which the squares must fall for another round."""
CELLS = 4096
LOOSE = 100.0
"""How much further than its own variance a fitted error of the model may move beside the waves."""


@dataclass(frozen=True)
class Teeth:
    """A drive's `model` with its `errors` (12,) mm and what stands on both splines besides, `cs` and `fs`, mm of arc at
    even steps round one turn, (cells,) each; `sense` is -1 where the angles count the other way round."""

    model: CartesianModel
    errors: Array
    sense: float
    cs: Array
    fs: Array

    @classmethod
    def bare(cls, model: CartesianModel, errors: Array, sense: float) -> Teeth:
        """`model` with `errors` (12,) mm and nothing on the splines; `sense` +1 or -1."""
        return cls(model, errors, sense, np.zeros(1), np.zeros(1))

    def added(self, turned: Array) -> Array:
        """What both zones meet, mm of arc, (2, n), where the input and the flexspline's teeth have `turned` (2, n),
        rad."""
        return self.at_angles(met_at(turned, self.model.beyond_at(rotation_of(turned), self.errors)))

    def at_angles(self, angles: Array) -> Array:
        """What stands on the splines, mm of arc, (2, n), where the zones meet them at `angles` (2, 2, n), rad."""
        return _looked_up(self.cs, angles[0]) + _looked_up(self.fs, angles[1])

    def zones(self, turned: Array) -> Array:
        """What each zone would make if it drove alone, arcmin, (2, n), where the input and the flexspline's teeth have
        `turned` (2, n), rad; times `sense`."""
        rotation, added = rotation_of(turned), self.added(turned)
        alone = [self.model.evaluate_at(rotation, self.errors, added - ALONE[1 - zone])[0] for zone in (0, 1)]
        return np.asarray(self.sense * np.stack(alone), float)

    def at(self, theta: Array) -> Array:
        """Error (arcmin, n) at input angles `theta` (n,) rad."""
        rotation = self.model.rotation(theta)
        added = self.added(np.stack([theta, self.model.advance * theta]))
        return self.sense * self.model.evaluate_at(rotation, self.errors, added)[0]

    def sharpened(self, width: float, count: int) -> Teeth:
        """These teeth before means of `count` even samples over `width` rad of the input, from which they were fitted,
        dimmed their waves."""
        if count < 2 or len(self.cs) < 2:
            return self
        half = np.arange(len(self.cs) // 2 + 1) * width / 2
        seen = np.ones(len(half))
        seen[1:] = np.sin(half[1:]) / (count * np.sin(half[1:] / count))
        dimmed = np.where(np.arange(len(half)) <= SHORTEST, np.maximum(seen, DIMMEST), 1.0)
        cs, fs = (np.fft.irfft(np.fft.rfft(table) / dimmed, len(table)) for table in (self.cs, self.fs))
        return replace(self, cs=cs, fs=fs)


ALONE = 1e3 * np.eye(2)[:, :, None]
"""mm by which one zone is set back so that the other one drives."""


def _looked_up(table: Array, angle: Array) -> Array:
    place = np.mod(angle / (2 * np.pi), 1.0) * len(table)
    return np.asarray(np.interp(place, np.arange(len(table) + 1), np.append(table, table[0])), float)


def fit_teeth(rows: Rows, free: Array, start: Teeth, variance: Array) -> Teeth:
    """`start` with waves on both splines, fitted to `rows`, as short as they carry.

    `free` (n, q) are columns fitted beside it; `variance` (12,) mm^2 that of the errors of `start`, which may move.
    """
    longest = max(2, min(SHORTEST, int(rows.rows_per_turn / ROWS_PER_WAVE)))
    found = start
    some = slice(None, None, -(-len(rows) // MOST_ROWS))
    for most in (min(LONE, longest), longest):
        found = refit_waves(found, (rows.theta[some], rows.error[some]), free[some], variance, np.arange(2, most + 1))
    return found


def refit_waves(
    found: Teeth,
    seen: tuple[Array, Array],
    free: Array,
    variance: Array,
    waves: Index,
    rounds: int = ROUNDS,
    under: tuple[Array, Array] | None = None,
) -> Teeth:
    """`found` with `waves` (w,) and its errors fitted anew to `seen`, the angles (n,) rad and errors (n,) arcmin, in at
    most so many `rounds`; what else stands on its splines stays, and what is `under` the waves, (`CELLS`,) mm of each.

    `free` (n, q) and `variance` (12,) as in `fit_teeth`. A step that would leave more is shortened.
    """
    theta, error = seen
    both = [Waves(spline, tuple(int(w) for w in waves)) for spline in Spline]
    band = np.repeat(_bands(waves), 2)
    band = np.r_[band, band.max() + 1 + band]
    loose = np.r_[1.0 / (LOOSE * np.maximum(variance, 1e-12)), np.full(free.shape[1], 1e-12)]
    around = np.asarray(np.arange(CELLS) * (2 * np.pi / CELLS), float)
    p = len(band)
    below = under or (np.zeros(1), np.zeros(1))
    above = [np.broadcast_to(table, CELLS) - base for table, base in zip((found.cs, found.fs), below, strict=True)]
    here = np.r_[_coefficients(above[0], waves), _coefficients(above[1], waves), found.errors]
    stays = [beyond_waves(table, waves) + base for table, base in zip(above, below, strict=True)]

    def at(state: Array) -> Teeth:
        parts = state[: p // 2], state[p // 2 : p]
        tables = [w.added(around, 0, part)[0] + kept for w, part, kept in zip(both, parts, stays, strict=True)]
        return Teeth(found.model, state[p:], found.sense, *tables)

    left = _left(found, theta, error, free)
    for _ in range(rounds):
        now = at(here)
        columns, slopes, value = _linear(now, both, theta)
        target = now.sense * error - value + columns @ here[:p]
        solution = _weighed(np.column_stack([columns, slopes, free]), target, band, loose)
        step = np.r_[solution[:p] - here[:p], solution[p : p + PARAMETERS]]
        tried = [(_left(at(here + share * step), theta, error, free), share) for share in STEPS]
        least, share = min(tried)
        if least >= left:
            break
        here, left, before = here + share * step, least, left
        if least > (1 - ENOUGH) * before:
            break
    return at(here)


def _left(found: Teeth, theta: Array, error: Array, free: Array) -> float:
    """Sum of squares (arcmin^2) that `found` leaves beside `free` columns."""
    rest = error - found.at(theta)
    rest = rest - free @ np.linalg.lstsq(free, rest, rcond=1e-8)[0]
    return float(rest @ rest)


def beyond_waves(table: Array, waves: Index) -> Array:
    """A `table` round one turn at `CELLS` steps, (CELLS,), without `waves` (w,) and its mean."""
    spectrum = np.fft.rfft(np.broadcast_to(table, CELLS))
    spectrum[0] = 0
    spectrum[waves] = 0
    return np.asarray(np.fft.irfft(spectrum, CELLS), float)


def _coefficients(table: Array, waves: Index) -> Array:
    """Sine and cosine of each of `waves` (w,) in a `table` round one turn, as `Waves` takes them, (2 w,)."""
    if len(table) < 2:
        return np.zeros(2 * len(waves))
    spectrum = np.fft.rfft(table)[waves] * (2 / len(table))
    return np.column_stack([-spectrum.imag, spectrum.real]).ravel()


def _bands(waves: Index) -> Index:
    """The band of each of the `waves` (w,), counted from 0."""
    shorter = LONE - 1 + np.floor(2 * np.log2(np.maximum(waves, LONE) / LONE))
    return np.asarray(np.where(waves < LONE, waves - 2, shorter), np.int64)


def _linear(found: Teeth, both: list[Waves], theta: Array) -> tuple[Array, Array, Array]:
    """Columns of the waves (n, p), slopes of the errors (n, 12), and the error (n,) of `found` at `theta`, arcmin."""
    model = found.model
    rotation = model.rotation(theta)
    angles = met_angles(theta, model.advance, model.beyond_at(rotation, found.errors))
    value, zone, slopes = model.evaluate_at(rotation, found.errors, found.at_angles(angles))
    met = angles[:, zone, np.arange(len(theta))]
    columns = np.hstack([w.columns(met[w.spline], zone) for w in both]) * model.arcmin_per_mm
    return columns, slopes, value


def _weighed(design: Array, target: Array, band: Index, loose: Array) -> Array:
    """Coefficients of `design` (n, p + q) for `target` (n,): those of each `band` (p,) with a common variance that the
    evidence gives, the others with precisions `loose` (q,), in the units of theirs."""
    p = len(band)
    inner, moment, power = design.T @ design, design.T @ target, float(target @ target)
    size = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    inner, moment = inner / np.outer(size, size), moment / size
    count = np.bincount(band).astype(float)
    strength = np.full(len(count), 1e-2)
    solution = np.zeros(len(moment))
    noise, share = max(power / len(target), 1e-300), 1.0
    for turn in range(EVIDENCE_ROUNDS):
        # Precisions in units of one independent value's noise: coloured noise has fewer of those than rows.
        prior = np.r_[strength[band], loose * noise / size[p:] ** 2]
        covariance = np.linalg.inv(inner * share + np.diag(prior))
        solution = covariance @ moment * share
        left = max(power - 2 * float(solution @ moment) + float(solution @ inner @ solution), 1e-300)
        good = np.maximum(count - strength * np.bincount(band, np.diag(covariance)[:p]), 1e-6)
        noise = left / max(len(target) - good.sum() / share - (len(moment) - p), 1.0)
        strength = np.clip(good * noise / np.maximum(np.bincount(band, solution[:p] ** 2), 1e-300), 1e-8, 1e8)
        if turn == 1:
            share = independent_share(target - design @ (solution / size))
    return np.asarray(solution / size, float)
