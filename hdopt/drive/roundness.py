"""Measured roundness of the circular spline: radii over the angle, filtered as ISO 12181 filters them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.profiles import read_polar
from hdopt.drive.values import require
from hdopt.keywords import names_keywords
from hdopt.words import counted

EVEN_PLACES = 8192
"""Places of one turn that the measured points are joined on, by a periodic cubic, before they are filtered."""
LAST_WAVE = 4
"""Waves kept, in cut-offs: 2^-16 of the amplitude is left of the last."""


def transmission(waves: Array, cutoff: float) -> Array:
    """Share of the amplitude of so many `waves` a turn that the Gaussian low-pass filter of ISO 12181-2 with `cutoff`
    UPR lets through: exp(-pi (alpha k/k_c)^2) with alpha = sqrt(ln 2/pi), which is 2^-(k/k_c)^2; a half at the
    cut-off."""
    return np.asarray(np.exp2(-((np.asarray(waves) / cutoff) ** 2)))


@names_keywords
@dataclass(frozen=True)
class MeasuredRoundness:
    """Radial deviation of the circular spline, mm: Re sum c_k exp(i k angle) over `waves` c_1, c_2, ... with angles
    clockwise from the major axis at input angle 0. Outward is positive.

    `cutoff` (UPR) is that of the filter, `eccentricity` (mm) the first wave as it was measured, and `recentred` whether
    it was taken out: roundness is that about the least-squares centre.
    """

    waves: tuple[complex, ...]
    cutoff: int
    eccentricity: float
    recentred: bool
    source: str = "array"

    @classmethod
    def of(
        cls,
        angles: Array,
        radii: Array,
        cutoff: int = 50,
        *,
        zero: float = 0.0,
        counterclockwise: bool = False,
        recentre: bool = True,
        source: str = "array",
    ) -> MeasuredRoundness:
        """From `radii` (mm, (n,)) at `angles` (rad, (n,)) over one turn, filtered with `cutoff` UPR.

        Angle 0 of the table lies `zero` rad clockwise from the major axis at input angle 0; the table's angles count
        `counterclockwise` where it says so. `recentre` takes the first wave out; `source` as in the class. Raises
        `DriveError` where a value is not finite, an angle comes twice, or points lie further apart than half a wave of
        the cut-off.
        """
        from scipy.interpolate import CubicSpline

        where = f"measured roundness {source}"
        require(cutoff >= 2, f"{where}: the cut-off is {cutoff} UPR; it must be 2 or more")
        angles, radii = np.asarray(angles, float), np.asarray(radii, float)
        require(
            bool(np.isfinite(angles).all() and np.isfinite(radii).all()), f"{where} holds a value that is not finite"
        )
        turned = np.mod((-angles if counterclockwise else angles) + zero, 2 * math.pi)
        order = np.argsort(turned)
        turned, radii = turned[order], radii[order]
        gaps = np.diff(np.append(turned, turned[0] + 2 * math.pi))
        require(gaps.min() > 1e-9, f"{where} gives an angle twice; keep one point an angle (360 deg is 0 deg)")
        require(
            gaps.max() <= math.pi / cutoff,
            f"{where} has no point for {math.degrees(gaps.max()):.3g} deg; a cut-off of {cutoff} UPR needs one every "
            f"{180 / cutoff:.3g} deg at least; measure more points or lower upr",
        )
        joined = CubicSpline(np.append(turned, turned[0] + 2 * math.pi), np.append(radii, radii[0]), bc_type="periodic")
        even = joined(turned[0] + np.arange(EVEN_PLACES) * (2 * math.pi / EVEN_PLACES))
        k = np.arange(1, min(LAST_WAVE * cutoff, EVEN_PLACES // 2 - 1) + 1, dtype=np.float64)
        waves = np.fft.rfft(even)[1 : len(k) + 1] * (2 / EVEN_PLACES) * np.exp(-1j * k * turned[0])
        eccentricity = float(abs(waves[0]))
        waves = waves * transmission(k, cutoff)
        if recentre:
            waves[0] = 0
        return cls(tuple(map(complex, waves)), cutoff, eccentricity, recentre, source)

    def radial(self, angles: Array) -> Array:
        """The deviation at `angles` (rad), mm, same shape."""
        k = np.arange(1, len(self.waves) + 1)
        return np.asarray(np.real(np.exp(1j * np.multiply.outer(angles, k)) @ np.array(self.waves)))

    @property
    def peak_to_valley(self) -> float:
        """Range of the filtered deviation over a turn, mm: RONt of ISO 12181-1 where it was re-centred."""
        return float(np.ptp(self.radial(np.linspace(0.0, 2 * math.pi, 3600, endpoint=False))))


def read_roundness(path: Path) -> tuple[Array, Array]:
    """Angles (rad) and radii (mm) from the CSV file `path` of rows angle_deg, radius_mm, (n,) each; 16 at least.

    A last point that closes the turn is left out. Raises `DriveError` with file and line for a row that is none.
    """
    angles, radii = read_polar(path, "measured roundness")
    require(len(angles) >= 16, f"measured roundness {path} has {counted(len(angles), 'point')}; at least 16 are needed")
    return angles, radii
