"""The tables of the effects in the docs, from what each effect declares.

`python -m hdopt.workflow.effect_docs docs/conventions.md` writes them between their two marks.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from hdopt.effects import EFFECTS
from hdopt.effects.base import Effect
from hdopt.effects.declared import REQUIRED, Category, Declared, Numbers, Sines
from hdopt.files import write_text

START = "<!-- written by: python -m hdopt.workflow.effect_docs docs/conventions.md -->"
END = "<!-- end of the effects -->"


def keys_table(effects: Iterable[Effect]) -> list[str]:
    """A row for each of `effects`: its study keys, where it acts, whose it is, what it needs."""
    rows = ["| `[effects.ID]` | keys | where | of the | needs |", "|---|---|---|---|---|"]
    for effect in effects:
        keys = "; ".join(_keys_of(item) for item in effect.declared)
        rows.append(f"| `{effect.id}` | {keys} | {effect.acts} | {effect.origin} | {_needs(effect)} |")
    return rows


def numbers_table(effects: Iterable[Effect]) -> list[str]:
    """A row for each number and category that `effects` declare: symbol, unit, what a study may say, prior, meaning."""
    rows = ["| effect | key | symbol | unit | a study may say | prior | meaning |", "|---|---|---|---|---|---|---|"]
    return rows + [f"| `{effect.id}` | {_cells(item)} |" for effect in effects for item in effect.declared]


def _keys_of(item: Declared) -> str:
    if isinstance(item, Sines):
        return item.shown or ", ".join(f"`{key}`" for pair in item.members.values() for key in pair)
    if isinstance(item, Category):
        return f"`{item.key}`: " + ", ".join(f"`{choice}`" for choice in item.choices) + _default(item.default)
    return f"`{item.key}`" + _default(item.default)


def _default(value: object) -> str:
    if value is REQUIRED:
        return ""
    return " (may be left out)" if value is None else f" ({value} if omitted)"


def _needs(effect: Effect) -> str:
    if effect.needs_said:
        return effect.needs_said
    return ", ".join([*effect.needs, *(["motion"] if effect.domain == "reversal" else [])])


def _cells(item: Declared) -> str:
    if isinstance(item, Category):
        return f"`{item.key}` | | | one of {len(item.choices)} | | {item.meaning}"
    prior = "" if item.prior is None else f"{item.prior[0]:g} to {item.prior[1]:g}"
    if isinstance(item, Sines):
        return f"{_keys_of(item)} | a, φ | {item.unit}, deg | 0 or more | {prior} | {item.meaning}"
    if isinstance(item, Numbers):
        return f"`{item.key}` | {item.symbol} | {item.unit} | a list of numbers | {prior} | {item.meaning}"
    whole = "whole number" if item.whole else ""
    said = ", ".join(part for part in (whole, item.range_said) if part) or "any number"
    unit = "" if item.unit == "1" else item.unit
    return f"`{item.key}` | {item.symbol} | {unit} | {said} | {prior} | {item.meaning}"


def tables() -> str:
    """Both tables of the whole catalogue, with a line between them."""
    effects = list(EFFECTS.values())
    between = "In numbers; the prior is where drives and benches have them, from which searches start:"
    return "\n".join([*keys_table(effects), "", between, "", *numbers_table(effects)])


def renewed(page: str) -> str:
    """`page` with the tables between their marks as they are now. Raises `ValueError` where a mark is missing."""
    before, _, rest = page.partition(START)
    _, mark, after = rest.partition(END)
    if not mark:
        raise ValueError(f"the page has no lines {START!r} and {END!r}; put them where the tables belong")
    return f"{before}{START}\n\n{tables()}\n\n{END}{after}"


if __name__ == "__main__":
    for name in sys.argv[1:]:
        write_text(Path(name), renewed(Path(name).read_text(encoding="utf-8")))
