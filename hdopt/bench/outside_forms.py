"""Forms of physics beyond the catalogue, in families; their parameters are drawn anew for every case.

A form gives a wave (about one in size) over a run: `machine` draws what belongs to the machine and is the same in every
recording of a case, `chance` what differs between them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from hdopt.bench.arrays import Array
from hdopt.bench.motion import TURN, Run

Chance: TypeAlias = np.random.Generator

# Orders that no bearing of a plausible size (ball/pitch 0.05-0.2), no encoder and no tooth has.
FOREIGN_ORDERS = ((0.17, 0.35), (0.66, 0.94), (1.28, 1.9), (2.08, 2.92), (3.08, 3.92), (5.1, 5.9))


def foreign_order(rng: Chance, ratio: float = 80.0) -> float:
    """An order (cycles a turn of the input) that nothing of a drive of `ratio` has, drawn by `rng`."""
    low, high = FOREIGN_ORDERS[rng.integers(len(FOREIGN_ORDERS))]
    order = float(rng.uniform(low, high))
    while abs(order * ratio - round(order * ratio)) < 0.35:  # not a multiple of the output's turn either
        order = float(rng.uniform(low, high))
    return order


@dataclass(frozen=True)
class Scene:
    """What a form sees of one recording: the `run`, the drive's own error `ke` (rad), turns a second at full speed."""

    run: Run
    ke: Array
    turn_hz: float

    @property
    def speed(self) -> Array:
        return self.run.speed / (TURN * self.turn_hz)

    @property
    def torque(self) -> Array:
        result: Array = self.run.torque / max(np.abs(self.run.torque).max(), 1e-12)
        return result

    @property
    def part(self) -> Array:
        result: Array = self.run.time / self.run.time[-1]
        return result

    @property
    def travel(self) -> Array:
        """Input turns travelled, whatever the direction."""
        return np.concatenate([[0], np.cumsum(np.abs(np.diff(self.run.theta)))]) / TURN

    @property
    def error(self) -> Array:
        result: Array = (self.ke - self.ke.mean()) / self.ke.std()
        return result

    def order(self, rng: Chance) -> Array:
        """A cosine of an order that nothing of the drive has."""
        return np.cos(foreign_order(rng, self.run.ratio) * self.run.theta + rng.uniform(0, TURN))

    def since_reversal(self) -> tuple[Array, Array]:
        """Seconds since the direction changed last, and the direction."""
        way = np.sign(self.run.speed)
        way = np.where(way == 0, np.nan, way)
        last = np.maximum.accumulate(np.where(np.isnan(way), 0, np.arange(way.size)))
        way = np.nan_to_num(way[last], nan=1.0)
        begun = np.maximum.accumulate(np.where(np.r_[True, way[1:] != way[:-1]], np.arange(way.size), 0))
        return self.run.time - self.run.time[begun], way


Wave: TypeAlias = Callable[[Scene, Chance, Chance], Array]
"""A wave (n,) over a scene, from what is drawn for the machine and what is chance."""


@dataclass(frozen=True)
class Form:
    """A form of physics: its `family`, its `wave(scene, machine, chance)`, what it `needs` of a record."""

    family: str
    wave: Wave
    needs: frozenset[str] = field(default_factory=frozenset)


FORMS: dict[str, Form] = {}


def form(family: str, *needs: str) -> Callable[[Wave], Wave]:
    """Register a function as a form of `family`; `needs` as in `motion.draw_plans`."""

    def register(wave: Wave) -> Wave:
        FORMS[wave.__name__.strip("_").replace("_", " ")] = Form(family, wave, frozenset(needs))
        return wave

    return register


def _pulse(distance: Array, width: float) -> Array:
    return np.exp(-0.5 * (distance / width) ** 2)


def _wrapped(angle: Array) -> Array:
    return (angle + np.pi) % TURN - np.pi


# Powers of speed, torque, time and travel.


@form("power", "speeds")
def _drag_by_a_root_of_speed(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.sign(scene.speed) * np.abs(scene.speed) ** machine.uniform(0.35, 0.65)


@form("power", "speeds")
def _drag_by_a_power_of_speed(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.sign(scene.speed) * np.abs(scene.speed) ** machine.uniform(1.7, 3.5)


@form("power", "speeds")
def _lift_by_speed(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.abs(scene.speed) ** machine.uniform(0.7, 2.5)


@form("power", "torque")
def _size_of_torque(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.abs(scene.torque) ** machine.uniform(0.7, 3.0)


@form("power", "torque")
def _torque_above_a_threshold(scene: Scene, machine: Chance, chance: Chance) -> Array:
    limit = machine.uniform(0.2, 0.7)
    return np.clip(scene.torque - limit, 0, None) / (1 - limit)


@form("power")
def _power_of_time(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.part ** machine.uniform(1.5, 5.0)


@form("power")
def _power_of_travel(scene: Scene, machine: Chance, chance: Chance) -> Array:
    result: Array = (scene.travel / scene.travel[-1]) ** machine.uniform(1.5, 5.0)
    return result


# Products of conditions, and of conditions with orders.


@form("product", "torque", "speeds")
def _torque_times_speed(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.torque * scene.speed


@form("product", "torque")
def _torque_times_an_order(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.torque * scene.order(machine)


@form("product", "speeds")
def _speed_times_an_order(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.speed ** machine.integers(1, 3) * scene.order(machine)


@form("product")
def _time_times_an_order(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.part ** machine.uniform(0.5, 2) * np.cos(machine.integers(3, 9) * scene.run.theta)


@form("product", "temperature")
def _heat_times_an_order(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.run.body_k / max(np.ptp(scene.run.body_k), 1e-9) * scene.order(machine)


@form("product")
def _two_orders_multiplied(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.order(machine) * scene.order(machine)


@form("product", "reversal")
def _an_order_in_one_direction(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return (scene.run.speed < 0) * scene.order(machine)


# Modulations.


@form("modulation")
def _amplitude_modulation(scene: Scene, machine: Chance, chance: Chance) -> Array:
    slow = np.cos(machine.uniform(0.02, 0.15) * scene.run.theta + machine.uniform(0, TURN))
    return (1 + machine.uniform(0.6, 1.5) * slow) * scene.order(machine)


@form("modulation")
def _phase_modulation(scene: Scene, machine: Chance, chance: Chance) -> Array:
    bend = machine.uniform(1, 4) * np.sin(machine.uniform(0.02, 0.15) * scene.run.theta)
    return np.cos(foreign_order(machine, scene.run.ratio) * scene.run.theta + bend)


@form("modulation")
def _order_that_rises(scene: Scene, machine: Chance, chance: Chance) -> Array:
    turns = (scene.run.theta - scene.run.theta.min()) / np.ptp(scene.run.theta)
    result: Array = np.cos(
        foreign_order(machine, scene.run.ratio) * scene.run.theta * (1 + machine.uniform(0.05, 0.3) * turns)
    )
    return result


@form("modulation")
def _frequency_modulation(scene: Scene, machine: Chance, chance: Chance) -> Array:
    hz = machine.uniform(0.6, 3.4) * scene.turn_hz
    slow = machine.uniform(1, 5) * np.sin(TURN * machine.uniform(2, 9) * scene.part)
    return np.cos(TURN * hz * scene.run.time + slow + chance.uniform(0, TURN))


@form("modulation")
def _beat_of_two_fans(scene: Scene, machine: Chance, chance: Chance) -> Array:
    hz = machine.uniform(0.6, 3.4) * scene.turn_hz
    other = hz * machine.uniform(1.005, 1.06)
    return np.cos(TURN * hz * scene.run.time + chance.uniform(0, TURN)) + np.cos(TURN * other * scene.run.time)


@form("modulation")
def _order_that_comes_and_goes(scene: Scene, machine: Chance, chance: Chance) -> Array:
    begin, end = np.sort(chance.uniform(0.1, 0.9, 2))
    result: Array = ((scene.part > begin) & (scene.part < end + 0.1)) * scene.order(machine)
    return result


# Pulses that wander, that are missing, that keep no pitch.


@form("pulse", "fine")
def _wandering_pulse(scene: Scene, machine: Chance, chance: Chance) -> Array:
    at = scene.run.theta * (1 + machine.choice([-1, 1]) * machine.uniform(0.02, 0.08)) + machine.uniform(0, TURN)
    return _pulse(_wrapped(at), machine.uniform(0.05, 0.2))


@form("pulse", "fine")
def _missing_pulses(scene: Scene, machine: Chance, chance: Chance) -> Array:
    width, at = machine.uniform(0.05, 0.2), machine.uniform(0, TURN)
    turn = np.floor((scene.run.theta - at + np.pi) / TURN).astype(int)
    there = chance.random(np.ptp(turn) + 1) < machine.uniform(0.2, 0.6)
    result: Array = there[turn - turn.min()] * _pulse(_wrapped(scene.run.theta - at), width)
    return result


@form("pulse", "fine")
def _pulses_of_random_height(scene: Scene, machine: Chance, chance: Chance) -> Array:
    width, at = machine.uniform(0.05, 0.2), machine.uniform(0, TURN)
    turn = np.floor((scene.run.theta - at + np.pi) / TURN).astype(int)
    height = chance.standard_normal(np.ptp(turn) + 1)
    result: Array = height[turn - turn.min()] * _pulse(_wrapped(scene.run.theta - at), width)
    return result


@form("pulse", "fine")
def _pulses_at_random_times(scene: Scene, machine: Chance, chance: Chance) -> Array:
    count = int(chance.integers(20, 80))
    at, height = chance.uniform(0, scene.travel[-1], count), chance.uniform(0.4, 1.6, count)
    width = machine.uniform(0.01, 0.04)
    place = np.zeros(scene.travel.size)
    for centre, size in zip(at, height, strict=True):
        place += size * _pulse(scene.travel - centre, width)
    return place


@form("pulse", "fine")
def _pulses_of_a_foreign_pitch(scene: Scene, machine: Chance, chance: Chance) -> Array:
    shaft = foreign_order(machine, scene.run.ratio) * scene.run.theta + machine.uniform(0, TURN)
    return _pulse(_wrapped(shaft), machine.uniform(0.1, 0.3))


@form("pulse")
def _square_wave_of_a_foreign_order(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.tanh(machine.uniform(4, 12) * scene.order(machine))


@form("pulse")
def _saw_of_a_foreign_order(scene: Scene, machine: Chance, chance: Chance) -> Array:
    shaft = foreign_order(machine, scene.run.ratio) * scene.run.theta + machine.uniform(0, TURN)
    return shaft / TURN % 1 - 0.5


# Gains of the drive's own error.


@form("gain", "reversal")
def _gain_in_one_direction(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.error * (scene.run.speed < 0)


@form("gain")
def _gain_that_grows(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.error * scene.part ** machine.uniform(0.7, 2)


@form("gain")
def _gain_that_jumps(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.error * (scene.part > machine.uniform(0.3, 0.7))


@form("gain", "torque")
def _gain_by_load(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.error * np.abs(scene.torque)


@form("gain", "speeds")
def _gain_by_speed(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return scene.error * np.abs(scene.speed) ** machine.uniform(0.7, 2)


@form("gain")
def _power_of_the_error(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.abs(scene.error) ** machine.uniform(1.5, 3)


# Creep and relaxation.


@form("creep", "reversal")
def _creep_after_a_reversal(scene: Scene, machine: Chance, chance: Chance) -> Array:
    since, way = scene.since_reversal()
    result: Array = way * np.log1p(since / (machine.uniform(0.002, 0.05) * scene.run.time[-1]))
    return result


@form("creep", "reversal")
def _relaxation_after_a_reversal(scene: Scene, machine: Chance, chance: Chance) -> Array:
    since, way = scene.since_reversal()
    result: Array = way * (1 - np.exp(-since / (machine.uniform(0.03, 0.15) * scene.run.time[-1])))
    return result


@form("creep", "torque")
def _creep_under_load(scene: Scene, machine: Chance, chance: Chance) -> Array:
    keep = np.exp(-scene.run.step / (machine.uniform(0.02, 0.2) * scene.run.time[-1]))
    return lfilter([1 - keep], [1, -keep], scene.torque)


@form("creep", "speeds")
def _slow_answer_to_speed(scene: Scene, machine: Chance, chance: Chance) -> Array:
    keep = np.exp(-scene.run.step / (machine.uniform(0.02, 0.1) * scene.run.time[-1]))
    return lfilter([1 - keep], [1, -keep], np.abs(scene.speed))


# Drag with a shape of its own.


@form("drag", "speeds")
def _stribeck(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.sign(scene.speed) * np.exp(-np.abs(scene.speed) / machine.uniform(0.1, 0.5))


@form("drag", "reversal")
def _drag_that_wears_in(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.sign(scene.speed) * np.exp(-scene.part / machine.uniform(0.1, 0.4))


@form("drag", "reversal")
def _drag_round_the_turn(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.sign(scene.speed) * scene.order(machine)


# Bands of random phase.


def _band(samples: int, step: float, centre: float, width: float, chance: Chance) -> Array:
    rate: Array = np.asarray(np.fft.rfftfreq(samples, step), float)
    spectrum = np.fft.rfft(chance.standard_normal(samples)) * _pulse(rate - centre, width)
    wave = np.fft.irfft(spectrum, samples)
    result: Array = wave / wave.std()
    return result


@form("band")
def _band_in_hz(scene: Scene, machine: Chance, chance: Chance) -> Array:
    centre = (machine.integers(1, 6) + machine.uniform(0.3, 0.7)) * scene.turn_hz
    return _band(scene.run.time.size, scene.run.step, centre, machine.uniform(0.03, 0.1) * centre, chance)


@form("band")
def _band_of_orders(scene: Scene, machine: Chance, chance: Chance) -> Array:
    travel, order = scene.travel, foreign_order(machine, scene.run.ratio)
    even = np.linspace(0, travel[-1], travel.size)
    wave = _band(travel.size, even[1], order, machine.uniform(0.02, 0.06) * order, chance)
    return np.interp(travel, even, wave)


@form("band", "speeds")
def _band_that_grows_with_speed(scene: Scene, machine: Chance, chance: Chance) -> Array:
    return np.abs(scene.speed) * _band_in_hz(scene, machine, chance)


@form("band")
def _wander_of_a_few_turns(scene: Scene, machine: Chance, chance: Chance) -> Array:
    smooth = machine.uniform(0.5, 3) / scene.turn_hz / scene.run.step
    wave = gaussian_filter1d(chance.standard_normal(scene.run.time.size), smooth)
    result: Array = wave / wave.std()
    return result


@form("band")
def _a_step_every_turn(scene: Scene, machine: Chance, chance: Chance) -> Array:
    turn = np.floor(scene.travel + machine.uniform(0, 1)).astype(int)
    result: Array = chance.standard_normal(turn.max() + 1)[turn]
    return result
