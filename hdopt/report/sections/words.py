"""Small words shared by the sections: names made readable, numbers with their units."""

from __future__ import annotations

from collections.abc import Sequence

from hdopt.effects import EFFECTS


def label(name: str) -> str:
    """A name from the code as a heading: 'one_way_major' reads 'One-way, major axis'."""
    known = {
        "one_way_major": "One-way, major axis",
        "one_way_minor": "One-way, minor axis",
        "automatic": "Automatic alignment",
        "two_disk": "Two-disk",
    }
    if name in EFFECTS:
        return EFFECTS[name].heading
    return known.get(name, name.replace("_", " ")[:1].upper() + name.replace("_", " ")[1:])


def in_sentence(name: str) -> str:
    """The heading `name` as it stands within a sentence: its first letter small, unless it begins an abbreviation."""
    return name[:1].lower() + name[1:] if name[1:2].islower() or name[1:2] == " " else name


def short(value: float) -> str:
    """`value` in three digits, and a large number written out: '0.0153', '1784'."""
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def listed(words: Sequence[str]) -> str:
    """'a', 'a and b', 'a, b and c'; nothing of no words."""
    if not words:
        return ""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last
