"""Finished parts of long work, kept on disk, so that work that was interrupted goes on where it stood."""

from __future__ import annotations

import itertools
import os
import pickle
import shutil
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar  # Any: whatever work gives back

from hdopt.errors import HdoptError
from hdopt.files import make_folder, write_bytes, write_text
from hdopt.parallel.engine import Engine
from hdopt.parallel.workers import in_a_worker

T = TypeVar("T")
R = TypeVar("R")

KEY_FILE = "work"


@dataclass(frozen=True)
class Parts:
    """A folder of finished parts of the one piece of work that `key` names. Parts are pickled, so the folder must be
    the user's own and closed to others."""

    folder: Path
    key: str

    @classmethod
    def open(cls, folder: Path, key: str, resume: bool) -> Parts:
        """The parts that a like piece of work left in `folder`, or none where it was another one or not `resume`.

        Raises `HdoptError` where the folder belongs to somebody else or others may write to it.
        """
        if resume and folder.is_dir():
            _require_own(folder)
            known = folder / KEY_FILE
            if known.is_file() and known.read_text(encoding="utf-8") == key:
                return cls(folder, key)
        shutil.rmtree(folder, ignore_errors=True)
        return cls(folder, key)

    def has(self, name: str) -> bool:
        return (self.folder / name).is_file()

    def load(self, name: str) -> Any:  # what was kept
        return pickle.loads((self.folder / name).read_bytes())

    def keep(self, name: str, part: object) -> None:
        if not self.folder.is_dir():
            make_folder(self.folder)
            self.folder.chmod(0o700)
            write_text(self.folder / KEY_FILE, self.key)
        write_bytes(self.folder / name, pickle.dumps(part, pickle.HIGHEST_PROTOCOL))

    def clear(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)


def holds_parts(folder: Path) -> bool:
    """Whether a folder of `Parts` holds a finished part; one that was being written when the work ended is none."""
    return folder.is_dir() and any(
        entry.name != KEY_FILE and not entry.name.startswith(".") for entry in folder.iterdir()
    )


def _require_own(folder: Path) -> None:
    state = folder.stat()
    if hasattr(os, "getuid") and (state.st_uid != os.getuid() or state.st_mode & 0o022):
        raise HdoptError(
            f"{folder} belongs to another user, or others may write to it; its parts are not trusted: remove it"
        )


@dataclass(frozen=True)
class Kept:
    """An engine that keeps each result as a part, and takes those that are there from disk.

    Parts are known by the number of the call and of the item: the same work makes the same calls in the same order.
    Nothing is kept in the first `quiet_s` seconds, which are repeated sooner than written; then all of it is.
    """

    engine: Engine
    parts: Parts
    label: str = "part"
    quiet_s: float = 0.0
    needed: bool = True
    """Whether work must end where a part cannot be written; else it goes on without."""
    began: float = field(default_factory=time.monotonic)
    calls: Iterator[int] = field(default_factory=itertools.count)

    @property
    def elsewhere(self) -> bool:
        return self.engine.elsewhere

    @property
    def threads(self) -> int:
        return self.engine.threads

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        if in_a_worker():
            return self.engine.map(function, items)
        return self._kept(function, items, f"{self.label}-{next(self.calls)}")

    def _kept(self, function: Callable[[T], R], items: Iterable[T], call: str) -> Iterator[R]:
        plan: deque[tuple[str, bool]] = deque()  # names in order, and whether each is there

        def todo() -> Iterator[T]:
            for number, item in enumerate(items):
                name = f"{call}-{number}.part"
                plan.append((name, self.parts.has(name)))
                if not plan[-1][1]:
                    yield item

        waiting: list[tuple[str, R]] = []
        for result in self.engine.map(function, todo()):
            while plan[0][1]:
                yield self.parts.load(plan.popleft()[0])
            name = plan.popleft()[0]
            waiting.append((name, result))
            if time.monotonic() - self.began >= self.quiet_s:
                self._write(waiting)
            yield result
        for name, _ in plan:
            yield self.parts.load(name)

    def _write(self, waiting: list[tuple[str, Any]]) -> None:
        try:
            while waiting:
                self.parts.keep(*waiting.pop(0))
        except HdoptError:
            if self.needed:
                raise


def cache_folder() -> Path:
    """Where commands without a folder of their own keep parts: $XDG_CACHE_HOME/hdopt, ~/.cache/hdopt otherwise."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hdopt" / "parts"


OLD_S = 30 * 24 * 3600.0


def forget_old(folder: Path) -> None:
    """Remove from `folder` the parts that nobody came back for in a month."""
    if not folder.is_dir():
        return
    for entry in folder.iterdir():
        if entry.is_dir() and time.time() - entry.stat().st_mtime > OLD_S:
            shutil.rmtree(entry, ignore_errors=True)
