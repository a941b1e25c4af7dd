"""Effects of the teeth and of the circular spline: harmonics of the deviation, mesh ripple, lobes, a damaged tooth."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field

from hdopt.diagnosis.effects.circular_spline_lobing import LOBES
from hdopt.diagnosis.effects.cs_tooth_harmonics import RUNS, members_of, shape_of
from hdopt.diagnosis.effects.local_tooth_defect import COORDINATES, NARROWEST_DEG, WIDEST_DEG, WIDEST_OUTPUT_DEG
from hdopt.diagnosis.effects.tooth_mesh import SIDEBANDS, ZONE_SIDEBANDS
from hdopt.errors import HdoptError
from hdopt.extended import AddedEffect
from hdopt.study.base import NotNegative
from hdopt.study.effects.base import UM, EffectSection, SineSet, polar, smallest_set, with_sine_keys


@with_sine_keys
class CircularSplineToothHarmonics(SineSet):
    """[effects.cs_tooth_harmonics]: waves of the tooth deviation beyond the first, um of arc at the pitch line."""

    id = "cs_tooth_harmonics"
    unit = UM
    sines: ClassVar = {h: (f"amplitude_{h}_um", f"phase_{h}_deg") for h in RUNS[-1]}

    def build(self, gear):
        members = sorted(self.given())
        return AddedEffect(self.id, shape_of(members), self.coefficients(members))

    @classmethod
    def keys(cls, effect, gear):
        return cls.written(members_of(effect.shape), effect.coefficients)


class FlexsplineToothHarmonics(CircularSplineToothHarmonics):
    """[effects.fs_tooth_harmonics]: the same of the flexspline."""

    id = "fs_tooth_harmonics"


def _sideband(offset: int) -> tuple[str, str]:
    if offset == 0:
        return "amplitude_arcmin", "phase_deg"
    side = f"{'plus' if offset > 0 else 'minus'}_{abs(offset)}"
    return f"amplitude_{side}_arcmin", f"phase_{side}_deg"


ZONE = 100
"""Numbers ZONE z + k name the sideband k of the ripple inside zone z."""


def _zone_sideband(zone: int, offset: int) -> tuple[str, str]:
    amplitude, phase = _sideband(offset)
    return f"zone_{zone}_{amplitude.replace('arcmin', 'um')}", f"zone_{zone}_{phase}"


@with_sine_keys
class ToothMesh(SineSet):
    """[effects.tooth_mesh]: ripple at the tooth-mesh order Z_CS and its sidebands, either at the output or, um of arc,
    inside each of the two zones (`zone_1_amplitude_um`, ...), where it also decides which one drives."""

    id = "tooth_mesh"
    sines: ClassVar = {k: _sideband(k) for k in sorted({k for group in SIDEBANDS for k in group}, key=abs)} | {
        ZONE * zone + k: _zone_sideband(zone, k) for zone in (1, 2) for k in ZONE_SIDEBANDS[-1]
    }

    def build(self, gear):
        given = list(self.given())
        inside = [name for name in given if name >= ZONE // 2]
        if not inside:
            index = smallest_set(SIDEBANDS, given)
            return AddedEffect(self.id, {"sidebands": float(index)}, self.coefficients(SIDEBANDS[index]))
        if len(inside) < len(given):
            raise HdoptError(
                f"effects.{self.id} has both sines at the output and sines inside the zones; give those in _arcmin or "
                "in _um"
            )
        sides = [name - ZONE * round(name / ZONE) for name in inside]
        index = smallest_set(ZONE_SIDEBANDS, sides)
        arc = self.coefficients(_zone_names(index))
        return AddedEffect(self.id, {"sidebands": float(index), "zones": 1.0}, tuple(UM * c for c in arc))

    @classmethod
    def keys(cls, effect, gear):
        index = int(effect.shape["sidebands"])
        if "zones" in effect.shape:
            return cls.written(_zone_names(index), [c / UM for c in effect.coefficients])
        return cls.written(SIDEBANDS[index], effect.coefficients)


def _zone_names(index: int) -> list[int]:
    return [ZONE * zone + k for zone in (1, 2) for k in ZONE_SIDEBANDS[index]]


class CircularSplineLobing(EffectSection):
    """[effects.circular_spline_lobing]: out of round by `radial_amplitude_um` sin(lobes theta + phase)."""

    id = "circular_spline_lobing"
    lobes: int = Field(ge=LOBES.start, lt=LOBES.stop)
    radial_amplitude_um: NotNegative
    phase_deg: float

    def build(self, gear):
        slope = UM * math.tan(gear.pressure_angle)
        sine, cosine = self.sine("radial_amplitude_um", "phase_deg")
        return AddedEffect(self.id, {"lobes": float(self.lobes)}, (slope * sine, slope * cosine))

    @classmethod
    def keys(cls, effect, gear):
        arc, phase = polar(*effect.coefficients)
        radial = arc / math.tan(gear.pressure_angle) / UM
        return {"lobes": int(effect.shape["lobes"]), "radial_amplitude_um": radial, "phase_deg": phase}


SEEN = {
    "circular_spline": "cs",
    "flexspline": "fs",
    "circular_spline_once": "cs_once",
    "flexspline_once": "fs_once",
    "output": "output",
    "circular_spline_twice": "cs_twice",
    "flexspline_twice": "fs_twice",
}
"""Where a damaged tooth sits: met by the zone that drives, seen once or twice a turn whichever drives, or at one output
angle.
"""


class LocalToothDefect(EffectSection):
    """[effects.local_tooth_defect]: a Gaussian pulse, `width_deg` its standard deviation in wave-generator travel."""

    id = "local_tooth_defect"
    on: Literal[
        "circular_spline",
        "flexspline",
        "circular_spline_once",
        "flexspline_once",
        "output",
        "circular_spline_twice",
        "flexspline_twice",
    ]
    angle_deg: float
    width_deg: float = Field(ge=NARROWEST_DEG)
    height_um: float | None = None
    """On a tooth that both zones meet: of arc at the pitch line."""
    height_arcmin: float | None = None
    """Of the other kinds: at the output."""
    height_2_arcmin: float | None = None
    """Of a tooth seen twice: half a turn on."""

    def build(self, gear):
        widest = WIDEST_OUTPUT_DEG * gear.ratio if self.on == "output" else WIDEST_DEG
        if self.width_deg > widest:
            raise HdoptError(
                f"effects.{self.id}.width_deg is {self.width_deg:g}; a defect on {self.on!r} is at most {widest:g} deg "
                "of wave-generator travel wide"
            )
        twice = self.on.endswith("twice")
        if twice != (self.height_2_arcmin is not None):
            needs = "needs height_2_arcmin, half a turn on" if twice else "has no height_2_arcmin"
            raise HdoptError(f"effects.{self.id}: a defect on {self.on!r} {needs}")
        in_zones = self.on in ("circular_spline", "flexspline")
        key, other = ("height_um", "height_arcmin") if in_zones else ("height_arcmin", "height_um")
        if getattr(self, key) is None or getattr(self, other) is not None:
            raise HdoptError(f"effects.{self.id}: a defect on {self.on!r} has {key}, not {other}; give {key} alone")
        shape = {
            "centre": math.radians(self.angle_deg),
            "width_deg": self.width_deg,
            "on": float(COORDINATES.index(SEEN[self.on])),
        }
        heights = (self.height_arcmin, self.height_2_arcmin) if twice else (self.height_arcmin,)
        return AddedEffect(self.id, shape, (UM * self.height_um,) if in_zones else heights)

    @classmethod
    def keys(cls, effect, gear):
        name = COORDINATES[int(effect.shape["on"])]
        on = next(key for key, value in SEEN.items() if value == name)
        height = effect.coefficients[0]
        size = {"height_um": height / UM} if name in ("cs", "fs") else {"height_arcmin": height}
        if name.endswith("twice"):
            size["height_2_arcmin"] = effect.coefficients[1]
        angle = math.degrees(effect.shape["centre"])
        return {"on": on, "angle_deg": angle, "width_deg": effect.shape["width_deg"], **size}
