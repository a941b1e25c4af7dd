"""Concealed physics of the measurement: encoders off-centre or ill adjusted, bent couplings, clocks apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.interpolate import CubicSpline

from hdopt.bench.arrays import Array
from hdopt.bench.gears import CSF, Gear
from hdopt.bench.geometry import ARCMIN
from hdopt.bench.motion import TURN, Run
from hdopt.bench.signal_chain import Hidden, Parameter


def _near(turned: Array, angle: Array) -> Array:
    """The value of `turned` (known up to whole turns) that lies nearest `angle`."""
    return angle + (turned - angle + np.pi) % TURN - np.pi


def off_centre_reading(
    angle: Array, eccentricity: float, direction: float, stretch: float = 0.0, stretch_direction: float = 0.0
) -> Array:
    """Angle read by one head off a code disc whose pattern is off-centre (share of its radius) and oval.

    `eccentricity` is a share of the disc's radius, `direction` (rad) where the pattern's centre lies; `stretch` is by
    how much the pattern is too long. In the disc's frame the head stands at -`angle` (rad); the pattern counts its
    angle about its own centre, in coordinates that the stretch along `stretch_direction` has undone.
    """
    x = np.cos(-angle) - eccentricity * np.cos(direction)
    y = np.sin(-angle) - eccentricity * np.sin(direction)
    c, s = np.cos(stretch_direction), np.sin(stretch_direction)
    along, across = (c * x + s * y) / (1 + stretch), c * y - s * x
    return _near(-np.arctan2(s * along + c * across, c * along - s * across), angle)


@dataclass(frozen=True)
class Eccentricity(Hidden):
    """Encoder disc off-centre on its shaft; at the output perhaps also oval."""

    id: str
    variant: str  # "centre", "centre and oval"
    direction: float
    oval_share: float
    oval_direction: float
    scale: float = 0.1  # amplitude in the kinematic error, arcmin
    link = 2

    @classmethod
    def draw(cls, rng: np.random.Generator, on: str, gear: Gear = CSF) -> Self:
        oval = on == "output" and rng.random() < 0.3
        share = rng.uniform(0.3, 0.8) if oval else 0.0
        name = f"encoder_{on}_eccentricity"
        return cls(name, "centre and oval" if oval else "centre", rng.uniform(0, TURN), share, rng.uniform(0, TURN))

    @property
    def _at_input(self) -> bool:
        return self.id == "encoder_input_eccentricity"

    def read_input(self, angle: Array, run: Run) -> Array:
        if not self._at_input:
            return angle
        return off_centre_reading(angle, self.scale * ARCMIN * run.ratio, self.direction)

    def read_output(self, angle: Array, run: Run) -> Array:
        if self._at_input:
            return angle
        size = self.scale * ARCMIN
        return off_centre_reading(angle, size, self.direction, 2 * size * self.oval_share, self.oval_direction)

    def truth(self) -> dict[str, Parameter]:
        return {"amplitude_arcmin": Parameter(self.scale, "arcmin")}


@dataclass(frozen=True)
class Interpolation(Hidden):
    """Sine and cosine signals of a line encoder with offsets, unequal gains and a phase that is not 90 deg."""

    variant: str  # "input" or "output"
    lines: int
    offset: tuple[float, float]
    gain: float
    skew: float
    scale: float = 0.05
    id = "encoder_interpolation"
    link = 3
    # A signal distorted more than this would not have passed the encoder's own supervision.
    scale_range = (1e-4, 0.4)
    needs = frozenset({"fine"})

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        on = str(rng.choice(["input", "output"]))
        lines = rng.choice([8, 16, 20, 32]) if on == "input" else rng.choice([500, 720, 1000, 1024, 2048, 2500])
        return cls(on, int(lines), tuple(rng.uniform(-1, 1, 2)), rng.uniform(-1, 1), rng.uniform(-1, 1))

    def read(self, angle: Array) -> Array:
        electrical = self.lines * angle
        a = (1 + self.scale * self.gain) * np.cos(electrical) + self.scale * self.offset[0]
        b = np.sin(electrical + self.scale * self.skew) + self.scale * self.offset[1]
        return _near(np.arctan2(b, a), electrical) / self.lines

    def read_input(self, angle: Array, run: Run) -> Array:
        return self.read(angle) if self.variant == "input" else angle

    def read_output(self, angle: Array, run: Run) -> Array:
        return self.read(angle) if self.variant == "output" else angle

    def truth(self) -> dict[str, Parameter]:
        return {"lines": Parameter(self.lines, "1")}


@dataclass(frozen=True)
class Coupling(Hidden):
    """A universal joint bent by an angle between an encoder and its shaft; exact Cardan formula."""

    variant: str  # "input" or "output"
    direction: float
    scale: float = 1.0  # bend, deg, squared
    ratio: float = CSF.ratio
    id = "output_coupling"
    link = 1
    scale_range = (1e-4, 15.0**2)

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        return cls(str(rng.choice(["input", "output"], p=[0.25, 0.75])), rng.uniform(0, TURN), ratio=gear.ratio)

    @property
    def bend(self) -> float:
        result: float = np.deg2rad(np.sqrt(self.scale))
        return result

    def read(self, angle: Array) -> Array:
        turned = angle - self.direction
        return _near(np.arctan2(np.cos(self.bend) * np.sin(turned), np.cos(turned)), turned) + self.direction

    def read_input(self, angle: Array, run: Run) -> Array:
        return self.read(angle) if self.variant == "input" else angle

    def read_output(self, angle: Array, run: Run) -> Array:
        return self.read(angle) if self.variant == "output" else angle

    def truth(self) -> dict[str, Parameter]:
        amplitude = np.tan(self.bend / 2) ** 2 / ARCMIN / (self.ratio if self.variant == "input" else 1)
        return {
            "amplitude_arcmin": Parameter(float(amplitude), "arcmin"),
            "bend_deg": Parameter(float(np.rad2deg(self.bend)), "deg"),
        }


@dataclass(frozen=True)
class ChannelDelay(Hidden):
    """One channel's samples taken later or earlier than the other's; found by interpolating the sampled angles."""

    variant: str  # "output late" or "input late"
    scale: float = 1e-3  # s
    id = "channel_delay"
    needs = frozenset({"speeds"})
    scale_range = (1e-7, 1.0)

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        return cls(str(rng.choice(["output late", "input late"])))

    def scale_for(self, rms: float, speed: float) -> float:
        """Scale that gives `rms` (rad) in a test back and forth at `speed` (rad/s) of the output."""
        return rms / speed

    def clock(self, time: Array, input_angle: Array, output_angle: Array) -> tuple[Array, Array]:
        late = time - self.scale
        if self.variant == "output late":
            return input_angle, _hold_ends(time, output_angle, late)
        return _hold_ends(time, input_angle, late), output_angle

    def truth(self) -> dict[str, Parameter]:
        return {"delay_s": Parameter(self.scale if self.variant == "output late" else -self.scale, "s")}


def _hold_ends(time: Array, angle: Array, when: Array) -> Array:
    return CubicSpline(time, angle)(np.clip(when, time[0], time[-1]))
