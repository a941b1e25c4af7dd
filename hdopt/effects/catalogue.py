"""Finding the effects: every file of the package, and of the folders that HDOPT_EFFECTS names, that defines one."""

from __future__ import annotations

import os
from collections.abc import MutableSequence
from importlib import import_module
from inspect import isabstract, isclass
from pathlib import Path
from pkgutil import iter_modules

from hdopt.effects.base import Effect
from hdopt.errors import HdoptError

FOLDERS = "HDOPT_EFFECTS"
"""Environment variable: folders of further effect files, separated as in PATH."""


def find_effects(path: MutableSequence[str], package: str) -> dict[str, Effect]:
    """Effect id -> effect, of all modules of `package`, whose `path` grows by the folders of HDOPT_EFFECTS.

    Modules whose names begin with an underscore hold none. By `place`, then by id. Raises `HdoptError` for two effects
    with one id, and for a folder that does not exist.
    """
    for folder in filter(None, os.environ.get(FOLDERS, "").split(os.pathsep)):
        if not Path(folder).is_dir():
            raise HdoptError(f"{FOLDERS} names {folder!r}, which is no folder; correct it or unset {FOLDERS}")
        if folder not in path:
            path.append(folder)
    found: dict[str, Effect] = {}
    for module in sorted(info.name for info in iter_modules(path) if not info.name.startswith("_")):
        for effect in _effects_in(f"{package}.{module}"):
            if effect.id in found:
                raise HdoptError(
                    f"the effect {effect.id!r} is defined twice, in {type(found[effect.id]).__module__} and "
                    f"{type(effect).__module__}; rename one of them"
                )
            found[effect.id] = effect
    return dict(sorted(found.items(), key=lambda item: (item[1].place, item[0])))


def _effects_in(module: str) -> list[Effect]:
    """The effects that a module itself defines, as instances."""
    classes = [value for value in vars(import_module(module)).values() if isclass(value)]
    return [
        c()
        for c in classes
        if issubclass(c, Effect) and c.__module__ == module and "id" in vars(c) and not isabstract(c)
    ]
