"""A deviation that stands on a spline, as a function of the angle of that spline at which a meshing zone meets it.

The deepest point of a zone lies off its end of the major axis, by o seen from the circular spline's centre and by o' in
the wave generator's frame (Jia 2021, Eqs. (16)-(23)). So zone 1 meets the circular spline at theta + o and zone 2 at
theta + pi - o, the flexspline at Z_CS/Z_FS theta with o' in place of o (Eqs. (31a), (31b)). With errors as shipped o is
up to a few hundredths of a radian, h of it in phase for a deviation of h waves: no expansion in o would do for narrow
pulses or for the waves of single teeth, so that the deviation is taken at the angle itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array, Index
from hdopt.effects._sine_cosine import sine_cosine
from hdopt.effects.sines import sine_columns, sine_sum
from hdopt.late import late


class Spline(IntEnum):
    """The spline that a deviation stands on; its value is the place in arrays of both."""

    CIRCULAR = 0
    FLEX = 1


class Met(Protocol):
    """A deviation of p coefficients on a `spline`, mm of arc per coefficient, at angles of the spline."""

    @property
    def spline(self) -> Spline:
        """The spline that it stands on."""

    @property
    def width(self) -> int:
        """Number of coefficients, p."""

    def columns(self, angle: Array, zone: ArrayLike) -> Array:
        """What zone `zone` (0 or 1, one for all or (n,)) meets at `angle` (n,) rad, (n, p)."""

    def added(self, angle: Array, zone: int, coefficients: Array) -> tuple[Array, Array]:
        """The sum of the columns with these `coefficients` (p,) at `angle` (n,) rad in `zone`, mm of arc, and its slope
        over the angle, mm/rad, (n,) each."""


@dataclass(frozen=True)
class Waves:
    """sin and cos of each of `harmonics` round a `spline`."""

    spline: Spline
    harmonics: tuple[int, ...]

    @property
    def width(self) -> int:
        return 2 * len(self.harmonics)

    def columns(self, angle: Array, zone: ArrayLike) -> Array:
        return sine_columns(angle, self.harmonics)

    def added(self, angle: Array, zone: int, coefficients: Array) -> tuple[Array, Array]:
        return sine_sum(angle, self.harmonics, coefficients)


@dataclass(frozen=True)
class ZoneWaves:
    """sin and cos of each of `orders` on a `spline`, in zone 1 and, with coefficients of their own, in zone 2, each
    counted from the zone's own end of the major axis."""

    spline: Spline
    orders: tuple[float, ...]

    @property
    def width(self) -> int:
        return 4 * len(self.orders)

    def columns(self, angle: Array, zone: ArrayLike) -> Array:
        second = np.broadcast_to(np.asarray(zone), np.shape(angle))
        waves = sine_columns(angle - math.pi * second, self.orders)
        return np.hstack([waves * (second == 0)[:, None], waves * (second == 1)[:, None]])

    def added(self, angle: Array, zone: int, coefficients: Array) -> tuple[Array, Array]:
        half = self.width // 2
        return sine_sum(angle - math.pi * zone, self.orders, coefficients[half * zone : half * (zone + 1)])


@dataclass(frozen=True)
class Pulse:
    """A Gaussian of standard deviation `sigma` (rad) about `centre` (rad), once round a `spline`; its mean over a `row`
    (rad) where samples were averaged over so much of a turn, a part of it that is not small beside a tooth."""

    spline: Spline
    centre: float
    sigma: float
    row: float = 0.0

    @property
    def width(self) -> int:
        return 1

    def columns(self, angle: Array, zone: ArrayLike) -> Array:
        return gaussian(off_centre(angle, self.centre, 2 * math.pi), self.sigma, self.row)[:, None]

    def added(self, angle: Array, zone: int, coefficients: Array) -> tuple[Array, Array]:
        off = off_centre(angle, self.centre, 2 * math.pi)
        value = coefficients[0] * gaussian(off, self.sigma, self.row)
        if not self.row:
            return value, -off / self.sigma**2 * value
        before, after = (gaussian(off + side * self.row / 2, self.sigma) for side in (-1, 1))
        return value, coefficients[0] * (after - before) / self.row


@dataclass(frozen=True)
class ToothForms:
    """The form of each flank of a `spline` within its own pitch, h ((1 - cos p)/2 + s sin p) with p from 0 to 2 pi over
    the tooth: nothing where a tooth ends, so that neighbours of different heights meet.

    `heights` (teeth, q) mm of arc, of each tooth per coefficient; `skew`, s; `start`, where tooth 0 begins, in pitches
    from the angle 0 of the spline.
    """

    spline: Spline
    heights: Array
    skew: float = 0.0
    start: float = 0.0

    @property
    def width(self) -> int:
        return int(self.heights.shape[1])

    def columns(self, angle: Array, zone: ArrayLike) -> Array:
        tooth, form = self.places(angle)
        return np.asarray(self.heights[tooth] * form[:, None])

    def places(self, angle: Array) -> tuple[Index, Array]:
        """Number of the tooth that is met at `angle` (n,) rad, and the form there of a tooth of height 1, (n,)."""
        return _forms_at(np.ascontiguousarray(angle), len(self.heights), self.skew, self.start)

    def added(self, angle: Array, zone: int, coefficients: Array) -> tuple[Array, Array]:
        return _forms_sum(np.ascontiguousarray(angle), self.heights @ coefficients, self.skew, self.start)


@late(calls=0)
def _place(angle: float, teeth: int, start: float) -> tuple[int, float]:
    """Number of the tooth that is met at an `angle` (rad), and how far over it, 0 to 2 pi."""
    place = angle * (teeth / (2 * math.pi)) - start
    whole = math.floor(place)
    return int(whole) % teeth, 2 * math.pi * (place - whole)


@late(calls=0)
def _forms_at(angle: Array, teeth: int, skew: float, start: float) -> tuple[Index, Array]:
    """`ToothForms.places` of so many `teeth`."""
    tooth, form = np.empty(len(angle), np.int64), np.empty(len(angle))
    for i in range(len(angle)):
        tooth[i], part = _place(angle[i], teeth, start)
        sine, cosine = sine_cosine(part)
        form[i] = (1 - cosine) / 2 + skew * sine
    return tooth, form


@late(calls=0)
def _forms_sum(angle: Array, heights: Array, skew: float, start: float) -> tuple[Array, Array]:
    """`ToothForms.added` of teeth of these `heights` (teeth,)."""
    value, slope = np.empty(len(angle)), np.empty(len(angle))
    teeth = len(heights)
    for i in range(len(angle)):  # In two loops, of which the second is worked out side by side.
        tooth, part = _place(angle[i], teeth, start)
        value[i], slope[i] = part, heights[tooth]
    for i in range(len(angle)):
        height = slope[i]
        sine, cosine = sine_cosine(value[i])
        value[i] = height * ((1 - cosine) / 2 + skew * sine)
        slope[i] = height * teeth * (sine / 2 + skew * cosine)
    return value, slope


def gaussian(off: Array, sigma: float, row: float = 0.0) -> Array:
    """exp(-off^2 / (2 sigma^2)) at distances `off` (n,) from the middle, or its mean over a length `row` about each;
    all rad, (n,)."""
    values: Array = _gaussian(np.ascontiguousarray(off), sigma, row)
    return values


FARTHEST = 9.0
"""Standard deviations from the middle beyond which a Gaussian is nothing: it is less than 3e-18 there."""


@late(calls=0)
def _gaussian(off: Array, sigma: float, row: float) -> Array:
    """`gaussian`; most of a turn's rows lie far from a narrow pulse, and cost no exponential."""
    values = np.zeros(len(off))
    reach, scale = FARTHEST * sigma + row / 2, 1 / (math.sqrt(2.0) * sigma)
    for i in range(len(off)):
        if abs(off[i]) > reach:
            continue
        if row:
            area = math.erf((off[i] + row / 2) * scale) - math.erf((off[i] - row / 2) * scale)
            values[i] = math.sqrt(math.pi) / (2 * scale * row) * area
        else:
            values[i] = math.exp(-((off[i] * scale) ** 2))
    return values


def off_centre(angle: Array, centre: float, period: float) -> Array:
    """How far `angle` (n,) lies from the nearest repetition of `centre`, in a `period`; all rad, (n,)."""
    apart = angle - centre
    off: Array = apart - period * np.rint(apart / period)
    return off


def met_angles(theta: Array, advance: float, beyond: Array) -> Array:
    """Angles of both splines at which both zones meet them at input angles `theta` (n,), rad, (2, 2, n): first the
    spline, then the zone.

    `advance` is Z_CS/Z_FS; `beyond` (2, 2, n), rad, how far the deepest point lies beyond the zone's end of the major
    axis the way the wave generator turns, o and o' with the zone's sign.
    """
    return met_at(np.stack([theta, advance * theta]), beyond)


def met_at(turned: Array, beyond: Array) -> Array:
    """`met_angles`, with `beyond` as there, where the input and the flexspline's teeth have `turned` (2, n), rad."""
    angles: Array = turned[:, None, :] + beyond + np.array([0.0, math.pi])[:, None]
    return angles


def sum_of(found: Sequence[tuple[Met, Array]], angles: Array) -> tuple[Array, Array]:
    """What the zones meet of all `found`, deviations with their coefficients: the sum in both zones, mm of arc, (2, n),
    and its slopes over the angle of each spline, mm/rad, (2, 2, n). `angles` as `met_angles` gives them."""
    total, slopes = np.zeros(angles.shape[1:]), np.zeros(angles.shape)
    for met, coefficients in found:
        for zone in (0, 1):
            value, slope = met.added(angles[met.spline, zone], zone, coefficients)
            total[zone] += value
            slopes[met.spline, zone] += slope
    return total, slopes
