"""The bench: motor, drive, encoders, and the stages at which concealed physics acts on the signal chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hdopt.bench.arrays import Array
from hdopt.bench.gears import CSF, Gear
from hdopt.bench.geometry import BaseErrors, Zones, base_teeth, find_zones, zone_deviation_mm
from hdopt.bench.motion import Plan, Run


@dataclass(frozen=True)
class Parameter:
    """A parameter of concealed physics as the key states it. `identifiable` says whether the records can carry it."""

    value: float
    unit: str
    identifiable: bool = True


class Hidden:
    """Concealed physics: does nothing at any stage until a subclass says otherwise."""

    id: str  # of the catalogue; empty outside it
    variant: str
    scale: float
    scale_range = (1e-4, 1e4)
    link: int = 0
    """Place between a shaft and the number that is read: joint (1), disc (2), signals of its lines (3)."""

    @property
    def needs(self) -> frozenset[str]:
        """What it demands of the record, in the words of `draw_plans`."""
        return frozenset()

    @property
    def same_as(self) -> tuple[str, ...]:
        """Entries of the catalogue that make the very same recording, with other parameters."""
        return ()

    @property
    def torque_gain(self) -> float:
        """By how much it takes more load than was drawn."""
        return 1.0

    def for_plans(self, plans: Sequence[Plan]) -> Self:
        """The same physics, with what depends on the test's conditions set."""
        return self

    def scaled(self, scale: float) -> Self:
        """The same physics, `scale` times as large as it was drawn."""
        return replace(self, scale=scale)  # type: ignore[type-var]  # every physics is a record with a scale

    def teeth(self, cs_mm: Array, fs_mm: Array) -> tuple[Array, Array]:
        """Per-tooth deviations (mm) with this physics in them."""
        return cs_mm, fs_mm

    def depth_mm(self, run: Run, zones: Zones) -> Array | float:
        """Extra meshing depth (mm) of both zones."""
        return 0.0

    def lag(self, run: Run, ke: Array) -> Array | float:
        """Extra lag (rad) of the output behind input/N - `ke`."""
        return 0.0

    def read_input(self, angle: Array, run: Run) -> Array:
        return angle

    def read_output(self, angle: Array, run: Run) -> Array:
        return angle

    def clock(self, time: Array, input_angle: Array, output_angle: Array) -> tuple[Array, Array]:
        return input_angle, output_angle

    def truth_in(self, setups: Sequence[Setup], waves: Sequence[Array]) -> dict[str, Parameter]:
        """`truth` as the `waves` that it makes in recordings (`setups`) show it, where that says more."""
        return self.truth()

    def truth(self) -> dict[str, Parameter]:
        """Parameters, name to Parameter."""
        return {}


@dataclass(frozen=True)
class Setup:
    """One recording's true motion with the base drive's zones along it."""

    run: Run
    zones: Zones
    errors: BaseErrors
    gear: Gear = CSF


def set_up(errors: BaseErrors, run: Run, gear: Gear = CSF) -> Setup:
    """One recording's `run` with the zones of `gear` with `errors` along it."""
    return Setup(run, find_zones(errors, run.theta, gear), errors, gear)


def read_angles(setup: Setup, hidden: Sequence[Hidden] = ()) -> tuple[Array, Array]:
    """Input and output angles (n,) (rad) of the recording `setup` as ideal electronics would read them, with the
    `hidden` physics in place, in the order of the chain: load, teeth, depth, lag, encoders (from the shaft to the
    number, in whatever order `hidden` is given), clock."""
    run = setup.run
    gain = np.prod([physics.torque_gain for physics in hidden])
    run = replace(run, torque=run.torque * gain)
    cs_mm, fs_mm = base_teeth(setup.errors, setup.gear)
    extra: Array | float = 0.0
    for physics in hidden:
        cs_mm, fs_mm = physics.teeth(cs_mm, fs_mm)
        extra = extra + physics.depth_mm(run, setup.zones)
    ke = setup.gear.rad_per_mm(run.theta) * zone_deviation_mm(setup.zones, cs_mm, fs_mm, extra).max(axis=0)
    output_angle = run.theta / run.ratio - ke - sum(physics.lag(run, ke) for physics in hidden)
    input_angle = run.theta
    for physics in sorted(hidden, key=lambda physics: physics.link):
        input_angle = physics.read_input(input_angle, run)
        output_angle = physics.read_output(output_angle, run)
    for physics in hidden:
        input_angle, output_angle = physics.clock(run.time, input_angle, output_angle)
    return input_angle, output_angle


def read_error(setup: Setup, hidden: Sequence[Hidden] = ()) -> Array:
    """Kinematic error (n,) (rad) of the ideal readings of `setup` with the `hidden` physics: input/N - output."""
    input_angle, output_angle = read_angles(setup, hidden)
    return input_angle / setup.run.ratio - output_angle


def hidden_wave(setup: Setup, hidden: Sequence[Hidden]) -> Array:
    """What the `hidden` physics adds to the recorded kinematic error of `setup`, (n,) rad, mean removed."""
    wave = read_error(setup, hidden) - read_error(setup)
    result: Array = wave - wave.mean()
    return result


def joint_rms(waves: Sequence[Array]) -> float:
    """Rms over all recordings of a case, whose `waves` are one array each, with each one's mean removed."""
    centred = np.concatenate([wave - wave.mean() for wave in waves])
    return float(np.sqrt(np.mean(centred**2)))
