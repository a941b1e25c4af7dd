"""The sections a study file may have, and the keys that each may have."""

from __future__ import annotations

from collections.abc import Container, Mapping
from functools import cache
from importlib import import_module
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints  # Any: values of TOML, and annotations

from hdopt.study.base import Section
from hdopt.study.document import KIND_KEYS
from hdopt.toml_lines import Keys

SECTIONS: dict[str, str] = {
    "study": "hdopt.study.drive:StudySection",
    "drive": "hdopt.study.drive:DriveSection",
    "wave_generator": "hdopt.study.drive:WaveGeneratorSection",
    "cs_teeth": "hdopt.study.drive:TeethSection",
    "fs_teeth": "hdopt.study.drive:TeethSection",
    "cs_roundness": "hdopt.study.drive:RoundnessSection",
    "errors": "hdopt.study.drive:ErrorsSection",
    "effects": "hdopt.study.effects:EffectsSection",
    "operation": "hdopt.study.effects:OperationSection",
    "clearances": "hdopt.study.drive:ClearancesSection",
    "material": "hdopt.study.drive:MaterialSection",
    "load": "hdopt.study.drive:LoadSection",
    "tolerances": "hdopt.study.tolerances:TolerancesSection",
    "requirement": "hdopt.study.tolerances:RequirementSection",
    "contributors": "hdopt.study.tolerances:ContributorsSection",
    "linear_stack": "hdopt.study.tolerances:LinearStackSection",
    "allocate": "hdopt.study.costs:AllocateSection",
    "export": "hdopt.study.export:ExportSection",
    "search": "hdopt.study.search:SearchSection",
}
"""Section -> where its model is; a model is imported only when a study has the section."""

STEP_PACKAGES = ("hdopt.studies",)
"""Packages whose steps bring sections of their own: each has a table `SECTIONS` like the one above. They are asked only
about a section that the general schema does not have.
"""


def step_sections() -> dict[str, str]:
    """Section -> where its model is, of the sections that steps bring."""
    return {name: place for package in STEP_PACKAGES for name, place in import_module(package).SECTIONS.items()}


def section_model(name: str) -> type[Section]:
    """The model of the section `name`, imported now."""
    module, _, attribute = (SECTIONS.get(name) or step_sections()[name]).partition(":")
    found: type[Section] = getattr(import_module(module), attribute)
    return found


def known_paths(data: Mapping[str, Any], without: Container[str] = ()) -> set[Keys]:
    """The paths of all keys that a study with this `data` may have, but for the sections `without`. Where a table can
    be of several kinds, all keys of the kind that it says it is count, and of every kind where it says none."""
    found: set[Keys] = set()
    for name in (*SECTIONS, *(step_sections().keys() & data.keys())):
        if name != "study" and name not in without:
            found |= _paths(section_model(name), (name,), data.get(name))
    return found


ANY_NAME = "*"
"""Stands in a path for a name that the study makes up: a callout, a quantity that is limited, a dimension."""


def _paths(model: type[Section], path: Keys, content: Any) -> set[Keys]:
    """The paths of the keys of `model` at `path`, whose table holds `content`."""
    if content is None:
        return {(*path, *tail) for tail in _tails(model)}
    return _written(model, path, content)


@cache
def _tails(model: type[Section]) -> frozenset[Keys]:
    """The paths below a `model` of which a study writes nothing: always the same."""
    return frozenset(_written(model, (), None))


def _written(model: type[Section], path: Keys, content: Any) -> set[Keys]:
    found: set[Keys] = set()
    for name, named, held_in in _keys(model):
        here = (*path, name)
        value = content.get(name) if isinstance(content, Mapping) else None
        found.add(here)
        if dict in held_in:
            found |= _named_tables(named, here, value)
        elif list not in held_in:
            for kind in _kinds(named, value):
                found |= _paths(kind, here, value)
    if model.__annotations__.get("__pydantic_extra__"):
        found |= _named_tables(sections_in(get_type_hints(model)["__pydantic_extra__"]), path, content)
    return found


@cache
def _keys(model: type[Section]) -> list[tuple[str, list[type[Section]], set[Any]]]:
    """Key, section models and containers of each field; a model's fields do not change."""
    return [
        (field.alias or name, sections_in(field.annotation), containers(field.annotation))
        for name, field in model.model_fields.items()
    ]


def _named_tables(kinds: list[type[Section]], path: Keys, content: Any) -> set[Keys]:
    """The paths in a table of tables whose names the study makes up: those that it has, and any other."""
    found: set[Keys] = set()
    for key, inner in {**(content if isinstance(content, Mapping) else {}), ANY_NAME: None}.items():
        found.add((*path, key))
        for kind in kinds:
            found |= _paths(kind, (*path, key), inner)
    return found


def containers(annotation: Any) -> set[Any]:
    """`dict` and `list` where an annotation, or a part of its union, is one."""
    parts = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    return {get_origin(part) for part in parts} & {dict, list}


def sections_in(annotation: Any) -> list[type[Section]]:
    """The section models that an annotation names, unions, optional ones and containers opened."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [model for part in get_args(annotation) for model in sections_in(part)]


def _kinds(models: list[type[Section]], value: Any) -> list[type[Section]]:
    """Of the kinds of a table those that its own `value` says it is; all where it does not say."""
    said = {key: value[key] for key in KIND_KEYS if key in value} if isinstance(value, Mapping) else {}
    fitting = [
        model
        for model in models
        if all(
            key not in model.model_fields or x in get_args(model.model_fields[key].annotation)
            for key, x in said.items()
        )
    ]
    return fitting or models
