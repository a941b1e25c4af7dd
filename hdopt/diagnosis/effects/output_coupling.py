"""Bent universal joint or misaligned coupling: twice a turn of its shaft.

A Cardan joint bent by beta turns by tan(psi_out) = tan(psi_in)/cos(beta) (any text on mechanisms, e.g. Shigley), that
is an error of about (beta^2/4) sin 2 psi. At the output shaft this is order 2/N; at the input shaft order 2, divided
by N. Units: amplitude arcmin at the output. Prior: beta 0 to 10 deg.
"""

from __future__ import annotations

from hdopt.diagnosis.effects._once_per_turn import ShaftSine


class OutputCoupling(ShaftSine):
    id = "output_coupling"
    variants = ((("output", 2),), (("input", 2),))
    odds = (0.0, -2.0)
    separating = (
        "turn the coupling on its shaft by a quarter turn, or couple without it, and record a whole output turn again"
    )

    def least_turns(self, samples):
        return 0.15 * samples.ratio

    def sentence(self, parameters, rms_arcmin):
        return (
            f"A coupling runs bent: {parameters['amplitude_arcmin'].value:.2g} arcmin twice a turn of its shaft, as a "
            "universal joint makes."
        )
