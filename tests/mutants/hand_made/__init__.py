"""Faults made by hand, one list a room, as a reviewer who knows the physics would put them in."""

from __future__ import annotations

import hashlib
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
LISTS = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Fault:
    """One fault: in `file` the text `old`, which stands there once, becomes `new`; `tests` (files below `tests`) should
    notice. `equivalent` is the reason why nothing can be seen of it, empty for all others.
    """

    room: str
    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    equivalent: str = ""

    @property
    def key(self) -> str:
        """Room, name and a digest of what is changed: another change is another fault."""
        digest = hashlib.sha256("\0".join((self.file, self.old, self.new)).encode()).hexdigest()[:10]
        return f"{self.room}: {self.name} [{digest}]"


def rooms() -> list[str]:
    """The rooms that have a list, in the order of the alphabet."""
    return sorted(path.stem for path in LISTS.glob("*.toml"))


def faults_of(room: str) -> list[Fault]:
    """The faults of `room` as its list has them: with tests of their own, or those of the room."""
    listed = tomllib.loads((LISTS / f"{room}.toml").read_text(encoding="utf-8"))
    return [
        Fault(
            room,
            one["name"],
            one["file"],
            one["old"],
            one["new"],
            tuple(one.get("tests", listed["tests"])),
            one.get("equivalent", ""),
        )
        for one in listed["fault"]
    ]
