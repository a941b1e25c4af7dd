"""The catalogue: one module an effect, behind `hdopt.diagnosis.effect.Effect`."""

from __future__ import annotations

from hdopt.diagnosis.effects.bearing_pass import BearingPass
from hdopt.diagnosis.effects.channel_delay import ChannelDelay
from hdopt.diagnosis.effects.circular_spline_lobing import CircularSplineLobing
from hdopt.diagnosis.effects.cs_tooth_harmonics import CircularSplineToothHarmonics
from hdopt.diagnosis.effects.encoder_input_eccentricity import EncoderInputEccentricity
from hdopt.diagnosis.effects.encoder_interpolation import EncoderInterpolation
from hdopt.diagnosis.effects.encoder_output_eccentricity import EncoderOutputEccentricity
from hdopt.diagnosis.effects.fs_tooth_harmonics import FlexsplineToothHarmonics
from hdopt.diagnosis.effects.hysteresis import Hysteresis
from hdopt.diagnosis.effects.local_tooth_defect import LocalToothDefect
from hdopt.diagnosis.effects.lost_motion import LostMotion
from hdopt.diagnosis.effects.output_coupling import OutputCoupling
from hdopt.diagnosis.effects.resonance import Resonance
from hdopt.diagnosis.effects.thermal_drift import ThermalDrift
from hdopt.diagnosis.effects.tooth_mesh import ToothMesh
from hdopt.diagnosis.effects.torsional_windup import TorsionalWindup

EFFECTS = {
    effect.id: effect
    for effect in (
        CircularSplineToothHarmonics(),
        FlexsplineToothHarmonics(),
        ToothMesh(),
        TorsionalWindup(),
        Hysteresis(),
        LostMotion(),
        EncoderInputEccentricity(),
        EncoderOutputEccentricity(),
        EncoderInterpolation(),
        OutputCoupling(),
        BearingPass(),
        CircularSplineLobing(),
        ThermalDrift(),
        Resonance(),
        LocalToothDefect(),
        ChannelDelay(),
    )
}
"""Effect id -> effect; the ids are part of the interface."""

HIGH_ORDER = tuple(effect.id for effect in EFFECTS.values() if getattr(effect, "high_order", False))
"""Effects of so many waves a turn that they are looked for on the rows as recorded too."""
