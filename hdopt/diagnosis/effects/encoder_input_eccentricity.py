"""Input encoder off-centre: one sine an input turn, divided by N at the output.

A code wheel of diameter D whose centre lies e beside its axis is read wrong by (2 e/D) sin(theta + phi), that is
412.5 arcsec times e (um) over D (mm) (HEIDENHAIN, "Angle encoders", section on mounting accuracy: 412 e/D). At the
output it appears divided by N. Units: amplitude arcmin at the output. Prior: 0 to 2 arcmin.
"""

from __future__ import annotations

from hdopt.diagnosis.effects._once_per_turn import ShaftSine


class EncoderInputEccentricity(ShaftSine):
    id = "encoder_input_eccentricity"
    variants = ((("input", 1),),)
    odds = (0.0,)
    separating = "turn the input encoder on its shaft by half a turn and record again: its sine changes sign"

    def sentence(self, parameters, rms_arcmin):
        return (
            f"The input encoder runs off-centre: {parameters['amplitude_arcmin'].value:.2g} arcmin once an input turn "
            "as seen at the output."
        )
