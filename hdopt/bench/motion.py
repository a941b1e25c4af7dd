"""Test plans and what the motor, the load and the surroundings do in them, sample by sample."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from hdopt.bench.arrays import Array
from hdopt.bench.geometry import RATIO

TURN = 2 * np.pi

# A brief record: samples a turn where nothing needs more, and turns where something does.
BRIEF_SAMPLES, BRIEF_FINE_TURNS, BRIEF_DENSE_TURNS = 40, 24, 14
LONG_TURNS, LONG_SAMPLES = 100, 1000


@dataclass(frozen=True)
class Torque:
    """Load torque at the output: `shape` over time or output angle, in Nm."""

    shape: str  # "sweep", "pendulum" or "steps"
    amplitude_nm: float
    offset_nm: float
    period: float  # of a sweep or a pair of steps, in units of the record's duration
    phase: float


@dataclass(frozen=True)
class Heat:
    """Heating of the drive body, a first-order lag behind its power (K at rest); a record starts cold."""

    rise_k: float
    time_constant_s: float
    wave: float  # share of a slow cycle of the power
    wave_period_s: float


@dataclass(frozen=True)
class Plan:
    """One recording: strokes at set speeds, one leg after another, and what goes on meanwhile."""

    legs: tuple[tuple[float, float], ...]  # (input turns, r/min); turns < 0 run backward
    samples_per_turn: float  # at the highest speed of the record
    start: float  # input angle at the start, rad
    ramp_turns: float
    ripple: tuple[tuple[float, float, float], ...]  # (order, relative amplitude, phase)
    torque: Torque | None
    heat: Heat | None
    log_temperature: bool
    speed_steps: tuple[float, ...] = ()  # shares of the set speed, one after another


@dataclass(frozen=True)
class Run:
    """True state of the bench at the sampling instants (s, rad, rad/s, Nm, K)."""

    time: Array
    theta: Array
    speed: Array
    torque: Array
    body_k: Array
    ratio: float = RATIO

    @property
    def step(self) -> float:
        result: float = (self.time[-1] - self.time[0]) / (self.time.size - 1)
        return result


def run(plan: Plan, jitter: float, rng: np.random.Generator, ratio: float = RATIO) -> Run:
    """Drive one `plan` of a gear of `ratio`; chance comes from `rng`.

    `jitter` is the clock's random error in units of the sampling step, equal for both channels.
    """
    top = max(rpm for _, rpm in plan.legs) * TURN / 60
    step = TURN / top / plan.samples_per_turn
    speed: Array = np.concatenate([_leg(turns, rpm, plan.ramp_turns, step) for turns, rpm in plan.legs])
    speed = speed * _stepped(plan.speed_steps, speed.size)
    nominal = _integral(speed, step)
    ripple = sum(a * np.cos(order * nominal + phase) for order, a, phase in plan.ripple)
    speed = speed * (1 + ripple)
    theta = plan.start + _integral(speed, step)
    time: Array = np.asarray(np.arange(speed.size) * step, float)
    error = jitter * step * np.clip(rng.standard_normal(speed.size), -3, 3)
    theta = theta + error * (speed + 0.5 * error * np.gradient(speed, step))
    return Run(time, theta, speed, _torque(plan, time, theta / ratio), _body(plan, time), ratio)


def _stepped(levels: tuple[float, ...], samples: int) -> Array | float:
    """Share of the set speed at every sample: `levels` of equal length, each reached within a fortieth of it."""
    if not levels:
        return 1.0
    place = np.linspace(0, len(levels), samples)
    edges = np.repeat(np.arange(1, len(levels)), 2) + np.tile([-0.0125, 0.0125], len(levels) - 1)
    result: Array | float = np.interp(place, edges, np.repeat(levels, 2)[1:-1])
    return result


def _leg(turns: float, rpm: float, ramp_turns: float, step: float) -> Array:
    """Trapezoid of speed (rad/s): ramp, constant, ramp."""
    top = rpm * TURN / 60
    ramp = 2 * ramp_turns * TURN / top
    hold = max(abs(turns) * TURN / top - ramp, 0)
    t = np.arange(round((hold + 2 * ramp) / step) + 1) * step
    result: Array = np.sign(turns) * top * np.clip(np.minimum(t, hold + 2 * ramp - t) / ramp, 0, 1)
    return result


def _integral(values: Array, step: float) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))]) * step


def _torque(plan: Plan, time: Array, output: Array) -> Array:
    load = plan.torque
    if load is None:
        return np.zeros_like(time)
    cycles = time / (load.period * time[-1]) + load.phase / TURN
    if load.shape == "sweep":
        wave = 4 * np.abs(cycles % 1 - 0.5) - 1
    elif load.shape == "pendulum":
        wave = np.sin(output + load.phase)
    else:
        levels = np.random.default_rng(int(1e6 * load.phase)).uniform(-1, 1, int(cycles[-1] * 2) + 3)
        rank = np.floor(2 * cycles).astype(int)
        blend = np.clip((2 * cycles - rank) * 20, 0, 1)
        wave = levels[rank] * (1 - blend) + levels[rank + 1] * blend
    result: Array = load.offset_nm + load.amplitude_nm * wave
    return result


def _body(plan: Plan, time: Array) -> Array:
    heat = plan.heat
    if heat is None:
        return np.zeros_like(time)
    power = heat.rise_k * (1 + heat.wave * np.sin(TURN * time / heat.wave_period_s))
    keep = np.exp(-(time[1] - time[0]) / heat.time_constant_s)
    return lfilter([1 - keep], [1, -keep], power)


def _draw_samples_per_turn(rng: np.random.Generator, needs: Set[str], size: str, several: bool, ratio: float) -> float:
    teeth = max(1.0, ratio / RATIO)  # more teeth a turn than the shipped drive's take more samples
    if "dense" in needs:
        return rng.uniform(390, 420) * teeth
    if "fine" in needs:
        return rng.uniform(230, 300) * teeth
    samples = rng.uniform(100, 120 if several or size == "small" else 200)
    return {"brief": BRIEF_SAMPLES, "long": LONG_SAMPLES}.get(size, samples)


def draw_plans(
    rng: np.random.Generator,
    needs: Set[str] = frozenset(),
    size: str = "full",
    ratio: float = RATIO,
    turns: float = 0.0,
) -> tuple[Plan, ...]:
    """Plans (a tuple, one a recording) of one case, drawn by `rng`; of `turns` input turns, where these are given.

    `needs` is what the physics demands of the record; everything else is drawn at random.

    needs: "reversal", "speeds" (several, with reversals), "fast", "torque", "warm-up" (constant power), "temperature"
    (logged), "dense" (400 samples a turn), "fine" (220 or more), "one way" (no reversal, one speed).
    size: "full" (at least one output turn of a gear of `ratio` forward), "short" (8 to 20 turns), "small" (for cases in
    large numbers), "brief" (few rows, for tests that answer many cases) or "long" (100 turns of 1000 samples).
    """
    closely = bool({"dense", "fine"} & needs)  # many samples a turn leave room for fewer turns
    several = "speeds" in needs or (rng.random() < 0.2 and not {"one way", "dense"} & needs)
    reversal = several or "reversal" in needs or (rng.random() < 0.5 and "one way" not in needs)
    if "fast" in needs or rng.random() < 0.2:
        rpm = np.exp(rng.uniform(np.log(150), np.log(700)))
    else:
        rpm = np.exp(rng.uniform(np.log(5), np.log(120)))
    if several:
        rpms = rpm * np.array([1.0, rng.uniform(0.55, 0.8), rng.uniform(0.3, 0.45)])
        rpms = rpms[: 3 if "fast" in needs else 2 if closely else rng.integers(2, 4)]
    else:
        rpms = np.array([rpm])
    drawn = {
        "full": rng.uniform(42, 44 if closely else 60) if several else rng.uniform(80, 85 if closely else 120),
        "small": rng.uniform(40, 46) if several else rng.uniform(80, 90),
        "short": rng.uniform(8, 20),
        "brief": BRIEF_DENSE_TURNS if "dense" in needs else BRIEF_FINE_TURNS if closely else 30 if several else 82,
        "long": LONG_TURNS,
    }[size]
    samples = _draw_samples_per_turn(rng, needs, size, several, ratio)
    turns = turns or (drawn * ratio / RATIO if size in ("full", "small") else drawn)
    if reversal and not several:
        turns *= 0.75 if size == "full" else 0.6
    ramp = rng.uniform(0.1, 0.4)
    start = rng.uniform(0, TURN)
    legs = [_draw_legs(rng, turns, speed, reversal) for speed in rpms]
    longest_s = max(sum(abs(t) / r for t, r in strokes) for strokes in legs) * 60
    heat, logged = _draw_heat(rng, needs, size, longest_s)
    loaded = "torque" in needs or rng.random() < 0.3
    plans = []
    for strokes in legs:
        plans.append(
            Plan(
                legs=strokes,
                samples_per_turn=samples,
                start=start + TURN * rng.uniform(-1, 1),
                ramp_turns=ramp,
                ripple=draw_ripple(rng, rng.uniform(0.002, 0.02)),
                torque=_draw_torque(rng) if loaded else None,
                heat=heat,
                log_temperature=logged,
            )
        )
    return tuple(plans)


def _draw_legs(rng: np.random.Generator, turns: float, rpm: float, reversal: bool) -> tuple[tuple[float, float], ...]:
    legs = [(turns, rpm)]
    if reversal:
        if rng.random() < 0.5:  # short strokes first: more reversals to look at
            stroke = rng.uniform(1.5, 5)
            legs = [(stroke, rpm), (-stroke, rpm)] * rng.integers(1, 4) + legs
        legs.append((-turns, rpm))
    sign = rng.choice([-1, 1])
    return tuple((sign * t, r) for t, r in legs)


def draw_ripple(rng: np.random.Generator, size: float) -> tuple[tuple[float, float, float], ...]:
    """Ripple of the motor's speed, drawn by `rng`: (order, relative amplitude, phase) of the orders 1, 2 and 6, the
    amplitudes up to `size` and falling with the root of the order."""
    return tuple((k, size * rng.uniform(0.2, 1) / np.sqrt(k), rng.uniform(0, TURN)) for k in (1, 2, 6))


def _draw_torque(rng: np.random.Generator) -> Torque:
    shape = rng.choice(["sweep", "pendulum", "steps"])
    period = rng.uniform(0.07, 0.3)
    return Torque(str(shape), rng.uniform(2, 30), rng.uniform(-0.3, 0.3), period, rng.uniform(0, TURN))


def _draw_heat(rng: np.random.Generator, needs: Set[str], size: str, longest_s: float) -> tuple[Heat | None, bool]:
    constant = "warm-up" in needs
    if constant or "temperature" in needs:
        logged = not constant
    elif rng.random() < 0.3 and size != "short":
        logged = True
    else:
        return None, False
    wave = 0.0 if constant else rng.uniform(0.3, 1.2)
    lag, period = longest_s * rng.uniform(0.15, 0.5), longest_s * rng.uniform(0.25, 0.7)
    return Heat(rng.uniform(3, 15), lag, wave, period), logged
