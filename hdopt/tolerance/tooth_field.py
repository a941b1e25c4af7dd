"""Random teeth of a spline that keep tolerances of pitch: a field over the teeth, its phases free.

Cumulative pitch deviations are a sum of waves k = 1 to Z/2 a turn, each of normal sine and cosine parts: every phase is
alike. Two figures of the spectrum are free, its size and how much of it is long, and two tolerances fix them: in the
share of splines that is asked for the largest single pitch deviation keeps f_p, and in the same share the range of the
cumulative ones keeps F_p. No tolerance says more of the spectrum; which family it is taken from is the study's choice.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hdopt.arrays import Array
from hdopt.drive.pitch_tolerances import PitchTolerances
from hdopt.errors import HdoptError

CALIBRATION_SPLINES = 2**13
"""Splines that both quantiles are taken over: at a share of 0.9973, 22 lie beyond, which makes it right to 0.0006."""
CALIBRATION_SEED = 1328
LAST_EXPONENT = 6.0
"""Beyond it a power law is one wave a turn."""

Words = NDArray[np.uint64]


def power_law(waves: Array, shape: float) -> Array:
    """Standard deviations of the parts of each of these `waves` a turn, k^-shape: 0 for independent teeth, large for
    one wave."""
    return np.asarray(waves**-shape)


def one_wave(waves: Array, shape: float) -> Array:
    """The same of `waves` of independent teeth, and of one wave a turn, `shape` times as large as any other.

    A blank that was held off-centre has such a wave.
    """
    return np.where(waves == 1, math.hypot(1.0, shape), 1.0)


@dataclass(frozen=True)
class Family:
    """A family of spectra: standard deviations by waves and `shape`, which grows to `longest` as long waves do."""

    spread: Callable[[Array, float], Array]
    longest: float


FAMILIES = {"power_law": Family(power_law, LAST_EXPONENT), "one_wave": Family(one_wave, 1000.0)}


@dataclass(frozen=True)
class ToothField:
    """Cumulative pitch deviations of a spline of so many `teeth`: `spread` (K,), mm, is the standard deviation of the
    sine and of the cosine part of k = 1 to K = Z//2 waves a turn; `shape` is that of its family."""

    teeth: int
    spread: tuple[float, ...]
    shape: float

    def drawn(self, u: Array) -> Array:
        """The splines that the numbers `u` (n,) in (0, 1) stand for, mm of arc, (n, Z).

        Each number is the seed of a spline, so that the spline is the same wherever it is drawn; neighbouring numbers
        have nothing in common.
        """
        return self._teeth(_normal_pairs(u, len(self.spread)))

    def _teeth(self, parts: NDArray[np.complex128]) -> Array:
        scaled = parts * (np.array(self.spread) * self.teeth / 2)
        if self.teeth % 2 == 0:
            scaled[:, -1] *= math.sqrt(2)  # the last wave has one part only: with equal spreads, teeth are independent
        whole = np.concatenate([np.zeros((len(parts), 1)), scaled], axis=1)
        return np.asarray(np.fft.irfft(whole, self.teeth, axis=1))


def largest_single(deviations: Array) -> Array:
    """Largest single pitch deviation by size of each spline of `deviations` (n, Z), mm, (n,)."""
    return np.asarray(np.abs(deviations - np.roll(deviations, 1, axis=1)).max(axis=1))


@lru_cache(maxsize=32)
def tooth_field(teeth: int, tolerances: PitchTolerances, share: float, family: str = "power_law") -> ToothField:
    """The field over so many `teeth` of which the `share` (0 to 1) keeps each of the `tolerances`, from a `family` of
    `FAMILIES`.

    Raises `HdoptError` where F_p/f_p is less than independent teeth have, or more than one wave has.
    """
    from scipy.optimize import brentq

    spectrum = FAMILIES[family]
    waves = np.arange(1, teeth // 2 + 1, dtype=float)
    u = (np.arange(CALIBRATION_SPLINES) + 0.5) / CALIBRATION_SPLINES
    parts = _normal_pairs(u, len(waves), CALIBRATION_SEED)

    def quantiles(shape: float) -> tuple[float, float]:
        deviations = ToothField(teeth, tuple(spectrum.spread(waves, shape)), shape)._teeth(parts)
        single, cumulative = largest_single(deviations), np.ptp(deviations, axis=1)
        return float(np.quantile(single, share)), float(np.quantile(cumulative, share))

    def apart(grown: float) -> float:
        single, cumulative = quantiles(math.expm1(grown))
        return math.log(cumulative / single / wanted)

    wanted = tolerances.cumulative / tolerances.single
    last = math.log1p(spectrum.longest)
    if apart(0.0) > 0 or apart(last) < 0:
        low, high = (cumulative / single for single, cumulative in map(quantiles, (0.0, spectrum.longest)))
        raise HdoptError(
            f"a cumulative pitch of {wanted:.3g} times the single pitch; {teeth} teeth have between {low:.3g} "
            f"(independent deviations) and {high:.3g} (one wave a turn); change either tolerance"
        )
    shape = math.expm1(float(brentq(apart, 0.0, last, xtol=1e-3)))
    scale = tolerances.single / quantiles(shape)[0]
    return ToothField(teeth, tuple((scale * spectrum.spread(waves, shape)).tolist()), shape)


def _mixed(words: Words) -> Words:
    """Every bit of `words` depends on all (the finaliser of SplitMix64; Steele, Lea and Flood 2014)."""
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(words ^ (words >> np.uint64(31)))


def _normal_pairs(u: Array, pairs: int, stream: int = 0) -> NDArray[np.complex128]:
    """Independent standard normal numbers as real and imaginary parts, (n, `pairs`), that each number of `u` (n,) is
    the seed of (SplitMix64, Box and Muller 1958); those of another `stream` have nothing in common with them."""
    step = np.uint64(0x9E3779B97F4A7C15)
    with np.errstate(over="ignore"):
        seeds = _mixed(np.ascontiguousarray(u, dtype=np.float64).view(np.uint64) + np.uint64(stream + 1) * step)
        words = _mixed(seeds[:, None] + np.arange(1, 2 * pairs + 1, dtype=np.uint64) * step)
    uniform = ((words >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
    radius = np.sqrt(-2 * np.log(uniform[:, :pairs]))
    return np.asarray(radius * np.exp(2j * math.pi * uniform[:, pairs:]))
