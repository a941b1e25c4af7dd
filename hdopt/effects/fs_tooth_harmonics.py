"""Flexspline tooth deviation that is not one sine round the rim.

As for the circular spline (Jia 2021, Eqs. (31a), (31b) carried to harmonics h = 2, 3, ...), but the FS tooth under the
major axis advances by Z_CS/Z_FS = 1 + 1/N of the input angle, so the orders are h (1 + 1/N). Units: amplitude um of
arc, prior 0 to 10 um.
"""

from __future__ import annotations

from hdopt.effects.conditions import Conditions
from hdopt.effects.cs_tooth_harmonics import CircularSplineToothHarmonics
from hdopt.effects.met import Spline
from hdopt.effects.term import Shape


class FlexsplineToothHarmonics(CircularSplineToothHarmonics):
    id = "fs_tooth_harmonics"
    place = 20
    title = "FS tooth harmonics"
    separating = (
        "record one whole output turn (N input turns) or more: only then do orders h(1 + 1/N) of the flexspline stand "
        "apart from orders h of the circular spline"
    )
    part = "flexspline"
    spline = Spline.FLEX
    examples = ({"amplitude_2_um": 1.0, "phase_2_deg": 100.0},)

    def lacks(self, conditions: Conditions) -> str | None:
        need = min(conditions.ratio / 8, 10)
        return None if conditions.span_turns >= need else f"at least {need:.0f} input turns"

    @staticmethod
    def stands_alone(members: tuple[int, ...]) -> bool:
        """No lobe of the clamping has these orders: one wave alone may be said."""
        return True

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        return [h * (1 + 1 / ratio) for h in super().orders(shape, ratio)]
