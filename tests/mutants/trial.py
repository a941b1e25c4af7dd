"""Trials of faults in a copy of the project: one test file after the other, each first without any fault.

A process reads the libraries once, one for each test file runs it as it stands, and a third has the fault put into the
functions that are in memory. Where a fault is more than that, a process that has read nothing of the project takes it.
"""

from __future__ import annotations

import importlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn, TextIO

from tests.mutants.hand_made import ROOT, Fault
from tests.mutants.in_memory import NotInMemory, forget_modules, forget_results, put_in_memory
from tests.mutants.machine_code import folder_of
from tests.mutants.order import LikelyFirst, Watch

LOG = "faults-last.log"
TIMEOUT_S = 400.0
ALL = ("-q", "-x", "--benchmark-disable", "-p", "no:cacheprovider")
QUICK = (*ALL, "-m", "not slow and not browser")
NO_TESTS = 5
"""Pytest's own code for a file of which nothing is selected."""
LIBRARIES = ("numpy", "numba", "pytest", "hypothesis", "pandas", "scipy.optimize", "scipy.stats", "scipy.ndimage")
KILLED, SURVIVED, TIMEOUT, ANEW = "killed", "survived", "timeout", "anew"
SAID = {0: SURVIVED, 1: KILLED, 2: KILLED, -signal.SIGKILL: TIMEOUT, 99: ANEW}
"""By exit code: pytest's own 0 to 2, a process that was stopped, and one that could not put the fault in."""


def load_libraries() -> None:
    """Read what the tests need besides the project: no fault is in it."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    for library in LIBRARIES:
        importlib.import_module(library)


def refreshed_tree(folder: Path) -> Path:
    """The project's files as they stand, below `folder`: faults are put in there and nowhere else."""
    tree = folder / "faults-tree"
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=ROOT, capture_output=True, check=True).stdout.decode().split("\0")
    wanted = {name for name in names if name and (ROOT / name).is_file()}
    for name in wanted:
        source, copy = ROOT / name, tree / name
        if not copy.exists() or copy.stat().st_mtime != source.stat().st_mtime:
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, copy)
    for gone in [p for p in tree.rglob("*.py") if str(p.resolve().relative_to(tree)) not in wanted]:
        gone.unlink(missing_ok=True)
    for name in ("geometry", "studies"):  # As they are installed: the environment's own would be found otherwise.
        link = tree / "hdopt" / name
        if not link.exists():
            link.symlink_to(tree / name)
    return tree


def tried(faults: Sequence[Fault], tree: Path, folder: Path) -> Iterator[tuple[Fault, str, str]]:
    """Each of `faults`, what its tests make of it in `tree` (killed, survived, or timeout), and which file it was."""
    left = {fault: 0 for fault in faults}
    while left:
        file = min((fault.tests[at] for fault, at in left.items()), key=lambda name: -_count(left, name))
        here = [fault for fault, at in left.items() if fault.tests[at] == file]
        answered = False
        for fault, said in _on_file(file, here, tree, folder):
            answered = True
            left[fault] += 1
            if said != SURVIVED or left[fault] == len(fault.tests):
                del left[fault]
                yield fault, said, "" if said == SURVIVED else file
        if not answered:
            left = {fault: at for fault, at in left.items() if fault not in here}


def _count(left: dict[Fault, int], name: str) -> int:
    return sum(fault.tests[at] == name for fault, at in left.items())


def _on_file(file: str, faults: Sequence[Fault], tree: Path, folder: Path) -> Iterator[tuple[Fault, str]]:
    """What one test `file` makes of each of `faults`."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        with os.fdopen(writing, "w") as out:
            _in_session(lambda: _session(file, faults, tree, folder, out), tree, folder)
    os.close(writing)
    anew = []
    with os.fdopen(reading) as lines:
        for line in lines:
            number, said = json.loads(line)
            if number is None:
                print(f"not asked: {file} {said} without any fault: see {folder / LOG}", flush=True)
                break
            fault = faults[number]
            if said == ANEW:
                anew.append(fault)
            else:
                yield fault, said
    os.waitpid(child, 0)
    for fault in anew:
        with put_in(fault, tree):
            said = _in_child(lambda: _in_session(lambda: _pytest(file), tree, folder))
        yield fault, said


def _session(file: str, faults: Sequence[Fault], tree: Path, folder: Path, out: TextIO) -> int:
    """Run `file` as it stands, then with each of `faults` in a child of this process; a line of `out` says what."""
    watch = Watch(faults, tree)
    if code := _pytest(file, watch):
        out.write(json.dumps([None, "has no quick test" if code == NO_TESTS else "fails"]) + "\n")
        out.flush()
        return 0
    _end_solid_threads()
    for number, fault in enumerate(faults):
        with put_in(fault, tree) as (path, before, after):
            first = LikelyFirst(watch, number)

            def child(
                path: Path = path, before: str = before, after: str = after, first: LikelyFirst = first
            ) -> NoReturn:
                if "distributed" in sys.modules:  # Its loop runs in a thread, which a child has not: it would wait.
                    os._exit(99)
                try:
                    put_in_memory(path, before, after)
                except NotInMemory:
                    os._exit(99)
                forget_results()
                forget_modules(tree / "tests")
                os._exit(_pytest(file, first))

            said = _in_child(child)
        out.write(json.dumps([number, said]) + "\n")
        out.flush()
    return 0


def _end_solid_threads() -> None:
    """End the threads of the library of solids, where it was read: a child has none, and would wait for them."""
    if "OCP" in sys.modules:
        from OCP.OSD import OSD_ThreadPool

        OSD_ThreadPool.DefaultPool_s().Init(1)


@contextmanager
def put_in(fault: Fault, tree: Path) -> Iterator[tuple[Path, str, str]]:
    """`fault` in the files of `tree`, and out again: the file, its text before, and with the fault."""
    path = tree / fault.file
    before, stamp = path.read_text(encoding="utf-8"), path.stat()
    if before.count(fault.old) != 1:
        raise SystemExit(f"{fault.room}: {fault.name}: the old text stands {before.count(fault.old)} times")
    after = before.replace(fault.old, fault.new)
    try:
        path.write_text(after, encoding="utf-8")
        _forget_compiled(path)
        yield path, before, after
    finally:
        path.write_text(before, encoding="utf-8")
        os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))  # Machine code of it is known by its time.
        _forget_compiled(path)


def _forget_compiled(path: Path) -> None:
    """Without what was compiled of `path`: two texts of one length and one second are one to the compiler's cache."""
    for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
        compiled.unlink(missing_ok=True)


def _in_child(work: Callable[[], object]) -> str:
    """What a child process that does `work` makes of it."""
    child = os.fork()
    if child == 0:
        try:
            work()
        finally:
            os._exit(70)
    end = time.monotonic() + TIMEOUT_S
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return SAID[os.waitstatus_to_exitcode(status)]
        time.sleep(0.02)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return TIMEOUT


def _in_session(work: Callable[[], int], tree: Path, folder: Path) -> NoReturn:
    """Do `work` as a process of the project in `tree`, and end with its code."""
    import numba

    code = 70
    try:
        log = os.open(folder / LOG, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.environ["NUMBA_CACHE_DIR"] = str(folder_of(tree, folder / "faults-compiled"))
        numba.core.config.reload_config()
        os.chdir(tree)
        sys.path[:] = [str(tree), *(path for path in sys.path if Path(path or ".").resolve() != ROOT)]
        forget_modules(ROOT / "tests")
        code = work()
    finally:
        sys.stdout.flush()
        os._exit(code)


def _pytest(file: str, plugin: object = None) -> int:
    import pytest

    named = "::" in file  # A test that a list names is asked however slow it is.
    code = int(pytest.main([*(ALL if named else QUICK), f"tests/{file}"], [] if plugin is None else [plugin]))
    sys.stdout.flush()
    return code
