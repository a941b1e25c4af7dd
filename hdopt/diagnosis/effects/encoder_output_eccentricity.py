"""Output encoder off-centre: one sine an output turn; an elliptical code wheel adds two.

Reading error (2 e/D) sin(psi + phi) for eccentricity e on diameter D (412.5 arcsec e(um)/D(mm); HEIDENHAIN, "Angle
encoders"), psi the output angle; distortion of the wheel to an ellipse adds a sine of 2 psi, smaller than the first.
Units: arcmin. Prior: 0 to 5 arcmin.
"""

from __future__ import annotations

from hdopt.diagnosis.effects._once_per_turn import ShaftSine


class EncoderOutputEccentricity(ShaftSine):
    id = "encoder_output_eccentricity"
    variants = ((("output", 1),), (("output", 1), ("output", 2)))
    odds = (0.0, -1.0)
    separating = (
        "turn the output encoder on its shaft by half a turn, or read it with two opposite heads, and record a whole "
        "output turn again: its sine changes sign, the drive's own does not"
    )

    def least_turns(self, samples):
        return 0.2 * samples.ratio

    def sentence(self, parameters, rms_arcmin):
        return (
            f"The output encoder is off-centre: {parameters['amplitude_arcmin'].value:.2g} arcmin once an output turn."
        )
