"""Explanations without physics that compete with the catalogue: where one of them wins, the verdict is `unknown`.

A sine at any order, a sine at any frequency in time, a jump, a bump, an order whose size changes with time, an even
function of torque or speed, what answers either late, torque times the motion: each is a plain description of
structure, searched over all its shapes like an effect and charged like one. A catalogue effect that merely resembles
such a structure loses against it.
"""

from __future__ import annotations

from hdopt.diagnosis.alternatives.base import Alternative
from hdopt.diagnosis.alternatives.in_angle import AnyOrder, ChangingOrder
from hdopt.diagnosis.alternatives.in_time import AnyFrequency, Mains
from hdopt.diagnosis.alternatives.load import EvenLoad, LateLoad, LoadInMotion
from hdopt.diagnosis.alternatives.moments import Bump, Jump
from hdopt.diagnosis.alternatives.speed import EvenSpeed
from hdopt.diagnosis.alternatives.told import NewZero, Scale, Skew, VaryingContact
from hdopt.diagnosis.settings import AlternativeSettings

ALTERNATIVES: tuple[type[Alternative], ...] = (
    AnyOrder,
    AnyFrequency,
    Mains,
    Jump,
    Bump,
    ChangingOrder,
    EvenLoad,
    LateLoad,
    LoadInMotion,
    EvenSpeed,
    Scale,
    Skew,
    NewZero,
    VaryingContact,
)


def alternatives(settings: AlternativeSettings) -> tuple[Alternative, ...]:
    """Every description that competes with the catalogue, searched as `settings` say."""
    return tuple(one(settings) for one in ALTERNATIVES)
