"""The folder of a run: made beside the old one, and put in its place as a whole or not at all."""

from __future__ import annotations

import ctypes
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from hdopt.errors import HdoptError
from hdopt.files import make_folder, sync_folder
from hdopt.parallel.kept import Parts, holds_parts

SUFFIX = ".hdopt-run"
"""End of the hidden name that a run folder has until it is whole."""


@dataclass(frozen=True)
class RunFolder:
    """A run under way: `new` is filled and takes the place of `target`; `parts` are the steps that are done."""

    target: Path
    new: Path
    parts: Parts


@contextmanager
def run_folder(folder: Path, key: str, resume: bool) -> Iterator[RunFolder]:
    """A folder to fill for `folder`; `finish` puts it in place.

    Only one run at a time fills it: a second one is refused. Where the work ends early, `folder` stays as it was, and
    the finished parts, if there are any, stay hidden beside it for `resume`; nothing else stays. `key` names the work:
    parts of other work are dropped.
    """
    target = Path(os.path.realpath(folder))
    _check(folder, target)
    with _missing_parents_made(target):
        hidden = target.with_name(f".{target.name}{SUFFIX}")
        lock = _lock(hidden, folder)
        try:
            parts = Parts.open(hidden / "parts", key, resume)
            new = hidden / "new"
            shutil.rmtree(new, ignore_errors=True)
            make_folder(new)
            yield RunFolder(target, new, parts)
        except BaseException:
            _leave_parts_only(hidden, parts=hidden / "parts")
            raise
        finally:
            os.close(lock)


@contextmanager
def _missing_parents_made(target: Path) -> Iterator[None]:
    """The folders above `target`, those that were not there removed again where the work in them ends early and leaves
    nothing in them."""
    missing = [parent for parent in target.parents if not parent.exists()]
    try:
        make_folder(target.parent)
        yield
    except BaseException:
        with suppress(OSError):  # not empty: something stays in it
            for parent in missing:
                parent.rmdir()
        raise


def _leave_parts_only(hidden: Path, parts: Path) -> None:
    """Of the `hidden` folder of work that ended early, leave the finished `parts`; without any, nothing. Called with
    the lock held: whoever waits for it sees that the folder is another one."""
    shutil.rmtree(hidden / "new", ignore_errors=True)
    if not holds_parts(parts):
        shutil.rmtree(parts, ignore_errors=True)
        with suppress(OSError):  # not empty: an old run that could not be put back
            hidden.rmdir()


def finish(run: RunFolder, old_files: Iterable[str]) -> None:
    """Put the new folder in place of the old one, in one step where the system can.

    Of the old folder, the files of the earlier run (`old_files`, relative) go; whatever else is in it stays.
    """
    if run.target.is_dir():
        _carry_over(run.target, run.new, set(old_files))
        _exchange(run.new, run.target)
    else:
        os.rename(run.new, run.target)
    sync_folder(run.target.parent)
    shutil.rmtree(run.target.with_name(f".{run.target.name}{SUFFIX}"), ignore_errors=True)


def _check(folder: Path, target: Path) -> None:
    """Refuse what cannot become a run folder before any work is done."""
    if target.exists() and not target.is_dir():
        raise HdoptError(f"cannot write to {folder}: it is a file; give the name of a folder")
    here = Path.cwd()
    if target == here or target in here.parents or not target.name:
        raise HdoptError(
            f"cannot write to {folder}: a run replaces its folder as a whole, and this one holds the working folder; "
            "give a folder of its own, such as out/NAME"
        )
    above = next(parent for parent in target.parents if parent.exists())
    if not above.is_dir() or not os.access(above, os.W_OK | os.X_OK):
        raise HdoptError(f"cannot write to {folder}: {above} cannot be written; give another folder")


def _lock(hidden: Path, folder: Path) -> int:
    """A lock on the hidden folder, which ends with the process; `HdoptError` where another run holds it."""
    while True:
        make_folder(hidden)
        with suppress(OSError):
            hidden.chmod(0o700)
        handle = os.open(hidden, os.O_RDONLY)
        try:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except ImportError:  # no such locks on this system
            return handle
        except OSError as error:
            os.close(handle)
            raise HdoptError(
                f"another run is writing to {folder}; wait until it has ended, or give another folder"
            ) from error
        with suppress(OSError):
            if os.path.samestat(os.stat(hidden), os.fstat(handle)):
                return handle
        os.close(handle)  # the run that held the lock has ended meanwhile and taken the folder with it


def _carry_over(old: Path, new: Path, ours: set[str]) -> None:
    """Link what is in the old folder and not of a run into the new one."""
    for entry in sorted(old.iterdir()):
        place = new / entry.name
        if entry.name in ours or place.exists():
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.copytree(entry, place, symlinks=True, copy_function=_link)
        else:
            _link(str(entry), str(place))


def _link(source: str, place: str) -> str:
    try:
        os.link(source, place, follow_symlinks=False)
    except OSError:
        shutil.copy2(source, place, follow_symlinks=False)
    return place


def _exchange(new: Path, target: Path) -> None:
    """Let two folders change names: at one stroke by Linux's renameat2, else by two renames."""
    at_working_folder, exchange = -100, 2
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
        done = rename(at_working_folder, os.fsencode(new), at_working_folder, os.fsencode(target), exchange) == 0
    except (AttributeError, OSError):
        done = False
    if not done:
        aside = new.with_name("old")
        os.rename(target, aside)
        try:
            os.rename(new, target)
        except OSError:
            os.rename(aside, target)
            raise
