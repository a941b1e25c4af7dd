"""Which value of a study lies farthest from what is usual: the one to look at where numbers lead to no result."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median
from typing import Any  # Any: what a study file holds, of TOML's several kinds

from hdopt.study.document import SET_ON_COMMAND_LINE, Document, leaves
from hdopt.toml_lines import Keys

NOTHING = 400.0
"""Decades by which 0 is off where something else is usual: more than any two finite numbers are apart."""
SIGN = 1.0
"""Decades that a change of sign counts for."""
ASKED = 1.0
"""Decades by which a value that --set gave is suspected the more: it is what was changed last."""
KNOWN_TO = 6.0
"""Decades around 1 in which a value is usual that nothing tells more about."""
FAR = 1.0
"""Decades from which a value is worth naming; costs of one study differ by half of that."""


@dataclass(frozen=True)
class Number:
    """The number at `path` of a study, and by how many `decades` it is off."""

    path: Keys
    value: float
    decades: float


def farthest(document: Document, usual: Mapping[str, Any]) -> str:
    """The place of the value of `document` that lies farthest from the `usual` ones (the data of a shipped study), with
    the value: 'FILE, line N, a.b (1e-14, the value farthest from what is usual)'. The file alone where all are usual.

    What `usual` does not have is held against the document's other values of the same name; what has none of these,
    against 1.
    """
    numbers = list(_numbers(document.data))
    own = [(path, value) for path, value in numbers if _line(document, path) is not None]
    found = [_judged(path, value, _reference(path, numbers, usual), document) for path, value in own]
    worst = max(found, key=lambda number: number.decades, default=None)
    if worst is None or worst.decades < FAR:
        return document.source
    return f"{document.where(worst.path)} ({worst.value!r}, the value farthest from what is usual)"


def _line(document: Document, path: Keys) -> int | None:
    """Line of the key at `path`, or of the table in one line that it stands in; None where the file has neither."""
    depths = range(len(path), 0, -1)
    return next((document.lines[path[:depth]] for depth in depths if path[:depth] in document.lines), None)


def _numbers(data: Mapping[str, Any]) -> list[tuple[Keys, float]]:
    found = ((path, _at(data, path)) for path in leaves(data))
    return [(path, value) for path, value in found if isinstance(value, int | float) and not isinstance(value, bool)]


def _at(data: Any, path: Keys) -> Any:
    for part in path:
        data = data.get(part) if isinstance(data, Mapping) else None
    return data


def _reference(path: Keys, numbers: list[tuple[Keys, float]], usual: Mapping[str, Any]) -> float | None:
    shipped = _at(usual, path)
    if isinstance(shipped, int | float):
        return float(shipped)
    alike = [abs(value) for other, value in numbers if other[-1] == path[-1] and other != path]
    return median(alike) if alike else None


def _judged(path: Keys, value: float, reference: float | None, document: Document) -> Number:
    asked = ASKED if _line(document, path) == SET_ON_COMMAND_LINE else 0.0
    if reference is None or reference == 0:
        off = 0.0 if value == 0 else max(0.0, abs(math.log10(abs(value))) - KNOWN_TO)
    elif value == 0:
        off = NOTHING
    else:
        off = abs(math.log10(abs(value)) - math.log10(abs(reference))) + SIGN * (value * reference < 0)
    return Number(path, value, off + asked)
