"""Flexspline tooth deviation that is not one sine round the rim.

As for the circular spline (Jia 2021, Eqs. (31a), (31b) carried to harmonics h = 2, 3, ...), but the FS tooth under the
major axis advances by Z_CS/Z_FS = 1 + 1/N of the input angle, so the orders are h (1 + 1/N). Units: amplitude um of
arc, prior 0 to 10 um.
"""

from __future__ import annotations

from hdopt.diagnosis.effects.cs_tooth_harmonics import CircularSplineToothHarmonics


class FlexsplineToothHarmonics(CircularSplineToothHarmonics):
    id = "fs_tooth_harmonics"
    separating = (
        "record one whole output turn (N input turns) or more: only then do orders h(1 + 1/N) of the flexspline stand "
        "apart from orders h of the circular spline"
    )
    spline = "flexspline"

    def lacks(self, samples):
        need = samples.ratio / 8
        return None if samples.span_turns >= min(need, 10) else f"at least {min(need, 10):.0f} input turns"

    @staticmethod
    def stands_alone(members):
        return True

    def orders(self, term, ratio):
        return [h * (1 + 1 / ratio) for h in super().orders(term, ratio)]

    def phase(self, samples):
        return samples.theta * (1 + 1 / samples.ratio)
