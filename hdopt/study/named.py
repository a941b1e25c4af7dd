"""Which values and keys of a study a message speaks of: those that it shows or names, with file and line."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any  # Any: what a study file holds, of TOML's several kinds

from hdopt.study.document import Document, leaves
from hdopt.study.nearest import UNIT
from hdopt.toml_lines import Keys

NUMBER = re.compile(r"(?<![\w./\\])(?<!\w-)[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
"""A number: digits of a name, as of csf-25-80 and of folders, are none."""
EXAMPLE = re.compile(r"\b(?:such as|as in|as with|for example)\b[^;]*")
"""What a message shows for its reader to write: numbers there are nobody's."""
LINE = re.compile(r"\blines? \d+(?:(?:, \d+)*(?:,? (?:and|to) \d+)?)")
"""Where something stands in a file: no number of a study."""
KEY = re.compile(r"(?<![\w.\-/])[a-z]\w*(?:\.\w+)+|\[(\w+)\](?: (\w+))?")
"""A key as messages name it: export.bore_mm, [tolerances], [tolerances] axis_tilt_x_deg."""
COMMON = 100
"""Whole numbers up to this stand in many a message and many a study: they are taken only beside their key's name."""

LITTLE = ("to", "of", "at", "in", "by")
"""Words in names of keys that stand in any message."""

MOST_ALIKE = 3
"""Places of one value that a message may name where it shows no other."""
DIGITS = range(6, 18)
"""Significant digits with which a message may show a number; what they round to a whole number is another one."""


def numbers_in(message: str) -> set[float]:
    """The numbers that stand in `message`, but in its examples and those of lines; a comma or a full stop that follows
    is none of them."""
    return {float(found) for found in NUMBER.findall(LINE.sub("", EXAMPLE.sub("", message)))}


def without_numbers(message: str, values: Iterable[float]) -> str:
    """`message` without the numbers that are one of `values`: they are spoken for."""
    known = set(values)
    return NUMBER.sub(lambda found: "" if float(found[0]) in known else found[0], message)


def shows(message: str, value: Any, name: str) -> bool:
    """Whether `message` speaks of the number `value` of the key `name`: it holds the number, and a part of the name or
    a number that is not common."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    if not math.isfinite(value):
        return _speaks_of(name, message) and re.search(rf"(?<!\w){value}\b", message) is not None
    rounded = {float(f"{value:.{digits}g}") for digits in DIGITS}
    if not ({float(value)} | {one for one in rounded if not one.is_integer()}) & numbers_in(message):
        return False
    common = float(value).is_integer() and abs(value) <= COMMON
    return not common or _speaks_of(name, message)


def _speaks_of(name: str, message: str) -> bool:
    """Whether `message` has a part of the `name`, with any end where it has three letters or more: but for its unit and
    little words, which stand in any message. A single letter is a name where it is written as one, 'a = 2', 'n is 1' or
    'cost.a'.
    """
    if len(name) == 1:
        return re.search(rf"(?<![\w.]){name}(?: ?=| is\b)|\.{name}\b", message) is not None
    parts = [part for part in re.split(r"[_\-]", UNIT.sub("", name)) if part and part not in LITTLE]
    return any(re.search(rf"\b{part}" + ("" if len(part) > 2 else r"\b"), message) for part in parts)


def values_named(document: Document, message: str) -> tuple[str, ...]:
    """Where in `document` the values stand that `message` shows, 'FILE, line N, a.b' each; a value that stands there
    more than once is left out beside one that does not, and above three places; of several, those stand whose name
    `message` speaks of."""
    shown: dict[float, list[Keys]] = {}
    for path in leaves(document.data):
        value = _at(document.data, path)
        if _stands(document, path) and shows(message, value, path[-1]):
            shown.setdefault(float(value), []).append(path)
    meant = [[path for path in paths if _speaks_of(path[-1], message)] or paths for paths in shown.values()]
    alone = [paths for paths in meant if len(paths) == 1]
    several = [paths for paths in meant if len(paths) <= MOST_ALIKE]
    return tuple(document.where(path) for paths in alone or several for path in paths)


def keys_named(document: Document, message: str) -> tuple[str, ...]:
    """Where in `document` the keys and sections stand that `message` names, 'FILE, line N, a.b' each."""
    return tuple(map(document.where, keys_of(document, message)))


def keys_of(document: Document, message: str) -> tuple[Keys, ...]:
    """The keys and sections of `document` that `message` names; keys that it does not have, and those of examples, are
    left out."""
    found: dict[Keys, None] = {}
    for named in KEY.finditer(EXAMPLE.sub("", message)):
        section, key = named.groups()
        path = tuple(named.group().split(".")) if section is None else (section,)
        for longest in (path, (*path, key or "")):
            if longest in document.lines:
                found.pop(path, None)
                found[longest] = None
    return tuple(found)


def places_named(document: Document, message: str) -> tuple[str, ...]:
    """Where in `document` to look for what `message` says: at the values that it shows, then at the keys it names. A
    value of a key that is named is that key's, whatever else is as large."""
    named = keys_of(document, message)
    values = (_at(document.data, path) for path in named)
    own = {float(value) for value in values if isinstance(value, int | float) and not isinstance(value, bool)}
    shown = values_named(document, without_numbers(message, own))
    return tuple(dict.fromkeys((*shown, *map(document.where, named))))


def _stands(document: Document, path: Keys) -> bool:
    return any(path[:depth] in document.lines for depth in range(len(path), 0, -1))


def _at(data: Mapping[str, Any], path: Keys) -> Any:
    for part in path:
        data = data[part]
    return data
