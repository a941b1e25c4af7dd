"""Bent universal joint or misaligned coupling: twice a turn of its shaft.

A Cardan joint bent by beta turns by tan(psi_out) = tan(psi_in)/cos(beta) (any text on mechanisms, e.g. Shigley), that
is an error of about (beta^2/4) sin 2 psi. At the output shaft this is order 2/N; at the input shaft order 2, divided
by N. Units: amplitude arcmin at the output. Prior: beta 0 to 10 deg, which makes 0 to 26 arcmin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hdopt.drive.geometry import DriveGeometry
from hdopt.effects._once_per_turn import ShaftSine
from hdopt.effects.base import Keys
from hdopt.effects.declared import Category, Shaft, one_sine
from hdopt.effects.estimate import Parameter
from hdopt.effects.term import Shape

SINE = one_sine("arcmin", "twice a turn of it, at the output", prior=(0.0, 26.0))


class OutputCoupling(ShaftSine):
    id = "output_coupling"
    place = 100
    variants = ((Shaft.OUTPUT, (2,)), (Shaft.INPUT, (2,)))
    odds = (0.0, -2.0)
    least_output_turns = 0.15
    separating = (
        "turn the coupling on its shaft by a quarter turn, or couple without it, and record a whole output turn again"
    )
    bench_part = "a coupling between drive and encoder"
    declared = (Category("shaft", Shaft, "the shaft that it couples", default=Shaft.OUTPUT), SINE)
    examples = (
        {"shaft": "output", "amplitude_arcmin": 0.1, "phase_deg": 15.0},
        {"shaft": "input", "amplitude_arcmin": 0.1, "phase_deg": 15.0},
    )

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        shape = self.shape_of(Shaft(str(keys["shaft"])), (2,))
        return shape, SINE.coefficients(SINE.given(self.id, keys), (1,))

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        return {"shaft": str(shape["shaft"]), **SINE.written((1,), coefficients)}

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        return (
            f"A coupling runs bent: {parameters['amplitude_arcmin'].value:.2g} arcmin twice a turn of its shaft, as a "
            "universal joint makes."
        )
