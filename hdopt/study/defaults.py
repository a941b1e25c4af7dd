"""What holds where a study does not say: the defaults that a command falls back on, a line a section."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any  # Any: parsed TOML

from hdopt.drive.errors import PHASE_OF, study_key
from hdopt.study.base import Section
from hdopt.study.document import Document

DRIVE = ("wave_generator", "errors", "cs_teeth", "fs_teeth", "cs_roundness")
TOLERANCED = (*DRIVE, "tolerances", "requirement", "contributors", "linear_stack")
USED: dict[str, tuple[str, ...]] = {
    "ke": (*DRIVE, "requirement", "operation"),
    "profile": ("wave_generator",),
    "stack": TOLERANCED,
    "sobol": TOLERANCED,
    "allocate": (*TOLERANCED, "allocate"),
    "search": (*TOLERANCED, "search"),
    "export": ("wave_generator",),
    "compare": ("wave_generator",),
    "explore": DRIVE,
}
"""Command -> the sections whose defaults it may fall back on; a command that is not here says them itself."""
WHOLE_STUDY = "run"
"""The command that uses every section that a study has."""
ALLOCATE = "allocate"
"""The section of an allocation, which moves every tolerance that has a cost."""
WHOLE = (ALLOCATE, "search")
"""Sections that a command may be run without: then all of their defaults hold."""
OF_NO_WEIGHT = ("source", "noise_um", "correlation", "cost", "rated_torque_nm", "rated_speed_rpm")
"""Keys whose default changes nothing, or that another line speaks of."""
OF_ONE_DRIVE = {"errors": "is 0", "tolerances": "is fixed"}
"""Sections of which somebody who writes his own may take it that nothing else holds, and what would make it so."""


def used_by(command: str | None, sections: Mapping[str, Section]) -> tuple[str, ...]:
    """The sections, of a study's checked `sections`, whose defaults the `command` may fall back on."""
    return tuple(sections) if command == WHOLE_STUDY else USED.get(command or "", ())


def defaults_taken(
    sections: Mapping[str, Section], names: Sequence[str], document: Document | None = None
) -> tuple[str, ...]:
    """A line for each of the sections `names` of a study, of its checked `sections`, that leaves something out: which
    value holds instead, of the shipped drive that its `document` starts from (None: of none) or of its own; where
    "allocate" is among them also how far tolerances may go whose costs do not say."""
    from hdopt.study.cost_bounds import assumed_lines

    kept = () if document is None else tuple(_kept(name, document) for name in names if name in OF_ONE_DRIVE)
    bounds = assumed_lines(sections) if ALLOCATE in names else ()
    return (*filter(None, kept), *(line for name in names if (line := _line(name, sections.get(name)))), *bounds)


def _kept(name: str, document: Document) -> str:
    """What is said where the section `name` of a `document` gives a part of what the shipped drive's does."""
    kept = document.kept_of_shipped(name)
    # Directions and phases belong to their size.
    sizes = [key for key in kept if key not in map(study_key, PHASE_OF.values())]
    values = [f"{key} = {_shown(kept[key])}" if isinstance(kept[key], float | int) else key for key in sizes]
    if not values:
        return ""
    return f"[{name}] keeps of {document.shipped} {', '.join(values)}; say where yours {OF_ONE_DRIVE[name]}"


def _line(name: str, section: Section | None) -> str:
    if section is None:
        if name not in WHOLE:
            return ""
        return f"[{name}] is not given: its defaults hold, which 'hdopt new' writes out"
    if name == "errors":
        zero = [key for key in type(section).model_fields if _is_zero_error(section, key)]
        return f"[errors] does not give {', '.join(zero)}: zero" if zero else ""
    taken = [*_rules(name, section), *_values(section, ())]
    return f"[{name}] falls back on {', '.join(taken)}" if taken else ""


def _is_zero_error(section: Section, key: str) -> bool:
    """Whether [errors] leaves a size or a tilt out; directions and phases belong to their size."""
    return key not in section.model_fields_set and type(section).model_fields[key].default == 0.0


def _rules(name: str, section: Any) -> Iterator[str]:
    """What rules find where a number is not given."""
    if name == "wave_generator" and section.profile != "measured":
        if section.semi_major_mm is None:
            yield "semi_major_mm = inner radius + module"
        if section.profile == "ellipse" and section.semi_minor_mm is None:
            yield "semi_minor_mm from equal perimeter"
    if name == "contributors":
        without = [key for key, row in section.rows.items() if row.spread is None]
        if without:
            yield f"a spread of a third of the value for {', '.join(without)}"


def _values(section: Section, path: tuple[str, ...]) -> Iterator[str]:
    """'key = value' of every default with a value that `section`, at `path` below its name, or a table in it takes."""
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        here = (*path, field.alias or name)
        if isinstance(value, Section) and name in section.model_fields_set:
            yield from _values(value, here)
        elif name == "perturbation" and not getattr(section, "regions", True):
            continue
        elif name not in section.model_fields_set and name not in OF_NO_WEIGHT and _says_something(value):
            yield f"{'.'.join(here)} = {_shown(value)}"


def _says_something(value: Any) -> bool:
    if isinstance(value, float) and not math.isfinite(value):
        return False
    return value is not None and not isinstance(value, Section | list | dict) and value is not False


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value).lower() if isinstance(value, bool) else str(value)
