"""Output encoder off-centre: one sine an output turn; an elliptical code wheel adds two.

Reading error (2 e/D) sin(psi + phi) for eccentricity e on diameter D (412.5 arcsec e(um)/D(mm); HEIDENHAIN, "Angle
encoders"), psi the output angle; distortion of the wheel to an ellipse adds a sine of 2 psi, smaller than the first.
Units: arcmin. Prior: 0 to 5 arcmin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hdopt.drive.geometry import DriveGeometry
from hdopt.effects._once_per_turn import ShaftSine
from hdopt.effects.base import Keys
from hdopt.effects.declared import Shaft, Sines
from hdopt.effects.estimate import Parameter
from hdopt.effects.term import Shape

SINES = Sines(
    {1: ("amplitude_arcmin", "phase_deg"), 2: ("amplitude_output_2_arcmin", "phase_output_2_deg")},
    "arcmin",
    "once an output turn, x = θ/N; `_output_2` twice, of an elliptical wheel",
    prior=(0.0, 5.0),
)


class EncoderOutputEccentricity(ShaftSine):
    id = "encoder_output_eccentricity"
    place = 80
    variants = ((Shaft.OUTPUT, (1,)), (Shaft.OUTPUT, (1, 2)))
    odds = (0.0, -1.0)
    least_output_turns = 0.2
    separating = (
        "turn the output encoder on its shaft by half a turn, or read it with two opposite heads, and record a whole "
        "output turn again: its sine changes sign, the drive's own does not"
    )
    bench_part = "the output encoder"
    declared = (SINES,)
    examples = (
        {"amplitude_arcmin": 0.1, "phase_deg": 15.0},
        {
            "amplitude_arcmin": 0.1,
            "phase_deg": 15.0,
            "amplitude_output_2_arcmin": 0.04,
            "phase_output_2_deg": 70.0,
        },
    )

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        given = SINES.given(self.id, keys)
        SINES.some(self.id, given)
        orders = (1, 2) if 2 in given else (1,)
        return self.shape_of(Shaft.OUTPUT, orders), SINES.coefficients(given, orders)

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        return dict(SINES.written(shape["orders"], coefficients))

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        return (
            f"The output encoder is off-centre: {parameters['amplitude_arcmin'].value:.2g} arcmin once an output turn."
        )

    def may_be_part_of(self, parameters: Mapping[str, Parameter]) -> tuple[str, ...]:
        """A coupling, where a wheel would be more oval than it is off-centre."""
        oval = parameters.get("amplitude_output_2_arcmin")
        return ("output_coupling",) if oval is not None and oval.low > parameters["amplitude_arcmin"].high else ()
