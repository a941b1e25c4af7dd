"""Physics that no entry of the catalogue describes. A diagnosis has to say that it does not know it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.ndimage import gaussian_filter1d

from hdopt.bench.arrays import Array
from hdopt.bench.geometry import ARCMIN
from hdopt.bench.motion import TURN, Plan, Run
from hdopt.bench.outside_forms import FORMS, Scene, foreign_order
from hdopt.bench.signal_chain import Hidden


@dataclass(frozen=True)
class Outside(Hidden):
    """A wave (arcmin per unit of scale) of one of the kinds below, or of the forms of `outside_forms`.

    What belongs to the machine (an order, a frequency) is the same in every recording, what is chance differs.
    """

    variant: str
    seed: int
    turn_hz: float = 1.0
    scale: float = 0.1
    id = ""

    @classmethod
    def draw(cls, rng: np.random.Generator, kind: str | None = None) -> Self:
        kind = kind or str(rng.choice(list(KINDS)))
        if kind not in KINDS and kind not in FORMS:
            raise ValueError(f"no such physics: {kind!r}; the bench knows {', '.join((*KINDS, *FORMS))}")
        return cls(kind, int(rng.integers(2**31)))

    @property
    def needs(self) -> frozenset[str]:
        return FORMS[self.variant].needs if self.variant in FORMS else frozenset()

    def for_plans(self, plans: Sequence[Plan]) -> Self:
        return replace(self, turn_hz=max(rpm for plan in plans for _, rpm in plan.legs) / 60)

    def lag(self, run: Run, ke: Array) -> Array | float:
        machine = np.random.default_rng(self.seed)
        chance = np.random.default_rng([self.seed, run.time.size])
        if self.variant in FORMS:
            return self.scale * ARCMIN * FORMS[self.variant].wave(Scene(run, ke, self.turn_hz), machine, chance)
        return self.scale * ARCMIN * KINDS[self.variant](run, self.turn_hz, machine, chance)


def _samples_per_turn(run: Run) -> float:
    result: float = TURN / np.abs(run.speed).max() / run.step
    return result


def belt_order(run: Run, turn_hz: float, machine: np.random.Generator, chance: np.random.Generator) -> Array:
    """A belt stage ahead of the input: its tooth-count ratio gives an order locked to nothing in the drive.

    It turns with the input of `run`; `machine` draws order, one to three harmonics and their phases. The speed
    `turn_hz` and `chance` have no part in it.
    """
    order, harmonics = foreign_order(machine, run.ratio), machine.integers(1, 4)
    result: Array = sum(
        np.cos(k * order * run.theta + machine.uniform(0, TURN)) / k**1.5 for k in range(1, harmonics + 1)
    )
    return result


def auxiliary_gear(run: Run, turn_hz: float, machine: np.random.Generator, chance: np.random.Generator) -> Array:
    """A gear pair between output and its encoder: run-out of the second gear, and its pitch cut in two settings.

    It turns with the input of `run`; `machine` draws its order and two phases. `turn_hz` and `chance` have no part.
    """
    shaft = foreign_order(machine, run.ratio) * run.theta
    result: Array = np.cos(shaft + machine.uniform(0, TURN)) + np.abs(np.sin(shaft / 2 + machine.uniform(0, TURN)))
    return result


def hub_slip(run: Run, turn_hz: float, machine: np.random.Generator, chance: np.random.Generator) -> Array:
    """A coupling hub that slips: jumps at random instants, to either side, each taking a few samples.

    `chance` draws 6 to 14 jumps over the time of `run`, each a thousandth of it wide, and their sizes; `machine` and
    `turn_hz` have no part.
    """
    jumps = chance.integers(6, 15)
    at = chance.uniform(0, run.time[-1], jumps)
    width = run.time[-1] * 1e-3
    wave = np.zeros(run.time.size)
    for t, size in zip(at, chance.standard_normal(jumps), strict=True):
        wave = wave + size * (0.5 + 0.5 * np.tanh((run.time - t) / width))
    return wave


def one_off_bump(run: Run, turn_hz: float, machine: np.random.Generator, chance: np.random.Generator) -> Array:
    """A chip drawn through once: one bump, gone after a turn or two.

    `chance` draws its place within the middle of `run` and its width; `machine` and `turn_hz` have no part.
    """
    at = chance.uniform(0.2, 0.8) * run.time.size
    place = (np.arange(run.time.size) - at) / (chance.uniform(0.5, 1.5) * _samples_per_turn(run))
    result: Array = np.exp(-0.5 * place**2) * np.cos(2.5 * place)
    return result


def modulated_order(run: Run, turn_hz: float, machine: np.random.Generator, chance: np.random.Generator) -> Array:
    """A motor's cogging behind a slipping clutch: an order whose amplitude and phase wander.

    `machine` draws the order, over the input of `run`, and `chance` how it wanders, slowly over three turns; `turn_hz`
    has no part.
    """
    order = foreign_order(machine, run.ratio) * run.theta
    wander = gaussian_filter1d(chance.standard_normal((2, run.time.size)), 3 * _samples_per_turn(run), axis=1)
    wander /= wander.std(axis=1, keepdims=True)
    result: Array = wander[0] * np.cos(order) + wander[1] * np.sin(order)
    return result


def mains(run: Run, turn_hz: float, machine: np.random.Generator, chance: np.random.Generator) -> Array:
    """Mains pick-up: 50 Hz and its third harmonic in time, folded where the sampling is slower.

    `machine` draws the exact frequency and the harmonic's share, `chance` the phases in this `run`; `turn_hz` has no
    part.
    """
    frequency = 50 * (1 + 1e-4 * machine.standard_normal())
    third = machine.uniform(0, 0.6)
    phase = chance.uniform(0, TURN, 2)
    result: Array = np.cos(TURN * frequency * run.time + phase[0]) + third * np.cos(
        3 * TURN * frequency * run.time + phase[1]
    )
    return result


def floor_vibration(run: Run, turn_hz: float, machine: np.random.Generator, chance: np.random.Generator) -> Array:
    """A narrow band of the building's vibration, fixed in Hz, random in amplitude.

    `machine` draws its centre between the harmonics of `turn_hz`, the highest input speed of the case in turns a
    second; `chance` draws the noise in this `run` that the band is cut from, 6 % of the centre wide.
    """
    # Away from the harmonics of the highest input speed, where the drive has its own orders.
    centre = (machine.integers(1, 6) + machine.uniform(0.35, 0.65)) * turn_hz
    hz = np.fft.rfftfreq(run.time.size, run.step)
    spectrum = np.fft.rfft(chance.standard_normal(run.time.size))
    wave = np.fft.irfft(spectrum * np.exp(-0.5 * ((hz - centre) / (0.06 * centre)) ** 2), run.time.size)
    result: Array = wave / wave.std()
    return result


def slow_wave(run: Run, turn_hz: float, machine: np.random.Generator, chance: np.random.Generator) -> Array:
    """The room's air conditioning on the bench: slow cycles in time with nothing logged that would show them.

    `chance` draws 1.6 to 4.5 cycles over `run`, how they quicken, and the phase; `machine` and `turn_hz` have no part.
    """
    part = run.time / run.time[-1]
    cycles = chance.uniform(1.6, 4.5)
    result: Array = np.sin(TURN * (cycles * part + chance.uniform(-0.3, 0.3) * part**2) + chance.uniform(0, TURN))
    return result


def stick_slip(run: Run, turn_hz: float, machine: np.random.Generator, chance: np.random.Generator) -> Array:
    """Relaxation oscillation of a dry seal: saw teeth of irregular length along the path of the input of `run`.

    `chance` draws each tooth's length, 0.15 to 1.6 turns, and its height; `machine` and `turn_hz` have no part.
    """
    path = np.concatenate([[0], np.cumsum(np.abs(np.diff(run.theta)))]) / TURN
    edges = np.concatenate([[0], np.cumsum(chance.uniform(0.15, 1.6, int(path[-1] * 4) + 20))])
    rank = np.searchsorted(edges, path, side="right") - 1
    size = chance.uniform(0.5, 1.5, edges.size)[rank]
    result: Array = size * ((path - edges[rank]) / (edges[rank + 1] - edges[rank]) - 0.5)
    return result


KINDS = {
    "belt order": belt_order,
    "auxiliary gear": auxiliary_gear,
    "hub slip": hub_slip,
    "one-off bump": one_off_bump,
    "modulated order": modulated_order,
    "mains": mains,
    "floor vibration": floor_vibration,
    "slow wave": slow_wave,
    "stick-slip": stick_slip,
}

ALL_KINDS = (*KINDS, *FORMS)
"""Every form from which a proof draws what is outside the catalogue."""
