"""[effects.ID]: physics left out of the base model, as data; and [operation], the condition it is evaluated at."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, create_model

from hdopt.drive import DriveGeometry
from hdopt.extended import AddedEffect, Operation
from hdopt.extended.operation import RPM
from hdopt.study.base import NotNegative, Positive, Section
from hdopt.study.effects.base import EffectSection
from hdopt.study.effects.bearing import BearingPass
from hdopt.study.effects.load import ChannelDelay, Hysteresis, LostMotion, Resonance, ThermalDrift, TorsionalWindup
from hdopt.study.effects.shafts import (
    EncoderInputEccentricity,
    EncoderInterpolation,
    EncoderOutputEccentricity,
    OutputCoupling,
)
from hdopt.study.effects.splines import (
    CircularSplineLobing,
    CircularSplineToothHarmonics,
    FlexsplineToothHarmonics,
    LocalToothDefect,
    ToothMesh,
)

EFFECT_SECTIONS: dict[str, type[EffectSection]] = {
    section.id: section
    for section in (
        CircularSplineToothHarmonics,
        FlexsplineToothHarmonics,
        ToothMesh,
        TorsionalWindup,
        Hysteresis,
        LostMotion,
        EncoderInputEccentricity,
        EncoderOutputEccentricity,
        EncoderInterpolation,
        OutputCoupling,
        BearingPass,
        CircularSplineLobing,
        ThermalDrift,
        Resonance,
        LocalToothDefect,
        ChannelDelay,
    )
}
"""Effect id -> the model of its [effects.ID]."""

EffectsSection = create_model(
    "EffectsSection",
    __base__=Section,
    __doc__="[effects]: a table for each effect of the catalogue, so that an unknown one is refused with the nearest.",
    **{name: (section | None, None) for name, section in EFFECT_SECTIONS.items()},
)


def added_effects(section: Section) -> dict[str, EffectSection]:
    """The effects that a study has, in the catalogue's order."""
    return {name: given for name in EFFECT_SECTIONS if (given := getattr(section, name)) is not None}


def effect_keys(effect: AddedEffect, gear: DriveGeometry) -> Mapping[str, Any]:
    """The keys of [effects.ID] that stand for an effect."""
    return EFFECT_SECTIONS[effect.id].keys(effect, gear)


class OperationSection(Section):
    """[operation]: how the drive runs where the effects are evaluated, and which effects count."""

    motion: Literal["forward", "backward", "both"] = "forward"
    output_torque_nm: float | None = None
    speed_rpm: Positive | None = None
    """Of the input."""
    temperature_difference_k: float | None = None
    time_s: NotNegative | None = None
    """Since the start from cold, when the motion begins."""
    include: Literal["all", "drive", "none"] | None = Field(default=None)
    """Which effects count: all, those of the drive and not of the bench, none. If omitted, `ke` counts all of them,
    tolerances and searches those of the drive."""

    def build(self) -> Operation:
        return Operation(
            self.motion,
            self.output_torque_nm,
            None if self.speed_rpm is None else RPM * self.speed_rpm,
            self.temperature_difference_k,
            self.time_s,
        )
