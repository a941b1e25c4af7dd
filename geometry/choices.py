"""The sizes that a study gives of what is to be made, and those that a rule finds because it does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from hdopt.geometry.budget import Bounds
from hdopt.geometry.model import Assumption
from hdopt.geometry.options import RULES, ExportOptions

T = TypeVar("T")


@dataclass
class Choices:
    """Reads the `options` and remembers which values were not given; `bounds` limit eccentricity and tilt."""

    options: ExportOptions
    bounds: Bounds
    assumptions: list[Assumption] = field(default_factory=list)

    def take(self, key: str, rule: Callable[[], T]) -> T:
        """The value of an option, or what `rule` makes of it where nobody gave one."""
        given: T | None = getattr(self.options, key)
        if given is not None:
            return given
        name = f"export.{key}"
        if (known := next((a for a in self.assumptions if a.key == name), None)) is not None:
            before: T = known.value
            return before
        value = rule()
        self.assumptions.append(Assumption(name, value, RULES[key]))
        return value
