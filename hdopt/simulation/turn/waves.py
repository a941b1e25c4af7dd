"""The waves of a ripple that both zones share: where each is least and where it is greatest, once for all drives.

Between two crests of such a ripple what else a drive makes is nearly a straight line, so that the least is near the
trough. What a wave may hold is then told from one place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Singles
from hdopt.kinematics.lanes.single import single, singles

OCTAVE = 2
"""The highest order of a ripple over its lowest, from where on its waves no longer stand for themselves."""
PER_PERIOD = 32
"""Places in a period of the highest order at which troughs and crests are looked for: seen from the nearest, a sine's
slope over its curvature is off by (pi/32)^3/3 of a radian of it."""
ALIKE = 1e-7
"""arcmin by which a ripple may differ in the zones and still be the same in both: rounding."""
WEAKEST = 1.0
"""Slope of a ripple, arcmin/rad, below which waves are not taken one by one: the base of most drives as shipped, up to
some 0.6, would be too steep for them (`places.STEEP`)."""
FAINT = 1e-9
"""Amplitudes below this share of the largest are rounding."""


class Places(NamedTuple):
    """Troughs or crests of a ripple, k of them: the input angle in turns between -1/2 and 1/2, its cosine and sine,
    (k,). `met` (k, 4): what all effects add there in zones 1 and 2, mm of arc, and the slope of what stands on the CS,
    mm/rad. The size of the ripple's curvature, mm/rad^2, (k,)."""

    turns: Singles
    cos: Singles
    sin: Singles
    met: Singles
    bend: Singles


class Waves(NamedTuple):
    """The waves of a ripple that both zones share, none where there is no such ripple: troughs, crests, the largest
    slope of what else the effects are, mm of arc/rad, the longest wave over 2 pi, rad, and the least of both zones on
    the CS over its whole turn less half its range, mm of arc."""

    troughs: Places
    crests: Places
    slope: float
    radian: float
    on_cs: float


def waves_of(fixed: Array, on_cs: Array, highest: int, per_mm: float) -> Waves:
    """The waves of what of the spectrum `fixed`, (2, orders), is above the order `highest`; none where zones differ in
    it, where the spectrum `on_cs` has such orders or where those span an octave. `per_mm` is arcmin per mm of arc."""
    slow_cs, beyond = on_cs[:, : highest + 1], on_cs[:, highest + 1 :]
    fixed = np.where(np.abs(fixed) > FAINT * np.abs(fixed).max(), fixed, 0.0)
    fast: Array = fixed.copy()
    fast[:, : highest + 1] = 0.0
    orders = np.flatnonzero(np.abs(fast).max(axis=0))
    apart = max(float(np.abs(fast[0] - fast[1]).sum()), float(np.abs(beyond).sum()))
    if not orders.size or apart * per_mm > ALIKE or orders[-1] >= OCTAVE * orders[0]:
        return NO_WAVES
    troughs, crests = (_places(sign * fast[:1, : orders[-1] + 1], fixed, slow_cs) for sign in (1.0, -1.0))
    bends, radian = np.concatenate([troughs.bend, crests.bend]), 1 / float(orders[0])
    if bends.min() <= 0 or bends.max() * radian * per_mm < WEAKEST:
        return NO_WAVES
    around = _at(slow_cs, _grid(PER_PERIOD * slow_cs.shape[1]), 0)
    return Waves(
        troughs,
        crests,
        slope=single(_steepest(fixed - fast) + _steepest(slow_cs)),
        radian=single(radian),
        on_cs=single(float(around.min() - np.ptp(around) / 2)),
    )


def _steepest(spectrum: Array) -> float:
    """A bound of the slope of the function of a `spectrum` in both zones, per rad."""
    return float((2 * np.abs(spectrum) * np.arange(spectrum.shape[1])).sum(axis=1).max())


def _places(fast: Array, fixed: Array, on_cs: Array) -> Places:
    """Where the function of the spectrum `fast` (1, orders) is least, wave by wave, with what all effects are there."""
    grid = _grid(PER_PERIOD * (fast.shape[1] - 1))
    value, slope, bend = (_at(fast, grid, times)[0] for times in range(3))
    least = np.flatnonzero((value < np.roll(value, 1)) & (value <= np.roll(value, -1)))
    angle = grid[least] - np.clip(slope[least] / bend[least], -grid[1], grid[1])
    turns = angle / (2 * math.pi)
    met = np.concatenate([_at(fixed, angle, 0) + _at(on_cs, angle, 0), _at(on_cs, angle, 1)])
    return Places(
        singles(turns - np.floor(turns + 0.5)),
        singles(np.cos(angle)),
        singles(np.sin(angle)),
        singles(met.T),
        singles(_at(fast, angle, 2)[0]),
    )


def _grid(places: int) -> Array:
    """So many even places of a turn, rad."""
    return np.asarray(np.arange(places) * (2 * math.pi / places))


def _at(spectrum: Array, angle: Array, times: int) -> Array:
    """The functions of a `spectrum` (z, orders), or so many `times` their derivatives, at angles (k,), rad: (z, k)."""
    orders = np.flatnonzero(np.abs(spectrum).max(axis=0))
    weights = np.where(orders > 0, 2.0, 1.0) * (1j * orders) ** times
    return np.asarray((spectrum[:, orders] * weights @ np.exp(1j * orders[:, None] * angle)).real)


_NONE: Singles = np.zeros(0, np.float32)
NO_PLACES = Places(_NONE, _NONE, _NONE, np.zeros((0, 4), np.float32), _NONE)
NO_WAVES = Waves(NO_PLACES, NO_PLACES, single(0.0), single(0.0), single(0.0))
"""Where no ripple is the same in both zones."""
