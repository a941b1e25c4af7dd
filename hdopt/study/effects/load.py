"""Effects of load, direction, speed, temperature and time."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field, model_validator

from hdopt.diagnosis.effects._friction_law import NAMES
from hdopt.diagnosis.effects.torsional_windup import COMPLIANCE
from hdopt.errors import HdoptError, MissingValue
from hdopt.extended import AddedEffect
from hdopt.study.base import NotNegative, Positive
from hdopt.study.effects.base import EffectSection, polar


class TorsionalWindup(EffectSection):
    """[effects.torsional_windup]: stiffness up to knee_1, up to knee_2 and above, as in a maker's catalogue.

    A negative stiffness stands for a torque that was counted the other way. `variation_over_turn` is the share by
    which the compliance of a drive without knees swings twice a turn: 1 + v sin(2 theta + phase).
    """

    id = "torsional_windup"
    stiffness_1_nm_per_rad: float
    stiffness_2_nm_per_rad: float | None = None
    stiffness_3_nm_per_rad: float | None = None
    knee_1_nm: Positive | None = None
    knee_2_nm: Positive | None = None
    variation_over_turn: NotNegative | None = None
    variation_phase_deg: float | None = None

    @model_validator(mode="after")
    def _stiff(self) -> TorsionalWindup:
        if 0.0 in self._stiffnesses():
            raise ValueError("has a stiffness of 0; give one above 0, or below 0 for a torque counted the other way")
        return self

    def _stiffnesses(self) -> list[float | None]:
        return [self.stiffness_1_nm_per_rad, self.stiffness_2_nm_per_rad, self.stiffness_3_nm_per_rad]

    def build(self, gear):
        shape: dict[str, float] = {}
        compliances = [1 / (COMPLIANCE * self.stiffness_1_nm_per_rad)]
        for i, (knee, stiffness) in enumerate(
            ((self.knee_1_nm, self.stiffness_2_nm_per_rad), (self.knee_2_nm, self.stiffness_3_nm_per_rad)), start=1
        ):
            keys = f"effects.{self.id}.knee_{i}_nm", f"effects.{self.id}.stiffness_{i + 1}_nm_per_rad"
            if (knee is None) != (stiffness is None):
                raise MissingValue(*(keys[::-1] if knee is None else keys))
            if knee is not None:
                shape[f"knee_{i}"] = knee
                compliances.append(1 / (COMPLIANCE * stiffness))
        if "knee_2" in shape and shape.get("knee_1", math.inf) >= shape["knee_2"]:
            raise HdoptError(f"effects.{self.id}.knee_2_nm is {self.knee_2_nm:g}; it must lie above a knee_1_nm")
        variation = self.sine("variation_over_turn", "variation_phase_deg")
        if variation is not None:
            if shape:
                raise HdoptError(f"effects.{self.id} has both knees and variation_over_turn; give one of them")
            shape["angle"] = 1.0
            sine, cosine = (compliances[0] * c for c in variation)
            compliances += [cosine, sine]
        return AddedEffect(self.id, shape, tuple(compliances))

    @classmethod
    def keys(cls, effect, gear):
        if "angle" in effect.shape:
            first, cosine, sine = effect.coefficients
            size, phase = polar(sine / first, cosine / first)
            stiffness = 1 / (COMPLIANCE * first)
            return {
                "stiffness_1_nm_per_rad": stiffness,
                "variation_over_turn": size,
                "variation_phase_deg": phase,
            }
        # A free fit may pass its knees in the other order: the stretches are of the knees in theirs.
        knees = sorted(effect.shape[k] for k in ("knee_1", "knee_2") if k in effect.shape)
        found = {f"stiffness_{i + 1}_nm_per_rad": 1 / (COMPLIANCE * c) for i, c in enumerate(effect.coefficients)}
        return found | {f"knee_{i + 1}_nm": knee for i, knee in enumerate(knees)}


class Hysteresis(EffectSection):
    """[effects.hysteresis]: the directions lie two half loops apart; crossed over `transition_deg` of output angle."""

    id = "hysteresis"
    half_loop_arcmin: float
    transition_deg: Positive
    model: Literal[NAMES] = "dahl"

    def build(self, gear):
        shape = {"transition_deg": self.transition_deg, "law": float(NAMES.index(self.model))}
        return AddedEffect(self.id, shape, (self.half_loop_arcmin,))

    @classmethod
    def keys(cls, effect, gear):
        return {
            "half_loop_arcmin": effect.coefficients[0],
            "transition_deg": effect.shape["transition_deg"],
            "model": NAMES[int(effect.shape["law"])],
        }


class LostMotion(EffectSection):
    """[effects.lost_motion]: the full step at a reversal, crossed over as much travel as `crossing_arcmin` of output;
    it may vary `variation_order` times a turn by `variation_arcmin` sin(order theta + phase)."""

    id = "lost_motion"
    lost_motion_arcmin: float
    crossing_arcmin: NotNegative
    variation_order: Literal[1, 2, 4] | None = None
    variation_arcmin: NotNegative | None = None
    variation_phase_deg: float | None = None

    def build(self, gear):
        variation = self.sine("variation_arcmin", "variation_phase_deg")
        if (variation is None) != (self.variation_order is None):
            needed, by = ("variation_arcmin", "variation_order")[:: 1 if variation is None else -1]
            raise MissingValue(f"effects.{self.id}.{by}", f"effects.{self.id}.{needed}")
        shape = {"ramp_arcmin": self.crossing_arcmin}
        if variation is None:
            return AddedEffect(self.id, shape, (self.lost_motion_arcmin,))
        return AddedEffect(
            self.id, {**shape, "order": float(self.variation_order)}, (self.lost_motion_arcmin, *variation)
        )

    @classmethod
    def keys(cls, effect, gear):
        found = {"lost_motion_arcmin": effect.coefficients[0], "crossing_arcmin": effect.shape["ramp_arcmin"]}
        if "order" in effect.shape:
            size, phase = polar(*effect.coefficients[1:])
            order = int(effect.shape["order"])
            found |= {"variation_order": order, "variation_arcmin": size, "variation_phase_deg": phase}
        return found


class ThermalDrift(EffectSection):
    """[effects.thermal_drift]: with the temperature, or with the time since the start from cold."""

    id = "thermal_drift"
    coefficient_arcmin_per_k: float | None = None
    amplitude_arcmin: float | None = None
    time_constant_s: Positive | None = None

    def build(self, gear):
        follows = self.coefficient_arcmin_per_k is not None
        timed = self.amplitude_arcmin is not None and self.time_constant_s is not None
        whole = follows != timed and not (follows and (self.amplitude_arcmin or self.time_constant_s) is not None)
        if not whole:
            raise HdoptError(
                f"effects.{self.id} follows either the temperature or time; give coefficient_arcmin_per_k alone, or "
                "amplitude_arcmin and time_constant_s"
            )
        if follows:
            return AddedEffect(self.id, {}, (self.coefficient_arcmin_per_k,))
        return AddedEffect(self.id, {"time_constant_s": self.time_constant_s}, (self.amplitude_arcmin,))

    @classmethod
    def keys(cls, effect, gear):
        if "time_constant_s" not in effect.shape:
            return {"coefficient_arcmin_per_k": effect.coefficients[0]}
        return {"amplitude_arcmin": effect.coefficients[0], "time_constant_s": effect.shape["time_constant_s"]}


class Resonance(EffectSection):
    """[effects.resonance]: one torsional resonance that the drive's own error excites; gain 1: the whole inertia.

    A share of the damping acts on the output, the rest across the drive's spring.
    """

    id = "resonance"
    frequency_hz: Positive
    damping_ratio: float = Field(gt=0, lt=1)
    gain: float = 1.0
    output_share_of_damping: float = 0.0

    def build(self, gear):
        shape = {"frequency_hz": self.frequency_hz, "damping_ratio": self.damping_ratio}
        return AddedEffect(self.id, shape, (self.gain, self.gain * self.output_share_of_damping))

    @classmethod
    def keys(cls, effect, gear):
        shape = effect.shape
        return {
            "frequency_hz": shape["frequency_hz"],
            "damping_ratio": shape["damping_ratio"],
            "gain": effect.coefficients[0],
            "output_share_of_damping": effect.coefficients[1] / effect.coefficients[0],
        }


MS = 1e-3


class ChannelDelay(EffectSection):
    """[effects.channel_delay]: the output is read so much later than the input."""

    id = "channel_delay"
    delay_s: float

    def build(self, gear):
        return AddedEffect(self.id, {}, (self.delay_s / MS,))

    @classmethod
    def keys(cls, effect, gear):
        return {"delay_s": effect.coefficients[0] * MS}
