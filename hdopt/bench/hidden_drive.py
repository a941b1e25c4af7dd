"""Concealed physics inside the drive: teeth, rings, bearing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from hdopt.bench.arrays import Array
from hdopt.bench.gears import CSF, Gear
from hdopt.bench.geometry import Zones, at_angle
from hdopt.bench.motion import TURN, Run
from hdopt.bench.signal_chain import Hidden, Parameter, Setup


def long_wave_array(rng: np.random.Generator, teeth: int, kind: str) -> Array:
    """Per-tooth deviation of unit rms for so many `teeth`, drawn by `rng`, without the two lowest orders, which belong
    to the base.

    `kind` is one of `LONG_WAVE`: one to three harmonics of orders 2 to 8; a random wave correlated over 3 to 8 % of the
    circumference to either side; or segments cut in three to six settings, with a run-out ramp in each.
    """
    place = np.arange(teeth)
    angle = TURN * place / teeth
    if kind == "harmonics":
        orders = rng.choice(np.arange(2, 9), size=rng.integers(1, 4), replace=False)
        wave = sum(rng.uniform(0.3, 1) * np.cos(k * angle + rng.uniform(0, TURN)) for k in orders)
    elif kind == "smooth":  # random, correlated over a tenth of the circumference
        distance = np.minimum(place, teeth - place) / (teeth * rng.uniform(0.03, 0.08))
        wave = np.fft.irfft(np.fft.rfft(rng.standard_normal(teeth)) * np.fft.rfft(np.exp(-0.5 * distance**2)), teeth)
    else:  # "segments": cut in several settings, a run-out ramp in each
        edges = np.sort(rng.choice(teeth, size=rng.integers(3, 7), replace=False))
        setting = np.searchsorted(edges, place, side="right") % edges.size
        since = (place - edges[setting - 1]) % teeth
        wave = rng.uniform(-1, 1, edges.size)[setting] * since
    spectrum = np.fft.rfft(wave)
    spectrum[:2] = 0
    wave = np.fft.irfft(spectrum, teeth)
    result: Array = wave / wave.std()
    return result


# Share of the power from which on one wave is alone.
LONE = 0.999

LONG_WAVE = ("harmonics", "smooth", "segments")


@dataclass(frozen=True)
class LongWave(Hidden):
    """Long-wave tooth deviation that is not one sine, on either spline."""

    id: str
    variant: str
    array: tuple[float, ...]
    scale: float = 1.0  # um rms

    @classmethod
    def draw(cls, rng: np.random.Generator, on: str, gear: Gear = CSF) -> Self:
        kind = str(rng.choice(LONG_WAVE))
        teeth = gear.cs_teeth if on == "cs" else gear.fs_teeth
        return cls(f"{on}_tooth_harmonics", kind, tuple(long_wave_array(rng, teeth, kind)))

    @property
    def same_as(self) -> tuple[str, ...]:
        """A lone wave of the circular spline's teeth is a lobe of its ring: the flank moves, or the depth."""
        power = np.abs(np.fft.rfft(self.array)) ** 2
        return ("circular_spline_lobing",) if self.id[0] == "c" and power.max() > LONE * power.sum() else ()

    def teeth(self, cs_mm: Array, fs_mm: Array) -> tuple[Array, Array]:
        extra = np.array(self.array) * self.scale * 1e-3
        return (cs_mm + extra, fs_mm) if self.id[0] == "c" else (cs_mm, fs_mm + extra)

    def truth(self) -> dict[str, Parameter]:
        found = {"deviation_rms": Parameter(self.scale, "um")}
        amplitude = 2 * np.abs(np.fft.rfft(self.array)) / len(self.array) * self.scale
        for order in np.flatnonzero(amplitude > 0.3 * amplitude.max()):
            found[f"order_{order}_amplitude"] = Parameter(float(amplitude[order]), "um")
        return found


@dataclass(frozen=True)
class ToothMesh(Hidden):
    """Short-wave deviation: the flank's form within each pitch, different in size from tooth to tooth."""

    size: tuple[float, ...]  # per circular-spline tooth
    skew: float
    scale: float = 1.0  # um
    id = "tooth_mesh"
    variant = "flank form"
    needs = frozenset({"dense"})

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        teeth = gear.cs_teeth
        size = 1 + rng.uniform(0.05, 0.4) * rng.standard_normal(teeth)
        if rng.random() < 0.5:
            size *= 1 + rng.uniform(0.1, 0.5) * np.sin(TURN * np.arange(teeth) / teeth + rng.uniform(0, TURN))
        return cls(tuple(size), rng.uniform(-0.3, 0.3))

    def depth_mm(self, run: Run, zones: Zones) -> Array | float:
        place = zones.cs_angle * len(self.size) / TURN
        part = place - np.floor(place)
        form = np.sin(np.pi * part) ** 2 + self.skew * np.sin(TURN * part)
        tooth = np.array(self.size)[np.floor(place).astype(np.int64) % len(self.size)]
        return self.scale * 1e-3 * tooth * form

    def truth(self) -> dict[str, Parameter]:
        return {"form_height": Parameter(self.scale, "um", False)}


@dataclass(frozen=True)
class LocalDefect(Hidden):
    """One damaged tooth (its neighbours half as much) in the per-tooth array of either spline."""

    variant: str  # "cs" or "fs"
    tooth: int
    sign: float
    scale: float = 5.0  # um
    teeth_round: int = 0  # of that spline; 0 for csf-25-80
    id = "local_tooth_defect"
    needs = frozenset({"fine"})

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        on = str(rng.choice(["cs", "fs"]))
        teeth = gear.cs_teeth if on == "cs" else gear.fs_teeth
        # A raised flank carries whenever it passes; a worn one only hands over to the other zone.
        return cls(on, int(rng.integers(teeth)), 1.0 if rng.random() < 0.8 else -1.0, teeth_round=teeth)

    def teeth(self, cs_mm: Array, fs_mm: Array) -> tuple[Array, Array]:
        array = (cs_mm if self.variant == "cs" else fs_mm).copy()
        for offset, part in ((-1, 0.5), (0, 1.0), (1, 0.5)):
            array[(self.tooth + offset) % array.size] += self.sign * part * self.scale * 1e-3
        return (array, fs_mm) if self.variant == "cs" else (cs_mm, array)

    @property
    def angle(self) -> float:
        """Angle of the tooth on its spline, rad."""
        return TURN * self.tooth / (self.teeth_round or (CSF.cs_teeth if self.variant == "cs" else CSF.fs_teeth))

    def truth(self) -> dict[str, Parameter]:
        return {
            "angle_deg": Parameter(360 * self.angle / TURN, "deg"),
            "height": Parameter(self.sign * self.scale, "um"),
        }

    def truth_in(self, setups: Sequence[Setup], waves: Sequence[Array]) -> dict[str, Parameter]:
        """The tooth passes both ends of the wave generator, half a turn apart, and the end that drives shows it: the
        centre of the pulse is the input angle at which more of it shows."""
        near, far = 0.0, 0.0
        for setup, wave in zip(setups, waves, strict=True):
            wave = wave - np.median(wave)  # most of a turn shows nothing of it
            zones = setup.zones.cs_angle if self.variant == "cs" else setup.zones.fs_angle
            first, second = (np.cos(zone - self.angle) > 0.9 for zone in zones)  # within 26 deg of the tooth
            near, far = near + float(wave[first] @ wave[first]), far + float(wave[second] @ wave[second])
        at = self.angle if near >= far else self.angle + TURN / 2
        return self.truth() | {"angle_deg": Parameter(360 * (at % TURN) / TURN, "deg")}


@dataclass(frozen=True)
class Lobing(Hidden):
    """Circular spline out of round: n lobes move the pitch circle in and out, and with it the meshing depth."""

    lobes: int
    phase: float
    scale: float = 5.0  # um
    id = "circular_spline_lobing"
    variant = "lobes"

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        return cls(int(rng.choice([3, 4, 5, 6, 8])), rng.uniform(0, TURN))

    def depth_mm(self, run: Run, zones: Zones) -> Array | float:
        around = np.arange(720) * TURN / 720
        ring = -np.cos(self.lobes * around - self.phase)  # where the ring stands in, the mesh is deeper
        return -self.scale * 1e-3 * at_angle(ring, zones.cs_angle)

    def truth(self) -> dict[str, Parameter]:
        return {"lobes": Parameter(self.lobes, "1"), "out_of_round": Parameter(self.scale, "um")}


@dataclass(frozen=True)
class BearingPass(Hidden):
    """Balls of unequal diameter in a cage, carried past both ends of the wave generator, and the ball pitch itself."""

    variant: str  # "diameters" or "pitch"
    balls: int
    ball_to_pitch: float
    diameter: tuple[float, ...]
    start: float
    sharpness: float
    scale: float = 5.0  # um
    id = "bearing_pass"

    @classmethod
    def draw(cls, rng: np.random.Generator, gear: Gear = CSF) -> Self:
        kind = str(rng.choice(["diameters", "pitch"]))
        balls = int(rng.integers(19, 28))
        diameter = 0.15 * rng.standard_normal(balls)
        if kind == "diameters":
            diameter[rng.integers(balls)] += rng.choice([-1, 1])
        sharpness = rng.uniform(4, 12) if kind == "diameters" else rng.uniform(60, 150)
        return cls(kind, balls, rng.uniform(0.075, 0.13), tuple(diameter), rng.uniform(0, TURN), sharpness)

    def depth_mm(self, run: Run, zones: Zones) -> Array | float:
        r = self.ball_to_pitch
        cage = run.theta * ((1 - r) / 2 - (1 + r) / (2 * run.ratio)) + self.start
        # A ball lifts the rim when it stands at an end; between two balls the rim sags ("pitch").
        balls = np.arange(self.balls)
        height = np.array(self.diameter) + (1.0 if self.variant == "pitch" else 0.0)
        # The balls' common profile around the ring, once on a grid, then looked up at both ends.
        grid = TURN * np.arange(4096) / 4096
        lift = sum(
            h * np.exp(self.sharpness * (np.cos(grid - TURN * j / self.balls) - 1))
            for j, h in zip(balls, height, strict=True)
        )
        ends = np.stack([run.theta - cage, run.theta + np.pi - cage])
        return self.scale * 1e-3 * at_angle(lift, ends)

    def truth(self) -> dict[str, Parameter]:
        return {
            # The orders of unequal balls hold no trace of how many equal ones run between them.
            "balls": Parameter(self.balls, "1", self.variant == "pitch"),
            "ball_to_pitch_ratio": Parameter(self.ball_to_pitch, "1"),
        }
