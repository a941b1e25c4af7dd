"""What the records can carry at all: the bench's own judgement of whether hidden physics could be found and told apart.

It knows the noise, the true drive and the true conditions, and it is linear: hidden waves are projected off the base's
derivatives by its twelve errors, off a free mean for each recording and off the columns of a rival explanation. What is
left over, against the noise, says whether a perfect observer could decide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from hdopt.bench import loops
from hdopt.bench.arrays import Array
from hdopt.bench.geometry import (
    ERROR_BOUNDS,
    ERROR_STEPS,
    BaseErrors,
    base_teeth,
    find_zones,
    kinematic_error,
    zone_deviation_mm,
)
from hdopt.bench.hidden_load import Resonance
from hdopt.bench.motion import TURN, Plan
from hdopt.bench.signal_chain import Setup

# Evidence (a chi-square) from which on the records are said to decide: a search over some 300 one-column rivals passes
# 20 by chance about once in 500 records, and an observer who must estimate the noise needs a margin over that.
DECISIVE = 50.0
# The zone switch makes these physics nonlinear, so that even their own linear columns leave something of their waves. A
# rival that leaves hardly more holds those columns too, and counts as refuted by nothing.
ZONE_BOUND = ("cs_tooth_harmonics", "fs_tooth_harmonics", "circular_spline_lobing")
WORSE = 1.2
# Physics outside the catalogue must be foreign to it: no entry may explain most of it.
FOREIGN_SHARE = 0.25
SAMPLES = 4000

# Orders that bearings of 15 to 35 balls, ball/pitch 0.05 to 0.2, can have, in steps of STEP: cage, ball, races. Whole
# numbers are left out: a bearing that met one to a thousandth would be a coincidence, and no one would believe it.
STEP = 0.004
BEARING_ORDERS = np.concatenate([np.arange(low, high, STEP) for low, high in ((0.37, 0.62), (1.05, 1.23), (6.0, 21.4))])
BEARING_ORDERS = BEARING_ORDERS[np.abs(BEARING_ORDERS - np.round(BEARING_ORDERS)) > 0.02]
# Output encoders of 400 lines and more.
LINES = np.arange(400, 3001)


@dataclass(frozen=True)
class Evidence:
    """Chi-squares: of the hidden wave against the base alone, and of the wave against the best fit of each rival."""

    against_base: float
    against: dict[str, float]
    own: float
    least_share: float  # of the evidence that a refuted rival must leave

    @property
    def detectable(self) -> bool:
        return self.against_base > DECISIVE

    @property
    def floor(self) -> float:
        """Evidence below which a rival is not refuted."""
        return max(DECISIVE, WORSE * self.own, self.least_share * self.against_base)

    @property
    def rivals(self) -> tuple[str, ...]:
        """Catalogue entries that would explain the records as well as the truth."""
        return tuple(sorted(name for name, left in self.against.items() if left < self.floor))

    @property
    def margin(self) -> float:
        """Evidence against the closest rival, or against the base alone, in units of what decides."""
        return float(min(self.against_base / DECISIVE, *(left / self.floor for left in self.against.values())))


class Witness:
    """Samples of one case's recordings, the base's derivatives there, and the columns of every rival."""

    def __init__(self, setups: Sequence[Setup], plans: Sequence[Plan], rng: np.random.Generator) -> None:
        self.setups, self.plans, self.gear = setups, plans, setups[0].gear
        total = sum(s.run.time.size for s in setups)
        share = min(1.0, SAMPLES / total)
        self.pick = [
            np.sort(rng.choice(s.run.time.size, max(int(share * s.run.time.size), 1), replace=False)) for s in setups
        ]
        self.total = total
        theta = self.sampled(lambda s: s.run.theta)
        self.theta = theta
        self.rank = np.repeat(np.arange(len(setups)), [p.size for p in self.pick])
        self.errors = setups[0].errors
        # Structures that take an eccentricity away make its column zero.
        vector = self.errors.vector()
        here = self.error_of(vector, theta)
        slopes = [(self.error_of(vector + step, theta) - here) / step.max() for step in np.diag(ERROR_STEPS)]
        means = (self.rank[:, None] == np.arange(len(setups))).astype(float)
        self.base = orthonormal(np.column_stack([means, *slopes]))

    def sampled(self, values: Callable[[Setup], ArrayLike]) -> Array:
        return np.concatenate([np.asarray(values(s))[p] for s, p in zip(self.setups, self.pick, strict=True)])

    def error_of(self, vector: Array, theta: Array) -> Array:
        """Kinematic error (rad) at `theta` (rad) of this drive with the errors `vector` (12,)."""
        return kinematic_error(BaseErrors(*vector), theta, self.gear)

    def refit(self, wave: Array, turns: int = 4) -> float:
        """What the base, refitted to base + `wave` within its plausible errors, leaves of it (rad rms)."""
        theta, rank, wave = self.theta[::3], self.rank[::3], wave[::3]  # smooth, but for pulses: a third will do
        truth = self.error_of(self.errors.vector(), theta)
        target = truth + wave
        unit = ERROR_BOUNDS

        def left(x: Array) -> Array:
            residual = target - self.error_of(x * unit, theta)
            result: Array = (residual - (np.bincount(rank, residual) / np.bincount(rank))[rank]) / truth.std()
            return result

        start = self.errors.vector() / unit
        found = least_squares(left, start, bounds=(-1.5, 1.5), diff_step=np.full(start.size, 1e-3), max_nfev=turns)
        return float(np.sqrt(np.mean(found.fun**2)) * truth.std())

    def family(self, name: str) -> Array:
        """All linear columns of a catalogue entry, side by side (none where they are tried one at a time)."""
        candidates = [c for c in self.rivals().get(name, []) if not isinstance(c, OneOf)]
        return np.column_stack([c.reshape(self.theta.size, -1) for c in candidates] or [np.empty((self.theta.size, 0))])

    def weigh(
        self, wave: Array, own: str, noise_rms: float, effective_share: float, beside: Sequence[Array] = ()
    ) -> Evidence:
        """Evidence of a sampled hidden `wave` (rad) of entry `own` ("" outside the catalogue) beside other columns."""
        base = orthonormal(np.column_stack([self.base, *beside])) if beside else self.base
        wave = wave - base @ (base.T @ wave)
        per_square = self.total * effective_share / wave.size / noise_rms**2
        against = {}
        for name, candidates in self.rivals().items():
            against[name] = per_square * min(_left(base, rival, wave) for rival in candidates)
        # An encoder's line count and a bearing's geometry are free enough to meet each other's tones, and others'.
        if own in ("", "encoder_interpolation"):
            against["bearing_pass"] = per_square * _left_by_tone(base, self.theta, wave, BEARING_ORDERS, STEP)
        if own in ("", "bearing_pass"):
            by_lines = _left_by_tone(base, self.theta, wave, LINES / self.gear.ratio)
            against["encoder_interpolation"] = min(against["encoder_interpolation"], per_square * by_lines)
        return Evidence(
            float(per_square * wave @ wave),
            {name: left for name, left in against.items() if name != own},
            against[own] if own in ZONE_BOUND else 0.0,
            FOREIGN_SHARE if own == "" else 0.0,
        )

    def rivals(self) -> dict[str, list[Rival]]:
        if not hasattr(self, "_rivals"):
            self._rivals = self._columns()
        return self._rivals

    def _columns(self) -> dict[str, list[Rival]]:
        gear, theta, output = self.gear, self.theta, self.theta / self.gear.ratio
        zones = find_zones(self.errors, theta, gear)
        driving = zone_deviation_mm(zones, *base_teeth(self.errors, gear)).argmax(axis=0)
        cs = np.take_along_axis(zones.cs_angle, driving[None], 0)[0]
        fs = np.take_along_axis(zones.fs_angle, driving[None], 0)[0]
        rivals: dict[str, list[Rival]] = {
            "cs_tooth_harmonics": [waves(cs, range(2, 13))],
            "fs_tooth_harmonics": [waves(fs, range(2, 13))],
            "tooth_mesh": [waves(cs, [gear.cs_teeth, 2 * gear.cs_teeth])],
            "encoder_input_eccentricity": [waves(theta, [1])],
            "encoder_output_eccentricity": [waves(output, [1, 2])],
            "output_coupling": [waves(theta, [2]), waves(output, [2])],
            "encoder_interpolation": [waves(theta, [lines, 2 * lines]) for lines in (8, 12, 16, 20, 24, 32, 64)],
            "circular_spline_lobing": [waves(cs, [n]) for n in range(2, 13)],
            "local_tooth_defect": [pulses(cs, gear.cs_teeth), pulses(fs, gear.fs_teeth)],
        }
        if any(plan.torque is not None for plan in self.plans):
            torque = self.sampled(lambda s: s.run.torque)
            torque = torque / np.abs(torque).max()
            twice = waves(theta, [2])
            rivals["torsional_windup"] = [np.column_stack([torque, torque**3, torque[:, None] * twice])]
        speed = self.sampled(lambda s: s.run.speed)
        if np.ptp(np.sign(speed)) > 1:
            rivals["lost_motion"] = [self.sampled(lambda s: _play(s.run.theta / gear.ratio))]
            rivals["hysteresis"] = [self._loop(degrees) for degrees in (0.05, 0.1, 0.2, 0.4, 0.8, 1.6)]
        rivals["channel_delay"] = [speed]
        logged = any(plan.log_temperature for plan in self.plans)
        if logged:
            rivals["thermal_drift"] = [self.sampled(lambda s: s.run.body_k)]
        else:
            part = self.sampled(lambda s: s.run.time / s.run.time[-1])
            rivals["thermal_drift"] = [1 - np.exp(-part / tau) for tau in (0.1, 0.2, 0.4, 0.8, 1.6)]
        if len(self.setups) > 1:
            top = 2 * max(np.abs(s.run.speed).max() for s in self.setups) / TURN
            rivals["resonance"] = [
                self._swing(Resonance(z, False, top, scale=r)) for r in (0.02, 0.1, 0.3, 0.6, 0.9) for z in (0.03, 0.1)
            ]
        return rivals

    def _loop(self, degrees: float) -> Array:
        """Friction's loop whose transition takes so many `degrees` of the output."""
        length = np.deg2rad(degrees)
        return self.sampled(lambda s: loops.bouc_wen(s.run.theta / self.gear.ratio, length, 1.0, 0.5))

    def _swing(self, resonance: Resonance) -> Array:
        return self.sampled(lambda s: resonance.lag(s.run, self._ke(s)))

    def _ke(self, setup: Setup) -> Array:
        deviation = zone_deviation_mm(setup.zones, *base_teeth(setup.errors, setup.gear)).max(axis=0)
        result: Array = setup.gear.rad_per_mm(setup.run.theta) * deviation
        return result


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis of the columns' span, by way of their products: one large operation instead of hundreds."""
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    size, turn = np.linalg.eigh(columns.T @ columns)
    kept = size > 1e-9 * size[-1]
    result: Array = columns @ (turn[:, kept] / np.sqrt(size[kept]))
    return result


def waves(angle: Array, orders: Iterable[float]) -> Array:
    """Cosine and sine of each of `orders` (k) times `angle` (n,), rad: shape (n, 2 k), each cosine before its sine."""
    return np.column_stack([f(k * angle) for k in orders for f in (np.cos, np.sin)])


@dataclass(frozen=True)
class OneOf:
    """Columns to be tried one at a time, not together."""

    columns: Array


Rival: TypeAlias = Array | OneOf
"""What one explanation can make: columns (n, any) that act together, one column (n,), or columns of which one acts."""


def pulses(angle: Array, teeth: int) -> OneOf:
    """A pulse at each of so many `teeth`, falling to 0 within two pitches to either side, met at `angle` (n,), rad on
    the spline; one column a tooth."""
    place = (angle * teeth / TURN)[:, None] - np.arange(teeth)
    distance = np.abs((place + teeth / 2) % teeth - teeth / 2)
    return OneOf(np.clip(1 - distance / 2, 0, None))


def _left(base: Array, rival: Rival, wave: Array) -> float:
    """Sum of squares of `wave` (already off the base) that base and rival leave."""
    total = float(wave @ wave)
    columns = rival.columns if isinstance(rival, OneOf) else rival.reshape(wave.size, -1)
    columns = columns - base @ (base.T @ columns)
    if isinstance(rival, OneOf):
        size = (columns**2).sum(0)
        seen = size > 1e-9 * size.max()
        taken: float = ((columns.T @ wave)[seen] ** 2 / size[seen]).max(initial=0.0)
    else:
        taken = np.sum((orthonormal(columns).T @ wave) ** 2)
    return total - taken


def _left_by_tone(base: Array, theta: Array, wave: Array, orders: Array, within: float = 0.0) -> float:
    """Sum of squares that base and the best tone (with its octave) leave of `wave`: `orders`, or `within` of one."""

    def power(tried: Array, take: slice) -> Array:
        result: Array = np.abs(np.exp(-1j * np.outer(tried, theta[take])) @ wave[take])
        return result

    best = orders[np.argsort(power(orders, slice(None, None, 8)))[-5:]]
    if within:
        near = [order + within * np.linspace(-1, 1, 33) for order in best]
        best = np.array([tried[np.argmax(power(tried, slice(None)))] for tried in near])
    return min(_left(base, waves(theta, [order, 2 * order]), wave) for order in best)


def _play(position: Array) -> Array:
    gap = np.full(position.size, 1e-6)
    return (position - loops.play(position, gap)) / 1e-6
