"""Ball passes of the wave generator's bearing."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from hdopt.diagnosis.effects.bearing_pass import LINES, ZONE_HARMONICS
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
        for h in sorted({h for group in ZONE_HARMONICS for h in group})
    }
    ball_to_pitch_ratio: float = Field(gt=0, lt=1)
    balls: int | None = Field(default=None, ge=3, le=200)
    """Where a pass over the outer or the inner ring is given."""

    def build(self, gear):
        given = self.given()
        unequal = [name - UNEQUAL for name in given if name >= UNEQUAL]
        shape = {"ball_to_pitch_ratio": self.ball_to_pitch_ratio}
        if len(unequal) == len(given):
            index = smallest_set(ZONE_HARMONICS, unequal)
            arc = self.coefficients([UNEQUAL + h for h in ZONE_HARMONICS[index]])
            return AddedEffect(self.id, {**shape, "balls": 0.0, "zones": float(index)}, tuple(UM * c for c in arc))
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
            harmonics = ZONE_HARMONICS[int(effect.shape["zones"])]
            return ratio | cls.written([UNEQUAL + h for h in harmonics], [c / UM for c in effect.coefficients])
        lines = LINES[int(effect.shape["lines"])]
        balls = {"balls": int(effect.shape["balls"])} if max(lines) >= 3 else {}
        return ratio | balls | cls.written(lines, effect.coefficients)
