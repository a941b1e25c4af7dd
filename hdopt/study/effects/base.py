"""What every [effects.ID] shares: keys in the units of a drawing or a recording, and the way to and from an effect."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from pydantic import create_model

from hdopt.drive import DriveGeometry
from hdopt.errors import HdoptError, MissingValue
from hdopt.extended import AddedEffect
from hdopt.study.base import NotNegative, Section

UM = 1e-3
"""mm in a micrometre."""


class EffectSection(Section):
    """One effect of the catalogue, `id`, as a designer reads and edits it.

    Every sine is written a sin(x + phase), x its order times the input angle, with the input angle 0 of the model.
    """

    id: ClassVar[str] = ""

    @abstractmethod
    def build(self, gear: DriveGeometry) -> AddedEffect:
        """The effect with the numbers of this section."""

    @classmethod
    @abstractmethod
    def keys(cls, effect: AddedEffect, gear: DriveGeometry) -> dict[str, Any]:
        """The inverse: the keys that stand for an effect."""

    def sine(self, amplitude: str, phase: str) -> tuple[float, float] | None:
        """Coefficients of sine and cosine of the sine with these keys; None where it is not given."""
        size, angle = getattr(self, amplitude), getattr(self, phase)
        if size is None:
            if angle is not None:
                raise MissingValue(f"effects.{self.id}.{phase}", f"effects.{self.id}.{amplitude}")
            return None
        if angle is None:
            raise MissingValue(f"effects.{self.id}.{amplitude}", f"effects.{self.id}.{phase}")
        return size * math.cos(math.radians(angle)), size * math.sin(math.radians(angle))


def polar(sine: float, cosine: float) -> tuple[float, float]:
    """Amplitude and phase (deg) of a sin(x + phase) from its coefficients of sine and cosine."""
    return math.hypot(sine, cosine), math.degrees(math.atan2(cosine, sine))


class SineSet(EffectSection):
    """An effect of some sines out of many: `sines` maps what the effect calls each to its keys (amplitude, phase)."""

    sines: ClassVar[dict[int, tuple[str, str]]] = {}
    unit: ClassVar[float] = 1.0
    """What one of the amplitude's unit is in a coefficient's."""

    def given(self) -> dict[int, tuple[float, float]]:
        """Coefficients of the sines that are given."""
        found = {name: pair for name, keys in self.sines.items() if (pair := self.sine(*keys)) is not None}
        if not found:
            amplitudes = [amplitude for amplitude, _ in self.sines.values()]
            some = ", ".join(amplitudes[:3]) + (", ..." if len(amplitudes) > 3 else "")
            raise HdoptError(f"effects.{self.id} has no amplitude; give at least one of {some} with its phase")
        return found

    def coefficients(self, members: Sequence[int]) -> tuple[float, ...]:
        """Coefficients of these sines in their order; one that is not given is zero."""
        given = self.given()
        return tuple(self.unit * c for name in members for c in given.get(name, (0.0, 0.0)))

    @classmethod
    def written(cls, members: Sequence[int], coefficients: Sequence[float]) -> dict[str, float]:
        """Keys of these sines."""
        found: dict[str, float] = {}
        for i, name in enumerate(members):
            amplitude, phase = cls.sines[name]
            size, found_phase = polar(*coefficients[2 * i : 2 * i + 2])
            found |= {amplitude: size / cls.unit, phase: found_phase}
        return found


def smallest_set(sets: Sequence[Sequence[int]], members: Sequence[int]) -> int:
    """Index of the smallest of `sets` that has all `members`."""
    fitting = [i for i, candidate in enumerate(sets) if set(members) <= set(candidate)]
    return min(fitting, key=lambda i: len(sets[i]))


def with_sine_keys(section: type[SineSet]) -> type[SineSet]:
    """`section` with a field for every amplitude and phase of its sines."""
    fields: dict[str, Any] = {}
    for amplitude, phase in section.sines.values():
        fields |= {amplitude: (NotNegative | None, None), phase: (float | None, None)}
    return create_model(section.__name__, __base__=section, __doc__=section.__doc__, **fields)
