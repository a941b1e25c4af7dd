"""A study to begin with: every section and key written out and explained, with the numbers of one that works."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any  # Any: parsed TOML

import tomlkit

from hdopt.errors import HdoptError
from hdopt.files import claim_output, write_text
from hdopt.study import DEFAULT_STUDY, Study, load_study, shipped_drives, shipped_studies
from hdopt.study.schema import SECTIONS
from hdopt.study.write import with_moved_paths
from hdopt.workflow.study_reference import KeyReference, TableReference, section_reference

WIDTH = 118
"""Of a comment that has lines of its own; a longer one beside its key stands above it."""
NAMED_KEYS = ("effects", "contributors", "linear_stack")
"""Sections whose keys the study makes up, or that have too many: their tables are written as they are."""


@dataclass(frozen=True)
class NewStudy:
    """A study that was written: the `file`, and the study that its numbers come from."""

    file: Path
    source: str

    def to_dict(self) -> dict[str, str]:
        """JSON-ready: `file`, `from`."""
        return {"file": str(self.file), "from": self.source}


def new_study(name: str | Path, source: str | Path = DEFAULT_STUDY) -> NewStudy:
    """Write a commented study called `name` (a path, with or without .toml) that has the numbers of `source`: a shipped
    drive or study, or a file.

    Every key that the study may have stands in it, those that `source` does not give behind a #. Raises `HdoptError`
    where the file is there already or cannot be written.
    """
    path = Path(name)
    if path.suffix != ".toml":
        path = path.with_name(path.name + ".toml")
    if path.exists():
        raise HdoptError(f"{path} is there already; give another name, or remove it")
    claim_output(path)
    study = _source(str(source))
    write_text(path, study_text(study, path))
    return NewStudy(path, study.name)


def _source(name: str) -> Study:
    """The study that `name` means: a shipped drive's own comes before a study of the same name."""
    shipped = name in shipped_drives() and name not in shipped_studies()
    return load_study(None, drive=name) if shipped else load_study(name)


def study_text(study: Study, path: Path) -> str:
    """The text of `study` as a commented file at `path`."""
    data = with_moved_paths(study.data, study.folder, path.parent)
    given = data.get("study", {})
    data = {**data, "study": {**given, "title": path.stem}}
    lines = [
        f"# A study to change, with the numbers of {study.name}. A key behind a # is not given; what then holds stands",
        "# in its comment. `hdopt check FILE` says what can be computed from what is given.",
    ]
    for name in SECTIONS:
        lines += ["", *_section(name, data.get(name))]
    for name in data.keys() - SECTIONS.keys():
        lines += ["", *_as_it_is(name, data[name])]
    return "\n".join(lines) + "\n"


def _section(name: str, content: Mapping[str, Any] | None) -> Iterator[str]:
    if name == "effects":
        yield from _effects(content)
        return
    table, *_ = section_reference(name)
    says = table.says.partition(": ")[2]
    for line in _wrapped(says[:1].upper() + says[1:]):
        yield f"# {line}"
    if content is None:
        yield f"# [{name}]"
        for key in table.keys:
            yield from _left_out(key)
        return
    if name in NAMED_KEYS:
        yield from _as_it_is(name, content)
        return
    yield f"[{name}]"
    yield from _keys(name, table, content)


def _keys(name: str, table: TableReference, content: Mapping[str, Any]) -> Iterator[str]:
    """The keys of a section: those given with their meaning, those left out behind a #; its own tables at the end."""
    inner = []
    for key in table.keys:
        value = content.get(key.key)
        if value is None:
            yield from _left_out(key)
        elif isinstance(value, Mapping) and name == "search":
            inner.append(key.key)
        else:
            yield from _lines(f"{key.key} = {_toml(value)}", _explained(key))
    for key_name in inner:
        yield from ("", *_as_it_is(f"{name}.{key_name}", content[key_name]))


def _left_out(key: KeyReference) -> Iterator[str]:
    value = key.default if key.default not in ("", "none") else "..."
    yield from _lines(f"# {key.key} = {value}", _explained(key, with_allowed=True))


def _explained(key: KeyReference, with_allowed: bool = False) -> str:
    """The comment of a key: what it means, and what may stand there where it is chosen from a few or left out."""
    parts = [key.meaning.rstrip(".")]
    if with_allowed or key.allowed.startswith('"'):
        parts.append(key.allowed)
    return "; ".join(part for part in parts if part)


def _lines(text: str, comment: str) -> Iterator[str]:
    """`text` with its `comment` beside it, or above it where that would be a long line."""
    line = f"{text:<40s} # {comment}" if comment else text
    if len(line) <= WIDTH + 2:
        yield line
        return
    for part in _wrapped(comment):
        yield f"# {part}"
    yield text


def _effects(content: Mapping[str, Any] | None) -> Iterator[str]:
    yield "# What the base model leaves out: a table for each effect, [effects.ID]; docs/conventions.md has their keys"
    for name, keys in (content or {}).items():
        yield from _as_it_is(f"effects.{name}", keys)


def _as_it_is(name: str, content: Any) -> Iterator[str]:
    """A section without comments on its keys."""
    if not isinstance(content, Mapping):
        yield f"{name} = {_toml(content)}"
        return
    yield f"[{name}]"
    for key, value in content.items():
        yield f"{tomlkit.key(key).as_string()} = {_toml(value)}"


def _toml(value: Any) -> str:
    """A value on one line."""
    if isinstance(value, Mapping):
        inside = ", ".join(f"{tomlkit.key(key).as_string()} = {_toml(inner)}" for key, inner in value.items())
        return f"{{ {inside} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return str(tomlkit.item(value).as_string())


def _wrapped(text: str) -> list[str]:
    import textwrap

    return textwrap.wrap(text, WIDTH)
