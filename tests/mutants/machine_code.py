"""Where the machine code of a tree with a fault in it is kept: with what was compiled of the same texts, and no other.

Numba's cache knows a compiled function by the date of its own file. Code of other files is compiled into it, and their
constants: with a fault in one of those it would run as it did without. So every state of the tree has a folder of its
own, which begins with the machine code of those modules that neither differ nor import, however far, one that differs.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

MANIFEST = "texts.json"
"""In a state's folder: module -> digest of its text and of all that it imports."""
_IMPORT = re.compile(r"^(?:from (hdopt[\w.]*) import (\([^)]*\)|[^\n]*)|import (hdopt[\w.]*))", re.MULTILINE)
_ON_DISK = re.compile(r"cache=True|^@(?:entry|late)\b|= (?:entry|late)\(", re.MULTILINE)


def folder_of(tree: Path, kept: Path) -> Path:
    """The folder below `kept` for the machine code of `tree` as it stands, made where it is not there yet."""
    texts = {path.relative_to(tree).as_posix(): path.read_bytes() for path in _sources(tree)}
    compiled = {name for name, text in texts.items() if _ON_DISK.search(text.decode())}
    state = {name: _digest(texts, name) for name in sorted(compiled)}
    folder = kept / hashlib.sha256(json.dumps(state).encode()).hexdigest()[:16]
    if not (folder / MANIFEST).exists():
        folder.mkdir(parents=True, exist_ok=True)
        for manifest in sorted(kept.glob(f"*/{MANIFEST}"), key=lambda path: path.stat().st_mtime, reverse=True):
            known = json.loads(manifest.read_text(encoding="utf-8"))
            for name in [name for name in state if known.get(name) == state[name]]:
                _take_over(manifest.parent, folder, tree / name)
        (folder / MANIFEST).write_text(json.dumps(state), encoding="utf-8")
    return folder


def imported(texts: dict[str, bytes], name: str) -> set[str]:
    """The module `name` and all that it imports when it is read, however far; `texts` by path, those of the tree."""
    found: set[str] = set()
    left = [name]
    while left:
        here = left.pop()
        if here not in found:
            found.add(here)
            left += [one for one in _imports(texts[here]) if one in texts]
    return found


def _sources(tree: Path) -> Iterator[Path]:
    for top in ("hdopt", "geometry", "studies"):
        yield from (tree / top).rglob("*.py")


def _digest(texts: dict[str, bytes], name: str) -> str:
    digest = hashlib.sha256()
    for one in sorted(imported(texts, name)):
        digest.update(one.encode() + b"\0" + texts[one] + b"\0")
    return digest.hexdigest()


@cache
def _imports(text: bytes) -> tuple[str, ...]:
    """Files that a module of this `text` may mean by its imports; those inside functions are of no compiled one."""
    dotted = []
    for package, names, module in _IMPORT.findall(text.decode()):
        dotted += [package or module, *(f"{package}.{name}" for name in re.findall(r"\w+", names))]
    return tuple(
        path for one in dotted for path in (f"{one.replace('.', '/')}{end}" for end in (".py", "/__init__.py"))
    )


def _take_over(old: Path, new: Path, module: Path) -> None:
    """Have what was compiled of `module` in the folder `new` too, where the folder `old` has it."""
    from numba.core.caching import _CacheLocator

    below = _CacheLocator.get_suitable_cache_subpath(str(module))
    (new / below).mkdir(exist_ok=True)
    for path in (old / below).glob(f"{module.stem}.*.nb?"):
        if not (new / below / path.name).exists():
            os.link(path, new / below / path.name)
