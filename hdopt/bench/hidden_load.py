"""Concealed physics of load, friction, play, heat and inertia."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.signal import cont2discrete, lfilter, lfilter_zi

from hdopt.bench import loops
from hdopt.bench.arrays import Array
from hdopt.bench.gears import CSF, Gear
from hdopt.bench.geometry import ARCMIN
from hdopt.bench.motion import TURN, Plan, Run
from hdopt.bench.signal_chain import Hidden, Parameter


@dataclass(frozen=True)
class Windup(Hidden):
    """Torsional compliance: the catalogue's three slopes, a cubic hardening spring, or one that varies with angle.

    The stiffness stays that of a drive of this size; the torque of the test is what scales.
    """

    variant: str
    stiffness: tuple[float, float, float]  # Nm/rad
    knee: tuple[float, float]  # Nm
    angle_share: float
    phase: float
    scale: float = 1.0
    id = "torsional_windup"
    needs = frozenset({"torque"})

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        kind = str(rng.choice(["three slopes", "cubic", "angle"], p=[0.5, 0.25, 0.25]))
        size = rng.uniform(0.75, 1.3)
        k1, k2, k3 = (size * k * rng.uniform(0.95, 1.05) for k in (3.1e4, 5.0e4, 5.7e4))
        t1, t2 = (t * rng.uniform(0.85, 1.15) for t in (14.0, 48.0))
        return cls(
            kind, (k1, k2, k3), (t1, t2), rng.uniform(0.15, 0.3) if kind == "angle" else 0.0, rng.uniform(0, TURN)
        )

    @property
    def torque_gain(self) -> float:
        return self.scale

    def lag(self, run: Run, ke: Array) -> Array | float:
        k1, k2, k3 = self.stiffness
        t1, t2 = self.knee
        if self.variant == "cubic":
            hardening = (k2 - k1) * (k1 / t1) ** 2
            twist = run.torque / k1
            for _ in range(30):
                twist = twist - (k1 * twist + hardening * twist**3 - run.torque) / (k1 + 3 * hardening * twist**2)
            return twist
        torque = np.array([0, t1, t2, t2 + 1e4])
        angle = np.cumsum([0, t1 / k1, (t2 - t1) / k2, 1e4 / k3])
        twist = np.sign(run.torque) * np.interp(np.abs(run.torque), torque, angle)
        result: Array | float = twist * (1 + self.angle_share * np.cos(2 * run.theta + self.phase))
        return result

    def truth_under(self, top_torque_nm: float) -> dict[str, Parameter]:
        """What a test that reached `top_torque_nm` shows of the curve."""
        k1, k2, k3 = self.stiffness
        slopes = self.variant == "three slopes"
        found = {"stiffness_1": Parameter(k1, "Nm/rad", self.variant != "cubic" or top_torque_nm < 0.2 * self.knee[0])}
        if slopes:
            found["stiffness_2"] = Parameter(k2, "Nm/rad", top_torque_nm > 1.7 * self.knee[0])
            found["stiffness_3"] = Parameter(k3, "Nm/rad", top_torque_nm > 1.7 * self.knee[1])
            found["knee_1"] = Parameter(self.knee[0], "Nm", top_torque_nm > 1.7 * self.knee[0])
            found["knee_2"] = Parameter(self.knee[1], "Nm", top_torque_nm > 1.7 * self.knee[1])
        return found

    def truth(self) -> dict[str, Parameter]:
        return self.truth_under(0.0)


@dataclass(frozen=True)
class Hysteresis(Hidden):
    """Pre-sliding friction: Jenkins elements in parallel (Maxwell slip), or a Bouc-Wen equation."""

    variant: str
    slip: tuple[float, ...]  # rad at the output, half of an element's reversal
    weight: tuple[float, ...]
    exponent: float
    beta: float
    scale: float = 1.0  # half loop, arcmin
    id = "hysteresis"
    needs = frozenset({"reversal"})

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        length = np.deg2rad(np.exp(rng.uniform(np.log(0.15), np.log(2.0))))
        if rng.random() < 0.5:
            slip = 0.5 * length * np.geomspace(0.2, rng.uniform(1.5, 3), rng.integers(5, 13))
            weight = rng.uniform(0.3, 1, slip.size)
            return cls("Maxwell slip", tuple(slip), tuple(weight / weight.sum()), 0.0, 0.0)
        return cls("Bouc-Wen", (0.7 * length,), (1.0,), rng.uniform(1, 2), rng.uniform(0.5, 0.9))

    def force(self, position: Array) -> Array:
        if self.variant == "Bouc-Wen":
            return loops.bouc_wen(position, self.slip[0], self.exponent, self.beta)
        return loops.maxwell_slip(position, np.array(self.slip), np.array(self.weight))

    def lag(self, run: Run, ke: Array) -> Array | float:
        return self.scale * ARCMIN * self.force(run.theta / run.ratio)

    def scale_for(self, rms: float, speed: float) -> float:
        """Scale that gives `rms` (rad) in a test back and forth."""
        return rms / ARCMIN

    def reversal_path(self, share: float) -> float:
        """Output angle (rad) from a reversal at full slip to `share` of the way to the other branch."""
        reach = 40 * max(self.slip)
        back = np.linspace(reach, -reach, 40001)
        path = self.force(np.concatenate([np.linspace(0, reach, 20001), back]))[20001:]
        done = (path[0] - path) / (path[0] - path[-1])
        return float(np.interp(share, done, reach - back))

    def truth(self) -> dict[str, Parameter]:
        return {
            "half_loop_arcmin": Parameter(self.scale, "arcmin"),
            "transition_deg": Parameter(np.rad2deg(self.reversal_path(0.9)), "deg"),
        }


@dataclass(frozen=True)
class LostMotion(Hidden):
    """Play between input and output: constant, or the two slots of an Oldham coupling (Jia 2021, Eq. (33))."""

    variant: str  # "constant" or "cross-slide"
    constant_share: float
    slot_mm: tuple[float, float]
    disc_mm: float
    offset_mm: float
    direction: float
    scale: float = 1.0  # mean full step, arcmin
    id = "lost_motion"
    needs = frozenset({"reversal"})

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        cross = rng.random() < 0.5
        slots = tuple(rng.uniform(5, 8, 2))
        return cls(
            "cross-slide" if cross else "constant",
            rng.uniform(0, 0.3) if cross else 1.0,
            slots,
            rng.uniform(12, 18),
            rng.uniform(0.05, 0.4),
            rng.uniform(0, TURN),
        )

    def scale_for(self, rms: float, speed: float) -> float:
        """Scale that gives `rms` (rad) in a test back and forth."""
        return 2 * rms / ARCMIN

    def slots(self, theta: Array) -> Array:
        """Sum of 1/r over both slots (1/mm)."""
        total = np.zeros(np.shape(theta))
        for slot, turn in zip(self.slot_mm, (np.cos, np.sin), strict=True):
            half = slot / 2
            run_out = np.abs(self.offset_mm * turn(self.direction - theta))
            total = total + 1 / np.sqrt((np.sqrt(self.disc_mm**2 - half**2) + run_out) ** 2 + half**2)
        return total

    def gap(self, theta: Array) -> Array:
        """Full width (rad at the output)."""
        mean = self.slots(TURN * np.arange(360) / 360).mean()
        share = self.constant_share
        result: Array = self.scale * ARCMIN * (share + (1 - share) * self.slots(theta) / mean)
        return result

    def lag(self, run: Run, ke: Array) -> Array | float:
        position = run.theta / run.ratio
        return position - loops.play(position, self.gap(run.theta))

    def truth(self) -> dict[str, Parameter]:
        return {"lost_motion_arcmin": Parameter(self.scale, "arcmin")}


@dataclass(frozen=True)
class ThermalDrift(Hidden):
    """Drift that follows the temperature of the body, a first-order lag behind its heating."""

    variant: str  # "logged" or "warm-up"
    coefficient: float  # arcmin/K per unit of scale
    time_constant_s: float = 1.0
    scale: float = 1.0
    id = "thermal_drift"

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        return cls(str(rng.choice(["logged", "warm-up"])), rng.choice([-1, 1]) * 0.02)

    @property
    def needs(self) -> frozenset[str]:
        return frozenset({"temperature" if self.variant == "logged" else "warm-up"})

    def for_plans(self, plans: Sequence[Plan]) -> Self:
        heat = plans[0].heat
        return self if heat is None else replace(self, time_constant_s=heat.time_constant_s)

    def lag(self, run: Run, ke: Array) -> Array | float:
        return self.scale * self.coefficient * ARCMIN * run.body_k

    def truth(self) -> dict[str, Parameter]:
        logged = self.variant == "logged"
        return {
            "coefficient_arcmin_per_k": Parameter(self.scale * self.coefficient, "arcmin/K", logged),
            "time_constant_s": Parameter(self.time_constant_s, "s", not logged),
        }


@dataclass(frozen=True)
class Resonance(Hidden):
    """The load's inertia on the drive's spring: a second-order equation driven by the error at the running speed, or,
    with `whole_motion`, by all of its foot's motion, input/N less the error: speed changes and starts swing it too.

    Its frequency comes down from far above the strongest order to the top of the speed range as it scales up.
    """

    damping: float
    to_ground: bool
    top_hz: float = 1.0  # order 2 at the highest speed
    whole_motion: bool = False
    scale: float = 0.1  # (order 2 / natural frequency) squared
    id = "resonance"
    variant = "torsional"
    needs = frozenset({"speeds", "fast"})
    scale_range = (2e-3, 1.0)

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        return cls(np.exp(rng.uniform(np.log(0.02), np.log(0.12))), bool(rng.random() < 0.5))

    def for_plans(self, plans: Sequence[Plan]) -> Self:
        return replace(self, top_hz=2 * max(rpm for plan in plans for _, rpm in plan.legs) / 60)

    @property
    def frequency_hz(self) -> float:
        return float(self.top_hz / np.sqrt(self.scale))

    def lag(self, run: Run, ke: Array) -> Array | float:
        w = TURN * self.frequency_hz
        damping = 2 * self.damping * w
        rising = [w * w] if self.to_ground else [damping, w * w]
        rise, fall, _ = cont2discrete((np.array(rising), np.array([1, damping, w * w])), run.step, method="foh")
        rise = np.ravel(rise)
        # The output is at -foot where the foot is at input/N - KE; counted like the error, from where it starts.
        foot = ke - (run.theta - run.theta[0]) / run.ratio if self.whole_motion else ke
        settled = lfilter_zi(rise, fall) * foot[0]
        result: Array | float = lfilter(rise, fall, foot, zi=settled)[0] - foot
        return result

    def truth(self) -> dict[str, Parameter]:
        return {
            "frequency_hz": Parameter(self.frequency_hz, "Hz"),
            "damping_ratio": Parameter(self.damping, "1", self.scale > 0.5),
        }
