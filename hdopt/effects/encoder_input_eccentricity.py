"""Input encoder off-centre: one sine an input turn, divided by N at the output.

A code wheel of diameter D whose centre lies e beside its axis is read wrong by (2 e/D) sin(theta + phi), that is
412.5 arcsec times e (um) over D (mm) (HEIDENHAIN, "Angle encoders", section on mounting accuracy: 412 e/D). At the
output it appears divided by N. Where it is read the drive stands N times that beside it: a diagnosis fits the drive,
its damaged teeth and its mesh there, a waveform that is computed from a study does not. Units: amplitude arcmin at the
output. Prior: 0 to 2 arcmin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hdopt.drive.geometry import DriveGeometry
from hdopt.effects._once_per_turn import ShaftSine
from hdopt.effects.base import Keys
from hdopt.effects.declared import Shaft, one_sine
from hdopt.effects.estimate import Parameter
from hdopt.effects.term import Shape

SINE = one_sine("arcmin", "once an input turn, at the output", prior=(0.0, 2.0))


class EncoderInputEccentricity(ShaftSine):
    id = "encoder_input_eccentricity"
    place = 70
    variants = ((Shaft.INPUT, (1,)),)
    separating = "turn the input encoder on its shaft by half a turn and record again: its sine changes sign"
    bench_part = "the input encoder"
    declared = (SINE,)
    examples = ({"amplitude_arcmin": 0.1, "phase_deg": 15.0},)

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        return self.shape_of(*self.variants[0]), SINE.coefficients(SINE.given(self.id, keys), (1,))

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        return dict(SINE.written((1,), coefficients))

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        return (
            f"The input encoder runs off-centre: {parameters['amplitude_arcmin'].value:.2g} arcmin once an input turn "
            "as seen at the output."
        )
