"""The last section of a run's page: what went in, so that the page can be handed round without its study file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any  # Any: values of TOML

import pandas as pd

from hdopt.report import Download, Item, Section, Table, Text
from hdopt.report.cells import heading, minus

SHOWN = {
    "drive": "Drive",
    "wave_generator": "Wave generator",
    "errors": "Errors of the one drive",
    "requirement": "Requirement",
    "clearances": "Clearances",
    "material": "Material of the flexspline",
    "load": "Load",
    "effects": "Effects beyond the base model",
    "operation": "Operating condition",
    "linear_stack": "Linear stack",
    "allocate": "Allocation",
    "export": "Wave generator as files",
    "search": "Search",
}
"""Sections of a study whose keys are shown as they are, with their headings; of any other its name is the heading."""
NOT_SHOWN = ("study",)
"""What the page has at its head."""
SPREAD = {"tolerances": "Tolerances", "contributors": "Callouts"}
"""Sections with a distribution a key."""


ENDS = ("lower", "upper")
LIMITS = {
    "min": "at least {}",
    "max": "at most {}",
    "min_of_baseline": "at least {} times the baseline's",
    "max_of_baseline": "at most {} times the baseline's",
}
"""Keys of a limit of a search -> how it reads."""

Comments = Mapping[tuple[str, ...], Iterable[str]]


def inputs_section(
    data: Mapping[str, Any], toml: str, name: str, assumptions: Sequence[str] = (), comments: Comments | None = None
) -> Section:
    """The inputs of a study: its merged `data` by section, and its whole text `toml`, to be saved as `name`.toml.

    `assumptions` are sentences about what was taken where the study says nothing. `comments` are what the study file
    says beside its keys.
    """
    items: list[Item] = []
    key, said = "inputs", comments or {}
    others = {one: _words(heading(one)[0]) for one in data if one not in {*SHOWN, *SPREAD, *NOT_SHOWN}}
    for section, title in (others | SHOWN).items():
        rows = list(_leaves(data.get(section, {})))
        if rows:
            frame = pd.DataFrame(rows, columns=["what", "value", "unit", "key in the study file"])
            frame = _remarked(frame, [_remark(said, (section, *row[-1].split("."))) for row in rows])
            about = _caption(said, section)
            items.append(Table(f"{key}-{section.replace('_', '-')}", title, frame, about, in_file=False))
    for section, title in SPREAD.items():
        given = {name: row for name, row in data.get(section, {}).items() if isinstance(row, Mapping)}
        if given:
            frame = pd.DataFrame([_spread(name, row) for name, row in given.items()])
            frame = frame.dropna(axis="columns", how="all")
            frame = _remarked(frame, [_remark(said, (section, name)) for name in given])
            items.append(Table(f"{key}-{section}", title, frame, _caption(said, section), in_file=False))
    items += [Text(f"{sentence[:1].upper()}{sentence[1:]}.") for sentence in assumptions]
    items.append(Download(f"{name}.toml", toml, "The whole study file, everything that ships merged in."))
    return Section(key, "Inputs", tuple(items), "Everything that this page was computed from.")


def _caption(comments: Comments, section: str) -> str:
    """What the study file says beside the header of a section, as a sentence that refers to nothing of the page."""
    says = _remark(comments, (section,)).replace("[[", "[ [")
    return f"{says[:1].upper()}{says[1:].rstrip('.')}." if says else ""


def _remark(comments: Comments, place: tuple[str, ...]) -> str:
    return "; ".join(comments.get(place, ()))


def _remarked(frame: pd.DataFrame, remarks: Sequence[str]) -> pd.DataFrame:
    """`frame` with what the study file says beside its rows, where it says anything."""
    return frame.assign(remark=list(remarks)) if any(remarks) else frame


def _leaves(content: object, path: tuple[str, ...] = ()) -> Any:  # rows of text, a leaf each
    """Each value of a section in words: its name, itself, its unit, and its key; a range or a limit is one row."""
    if isinstance(content, Mapping) and content and content.keys() <= LIMITS.keys():
        yield _row(path, "; ".join(LIMITS[key].format(_shown(value)) for key, value in content.items()))
    elif isinstance(content, Mapping) and content.keys() == set(ENDS):
        yield _row(path, f"{_shown(content['lower'])} to {_shown(content['upper'])}")
    elif isinstance(content, Mapping):
        for name, inner in content.items():
            yield from _leaves(inner, (*path, str(name)))
    elif path and content is not None:
        yield _row(path, _shown(content))


def _row(path: tuple[str, ...], value: str) -> tuple[str, str, str, str]:
    title, unit = heading(path[-1])
    inside = [heading(part)[0] for part in path[:-1]]
    return _words(": ".join([*inside, title])), value, unit, ".".join(path)


def _words(text: str) -> str:
    words = [word.upper() if word in ("wg", "cs", "fs") else word for word in text.split(" ")]
    joined = " ".join(words)
    return joined[:1].upper() + joined[1:]


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return minus(f"{value:.6g}")
    if isinstance(value, list | tuple):
        return ", ".join(_shown(one) for one in value)
    text = str(value)
    return heading(text)[0] if "_" in text else text


def _spread(name: str, row: Mapping[str, Any]) -> dict[str, str | None]:
    """One tolerance: what it is of, its distribution with its parameters, its ends, and what it costs."""
    title, unit = heading(name)
    kind = str(row.get("distribution") or row.get("kind") or "").replace("_", " ")
    skipped = {"distribution", "kind", "cost", *ENDS}
    given = [f"{key.replace('_', ' ')} {_shown(value)}" for key, value in row.items() if key not in skipped]
    cost = row.get("cost")
    return {
        "what": _words(title),
        "unit": unit or None,
        "distribution": ", ".join([part for part in (kind, *given) if part]),
        "from": _shown(row["lower"]) if "lower" in row else None,
        "to": _shown(row["upper"]) if "upper" in row else None,
        "cost": _cost(cost) if isinstance(cost, Mapping) else None,
    }


def _cost(cost: Mapping[str, Any]) -> str:
    """A cost model in a few words; its grades are in the study file."""
    given = [f"{key} {_shown(value)}" for key, value in cost.items() if isinstance(value, int | float)]
    words = [str(cost.get("model", "")), str(cost.get("system", "")), *given]
    return ", ".join(word for word in words if word)
