"""Makes `tests/cases.py` importable from every test folder, and lets no test be skipped unseen.

Skips are listed at the end of every run; where CI is set, one that is not on the short list below fails the run.
"""

from __future__ import annotations

import gc
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))

from hdopt.parallel.engine import engine_in_force
from tests.regression.golden import hdopt  # the path comes first
from tests.slow import slow_tests

ALLOWED_SKIPS = ("no recordings", "this machine has OSMesa", "asammdf is an extra of its own")
"""What a skip's reason may start with in CI: the recordings belong to others and are not part of the project."""

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
"""Before numpy is first imported: workers side by side, each with a thread a core for every small product, take a
hundred times as long.
"""

settings.register_profile("same", derandomize=True)
settings.register_profile("explore", derandomize=False)
settings.load_profile("same")
"""A property is asked for the same examples in every run: what passed once does not fail elsewhere by chance. New
examples are drawn with `pytest --hypothesis-profile explore`; one that fails becomes an `@example` of its test.
"""

if "PYTEST_XDIST_WORKER" in os.environ:
    # Workers side by side have the cores already: threads in each would only wait for Python's lock (a tenth of a
    # diagnosis). Tests that are about an engine name it. The name keeps it in force: let go, it ends.
    _IN_TURN = engine_in_force("process")
    _IN_TURN.__enter__()

_skipped: list[tuple[str, str]] = []


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    listed = slow_tests()
    for item in items:
        if item.nodeid in listed:
            item.add_marker(pytest.mark.timed)
    # First what compiles a kernel to look at it: all others load it then.
    items.sort(key=lambda item: item.get_closest_marker("compiles") is None)


def pytest_collection_finish() -> None:
    """What has been imported and collected by now stays to the end: a million objects that no collection looks at.
    `gc.get_objects` does not list them either."""
    gc.freeze()


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.skipped and not hasattr(report, "wasxfail"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        _skipped.append((report.nodeid, reason.removeprefix("Skipped: ")))


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    refused = [skip for skip in _skipped if not skip[1].startswith(ALLOWED_SKIPS)]
    on_a_worker = hasattr(session.config, "workerinput")
    if refused and os.environ.get("CI") and not on_a_worker:
        for test, reason in refused:
            print(f"\nskipped, which CI does not allow: {test}: {reason}")
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


RECORDINGS = ("csf-17-100-mount.csv", "planetary-7to1-reversing.csv", "planetary-7to1-stiffness.csv")


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Folder of the real recordings: HDOPT_RECORDINGS where it is set, else ../shared/recordings. What asks for it is
    skipped, visibly, unless all of them are there."""
    folder = Path(os.environ.get("HDOPT_RECORDINGS") or Path(__file__).parents[2] / "shared/recordings").resolve()
    if not all((folder / name).is_file() for name in RECORDINGS):
        pytest.skip("no recordings: set HDOPT_RECORDINGS to the folder that holds all of them")
    return folder


@dataclass(frozen=True)
class ShippedRun:
    """What `hdopt run csf-25-80 --json -` left: its `folder`, exit `status` and JSON."""

    folder: Path
    status: int
    result: dict[str, Any]


@pytest.fixture(scope="session")
def shipped_run(tmp_path_factory: pytest.TempPathFactory) -> ShippedRun:
    """The whole run of a shipped study, done once for all workers: who asks first does it, others wait for it."""
    import fcntl

    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, said = base / "csf-25-80", base / "csf-25-80.json"
    with open(base / "csf-25-80.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not said.exists():
            status, result = hdopt("run", "csf-25-80", "-o", str(folder))
            said.write_text(json.dumps([status, result]))
    return ShippedRun(folder, *json.loads(said.read_text()))


@pytest.fixture(scope="session")
def session_answers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of this session's diagnoses of bench cases, shared by all workers: each case is answered once."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "answers"
    folder.mkdir(exist_ok=True)
    return folder
