"""[effects.ID]: physics left out of the base model, as data; and [operation], the condition it is evaluated at.

The keys of every effect derive from what it declares (`hdopt.effects.declared`): nothing here knows one of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal  # Any: annotations and fields that pydantic takes

from pydantic import Field, create_model

from hdopt.drive.geometry import DriveGeometry
from hdopt.effects import EFFECTS
from hdopt.effects.base import Effect
from hdopt.effects.declared import REQUIRED, Category, Numbers, Quantity
from hdopt.simulation import EffectValues, Operation
from hdopt.simulation.operation import RPM
from hdopt.study.base import NotNegative, Positive, Section


class EffectSection(Section):
    """One effect of the catalogue, `id`, as a designer reads and edits it.

    Every sine is written a sin(x + phase), x its order times the input angle, with the input angle 0 of the model.
    """

    id: ClassVar[str] = ""

    def build(self, gear: DriveGeometry) -> EffectValues:
        """The effect with the numbers of this section, on a drive with this `gear`."""
        given = {name: value for name in type(self).model_fields if (value := getattr(self, name)) is not None}
        return EffectValues(self.id, *EFFECTS[self.id].values(given, gear))


def section_of(effect: Effect) -> type[EffectSection]:
    """The model of [effects.ID] of an `effect`: a field for each key that it declares."""
    fields: dict[str, Any] = {item.key: _field(item) for item in effect.flat_declared()}
    named = type(effect.id, (EffectSection,), {"id": effect.id, "__annotations__": {"id": "ClassVar[str]"}})
    return create_model(type(effect).__name__, __base__=named, __doc__=f"[effects.{effect.id}]", **fields)


def _field(item: Quantity | Numbers | Category) -> tuple[Any, Any]:
    """Type and default of one key."""
    default = ... if item.default is REQUIRED else item.default
    if isinstance(item, Category):
        kind: Any = Literal[tuple(str(choice) for choice in item.choices)]
        return kind, default if default is ... or default is None else str(default)
    if isinstance(item, Numbers):
        return list[float] | None, None
    kind = int if item.whole else float
    if default is None:
        kind = kind | None
    return kind, Field(default=default, gt=item.above, lt=item.below, ge=item.at_least, le=item.at_most)


EFFECT_SECTIONS: dict[str, type[EffectSection]] = {name: section_of(effect) for name, effect in EFFECTS.items()}
"""Effect id -> the model of its [effects.ID]."""

_TABLES: dict[str, Any] = {name: (section | None, None) for name, section in EFFECT_SECTIONS.items()}
EffectsSection = create_model(
    "EffectsSection",
    __base__=Section,
    __doc__="[effects]: a table for each effect of the catalogue, so that an unknown one is refused with the nearest.",
    **_TABLES,
)


def added_effects(section: Section) -> dict[str, EffectSection]:
    """The effects that a study's [effects], `section`, has, in the catalogue's order."""
    return {name: given for name in EFFECT_SECTIONS if (given := getattr(section, name)) is not None}


def effect_keys(effect: EffectValues, gear: DriveGeometry) -> Mapping[str, Any]:
    """The keys of [effects.ID] that stand for an `effect` on a drive with this `gear`."""
    return EFFECTS[effect.id].keys(effect.shape, effect.coefficients, gear)


class OperationSection(Section):
    """[operation]: how the drive runs where the effects are evaluated, and which effects count."""

    motion: Literal["forward", "backward", "both"] = "forward"
    """Which way the input turns; both: one full relative turn there and back."""
    output_torque_nm: float | None = None
    """Constant torque at the output."""
    speed_rpm: Positive | None = None
    """Of the input."""
    temperature_difference_k: float | None = None
    """From the reference at which the error was zero."""
    time_s: NotNegative | None = None
    """Since the start from cold, when the motion begins."""
    include: Literal["all", "drive", "none"] | None = Field(default=None)
    """Which effects count: all, those of the drive and not of the bench, none. If omitted, `ke` counts all of them,
    tolerances and searches those of the drive."""

    def build(self) -> Operation:
        """The condition with the numbers of this section."""
        return Operation(
            self.motion,
            self.output_torque_nm,
            None if self.speed_rpm is None else RPM * self.speed_rpm,
            self.temperature_difference_k,
            self.time_s,
        )
