"""Sines of a shaft angle: eccentric encoders, the encoder's lines, a bent coupling. All in arcmin at the output."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from hdopt.diagnosis.effects.encoder_interpolation import HARMONICS
from hdopt.extended import AddedEffect
from hdopt.study.base import NotNegative
from hdopt.study.effects.base import EffectSection, SineSet, polar, smallest_set, with_sine_keys


class EncoderInputEccentricity(EffectSection):
    """[effects.encoder_input_eccentricity]: once an input turn."""

    id = "encoder_input_eccentricity"
    amplitude_arcmin: NotNegative
    phase_deg: float

    def build(self, gear):
        return AddedEffect(self.id, {"variant": 0.0}, self.sine("amplitude_arcmin", "phase_deg"))

    @classmethod
    def keys(cls, effect, gear):
        return dict(zip(("amplitude_arcmin", "phase_deg"), polar(*effect.coefficients), strict=True))


@with_sine_keys
class EncoderOutputEccentricity(SineSet):
    """[effects.encoder_output_eccentricity]: once an output turn; an elliptical wheel twice as well."""

    id = "encoder_output_eccentricity"
    sines: ClassVar = {1: ("amplitude_arcmin", "phase_deg"), 2: ("amplitude_output_2_arcmin", "phase_output_2_deg")}

    def build(self, gear):
        members = (1, 2) if 2 in self.given() else (1,)
        return AddedEffect(self.id, {"variant": float(len(members) - 1)}, self.coefficients(members))

    @classmethod
    def keys(cls, effect, gear):
        return cls.written((1, 2)[: len(effect.coefficients) // 2], effect.coefficients)


class OutputCoupling(EffectSection):
    """[effects.output_coupling]: twice a turn of its shaft."""

    id = "output_coupling"
    shaft: Literal["input", "output"] = "output"
    amplitude_arcmin: NotNegative
    phase_deg: float

    def build(self, gear):
        variant = 0.0 if self.shaft == "output" else 1.0
        return AddedEffect(self.id, {"variant": variant}, self.sine("amplitude_arcmin", "phase_deg"))

    @classmethod
    def keys(cls, effect, gear):
        amplitude, phase = polar(*effect.coefficients)
        shaft = "input" if effect.shape["variant"] else "output"
        return {"shaft": shaft, "amplitude_arcmin": amplitude, "phase_deg": phase}


@with_sine_keys
class EncoderInterpolation(SineSet):
    """[effects.encoder_interpolation]: once a line (`amplitude_arcmin`), up to four times (`amplitude_4_arcmin`)."""

    id = "encoder_interpolation"
    sines: ClassVar = {1: ("amplitude_arcmin", "phase_deg")} | {
        k: (f"amplitude_{k}_arcmin", f"phase_{k}_deg") for k in (2, 3, 4)
    }
    shaft: Literal["input", "output"]
    lines: int = Field(ge=1, le=1_000_000)

    def build(self, gear):
        names = list(HARMONICS)
        name = names[smallest_set([HARMONICS[name] for name in names], list(self.given()))]
        members = HARMONICS[name]
        shape = {"lines": float(self.lines), "output": float(self.shaft == "output"), "harmonics": name}
        return AddedEffect(self.id, shape, self.coefficients(members))

    @classmethod
    def keys(cls, effect, gear):
        members = HARMONICS[effect.shape["harmonics"]]
        shaft = "output" if effect.shape["output"] else "input"
        lines = int(effect.shape["lines"])
        return {"shaft": shaft, "lines": lines, **cls.written(members, effect.coefficients)}
