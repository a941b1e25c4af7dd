"""How an effect declares its numbers and categories: from this its study keys, its JSON and its docs derive.

Four kinds: a `Quantity` (a number with a unit, or a whole number), `Numbers` (a list of them), a `Category` (one of an
enumeration), and `Sines` (amplitude and phase of one or many sines). A `Quantity` with a `scale` is a coefficient of
the effect's columns; one without is of its shape.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from hdopt.errors import HdoptError, MissingValue

REQUIRED = object()
"""Default of a key that must be given; None is that of a key which may be left out."""

UM = 1e-3
"""mm in a micrometre."""


@dataclass(frozen=True)
class Quantity:
    """A number of an effect, under `key` in a study, in `unit` ('1' for a pure number).

    `above`, `below` (exclusive) and `at_least`, `at_most` (inclusive) are what a study may say; `prior` (low, high) is
    where real drives and benches have it, from which searches start and beyond which no name is plain. `reported` is
    its name in a diagnosis, where that differs. `scale`: its value at a coefficient of 1; None where it is a shape.
    """

    key: str
    unit: str
    meaning: str
    symbol: str = ""
    prior: tuple[float, float] | None = None
    default: object = REQUIRED
    above: float | None = None
    below: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    whole: bool = False
    reported: str = ""
    scale: float | None = None

    @property
    def name(self) -> str:
        """Its name in a diagnosis."""
        return self.reported or self.key

    @property
    def range_said(self) -> str:
        """What a study may say, in words; '' for any number."""
        low = f"above {self.above:g}" if self.above is not None else ""
        low = f"{self.at_least:g} or more" if self.at_least is not None else low
        high = f"below {self.below:g}" if self.below is not None else ""
        high = f"{self.at_most:g} or less" if self.at_most is not None else high
        if self.at_least is not None and self.at_most is not None:
            return f"{self.at_least:g} to {self.at_most:g}"
        return ", ".join(part for part in (low, high) if part)


@dataclass(frozen=True)
class Numbers:
    """A list of numbers in `unit` under `key` in a study, as one for each tooth of a spline; None where left out."""

    key: str
    unit: str
    meaning: str
    symbol: str = ""
    prior: tuple[float, float] | None = None
    default: object = None

    def given(self, keys: Mapping[str, object]) -> tuple[float, ...] | None:
        """The numbers that a study's `keys` hold, None where they are left out."""
        value = keys.get(self.key)
        return tuple(float(one) for one in value) if isinstance(value, list | tuple) else None


@dataclass(frozen=True)
class Category:
    """One of `choices`, under `key` in a study and in the JSON of a diagnosis."""

    key: str
    choices: type[StrEnum]
    meaning: str
    default: object = REQUIRED


@dataclass(frozen=True)
class Sines:
    """Sines a sin(x + phase), x an order times an angle: `members` maps each to its keys (amplitude, phase in deg).

    `scale` is the coefficient of one `unit` of amplitude. `shown` is how the docs write the keys of many.
    """

    members: Mapping[int, tuple[str, str]]
    unit: str
    meaning: str
    prior: tuple[float, float] | None = None
    scale: float = 1.0
    shown: str = ""
    optional: bool = field(default=False)

    def quantities(self) -> list[Quantity]:
        """Amplitudes and phases as numbers of their own."""
        default = None if self.optional or len(self.members) > 1 else REQUIRED
        found = []
        for amplitude, phase in self.members.values():
            found.append(Quantity(amplitude, self.unit, self.meaning, "a", self.prior, default, at_least=0.0))
            found.append(Quantity(phase, "deg", "its phase", "φ", default=default))
        return found

    def given(self, effect: str, keys: Mapping[str, object]) -> dict[int, tuple[float, float]]:
        """Coefficients (sine, cosine), in `unit`, of the sines that a study's `keys` hold.

        Raises `MissingValue` for an amplitude without a phase or the reverse.
        """
        found = {}
        for member, (amplitude, phase) in self.members.items():
            pair = sine_and_cosine(effect, keys, amplitude, phase)
            if pair is not None:
                found[member] = pair
        return found

    def coefficients(self, given: Mapping[int, tuple[float, float]], members: Iterable[int]) -> tuple[float, ...]:
        """Coefficients of these members in their order; one that is not given is zero."""
        return tuple(self.scale * c for member in members for c in given.get(member, (0.0, 0.0)))

    def written(self, members: Iterable[int], coefficients: Sequence[float]) -> dict[str, float]:
        """Keys of these members at their coefficients."""
        found: dict[str, float] = {}
        for i, member in enumerate(members):
            amplitude, phase = self.members[member]
            size, angle = polar(*coefficients[2 * i : 2 * i + 2])
            found |= {amplitude: size / self.scale, phase: angle}
        return found

    def some(self, effect: str, given: Mapping[int, object]) -> None:
        """Raises `HdoptError` where none is given."""
        if not given:
            amplitudes = [amplitude for amplitude, _ in self.members.values()]
            some = ", ".join(amplitudes[:3]) + (", ..." if len(amplitudes) > 3 else "")
            raise HdoptError(f"effects.{effect} has no amplitude; give at least one of {some} with its phase")


Declared = Quantity | Numbers | Category | Sines


def one_sine(unit: str, meaning: str, prior: tuple[float, float], scale: float = 1.0) -> Sines:
    """The one sine of an effect, `amplitude_UNIT` and `phase_deg`, with its `unit`, `meaning` and `prior` range in that
    unit, and the `scale` of its coefficients.
    """
    return Sines({1: (f"amplitude_{unit}", "phase_deg")}, unit, meaning, prior, scale)


def sine_and_cosine(effect: str, keys: Mapping[str, object], amplitude: str, phase: str) -> tuple[float, float] | None:
    """Coefficients of sine and cosine of the sine whose `amplitude` and `phase` (deg) are among the `keys` of
    [effects.EFFECT], `effect` its id; None where neither is given.

    Raises `MissingValue` where one of the two is.
    """
    size, angle = number(keys, amplitude), number(keys, phase)
    if size is None and angle is None:
        return None
    if size is None:
        raise MissingValue(f"effects.{effect}.{phase}", f"effects.{effect}.{amplitude}")
    if angle is None:
        raise MissingValue(f"effects.{effect}.{amplitude}", f"effects.{effect}.{phase}")
    return size * math.cos(math.radians(angle)), size * math.sin(math.radians(angle))


def number(keys: Mapping[str, object], key: str) -> float | None:
    """The number at `key` among a study's `keys`, None where it is not given."""
    value = keys.get(key)
    return float(value) if isinstance(value, int | float) else None


def needed(keys: Mapping[str, object], key: str) -> float:
    """The number at `key` among a study's `keys`, where the schema makes sure of it."""
    value = number(keys, key)
    if value is None:
        raise HdoptError(f"{key} is missing; give it")
    return value


def polar(sine: float, cosine: float) -> tuple[float, float]:
    """Amplitude and phase (deg) of a sin(x + phase) from its coefficients of sine and cosine."""
    return math.hypot(sine, cosine), math.degrees(math.atan2(cosine, sine))


def smallest_set(sets: Sequence[tuple[int, ...]], members: Iterable[int]) -> tuple[int, ...]:
    """The smallest of `sets` that has all `members`."""
    wanted = set(members)
    return min((candidate for candidate in sets if wanted <= set(candidate)), key=len)


class Shaft(StrEnum):
    """A shaft of the drive."""

    INPUT = "input"
    OUTPUT = "output"
