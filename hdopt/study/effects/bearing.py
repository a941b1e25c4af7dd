"""Ball passes of the wave generator's bearing."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from hdopt.diagnosis.effects.bearing_pass import BALLS, LINES, ZONE_HARMONICS, zone_orders
from hdopt.errors import HdoptError, MissingValue
from hdopt.extended import AddedEffect
from hdopt.study.effects.base import UM, SineSet, smallest_set, with_sine_keys

LINE_NAMES = ("cage", "odd_ball_half", "odd_ball", "outer_pass", "inner_pass")
UNEQUAL = 10
"""Numbers from here on name the harmonics of unequal balls, below it the five orders."""


@with_sine_keys
class BearingPass(SineSet):
    """[effects.bearing_pass]: either the sines of cage and balls at the output (`cage_arcmin`, ...), or the unequal
    balls met under the lobes (`unequal_2_um`, ..., harmonics of their place), um of arc in the meshing zones."""

    id = "bearing_pass"
    sines: ClassVar = {i: (f"{name}_arcmin", f"{name}_phase_deg") for i, name in enumerate(LINE_NAMES)} | {
        UNEQUAL + h: (f"unequal_{h}_um", f"unequal_{h}_phase_deg")
        for h in sorted({int(n) for n in BALLS} | {h for group in ZONE_HARMONICS for h in group})
    }
    ball_to_pitch_ratio: float = Field(gt=0, lt=1)
    balls: int | None = Field(default=None, ge=3, le=200)
    """Where a pass over the outer or the inner ring is given, or the wave of as many unequal balls."""

    def build(self, gear):
        given = self.given()
        unequal = [name - UNEQUAL for name in given if name >= UNEQUAL]
        shape = {"ball_to_pitch_ratio": self.ball_to_pitch_ratio}
        if len(unequal) == len(given):
            widest = max(ZONE_HARMONICS, key=len)
            if missing := [h for h in unequal if h not in widest and h != self.balls]:
                raise HdoptError(
                    f"effects.{self.id}.unequal_{missing[0]}_um: harmonics go from 1 to {len(widest)}, and beyond only "
                    "to that of as many balls; give balls, or leave it out"
                )
            index = smallest_set(ZONE_HARMONICS, [h for h in unequal if h != self.balls])
            shape |= {"balls": float(self.balls or 0), "zones": float(index)}
            arc = self.coefficients([UNEQUAL + h for h in zone_orders(shape)])
            return AddedEffect(self.id, shape, tuple(UM * c for c in arc))
        if unequal:
            raise HdoptError(
                f"effects.{self.id} has both sines at the output and unequal balls; give those in _arcmin or in _um"
            )
        if self.balls is None and max(given) >= 3:
            raise MissingValue(f"effects.{self.id}.{LINE_NAMES[max(given)]}_arcmin", f"effects.{self.id}.balls")
        index = smallest_set(LINES, list(given))
        shape |= {"balls": float(self.balls or 0), "lines": float(index)}
        return AddedEffect(self.id, shape, self.coefficients(LINES[index]))

    @classmethod
    def keys(cls, effect, gear):
        ratio = {"ball_to_pitch_ratio": effect.shape["ball_to_pitch_ratio"]}
        if "zones" in effect.shape:
            names = [UNEQUAL + h for h in zone_orders(effect.shape)]
            balls = {"balls": int(effect.shape["balls"])} if effect.shape["balls"] else {}
            return ratio | balls | cls.written(names, [c / UM for c in effect.coefficients])
        lines = LINES[int(effect.shape["lines"])]
        balls = {"balls": int(effect.shape["balls"])} if max(lines) >= 3 else {}
        return ratio | balls | cls.written(lines, effect.coefficients)
