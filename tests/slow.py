"""Which tests `make check` leaves out for their time: the list in `tests/slow.txt`, and the command that writes it.

    make test PYTEST_ARGS=--junitxml=$PWD/build/tests.xml
    python -m tests.slow build/tests.xml

Where many tests wait for one compilation, the first pays for all: of those the list may name one more by hand. A test
on the list is marked `timed`, beside those that call themselves `slow`; one that is new is quick until the list is
written anew. Faults that are put in (`tests.mutants`) are asked of timed tests too: time is no reason not to notice.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as xml
from pathlib import Path

LIST = Path(__file__).with_name("slow.txt")
SECONDS = 0.12
"""Time from which a test is on the list: 7,337 quicker ones took 79 s of one core together, beside other work."""


def slow_tests() -> frozenset[str]:
    """Ids of the tests on the list."""
    return frozenset(LIST.read_text(encoding="utf-8").splitlines())


def times(report: Path) -> dict[str, float]:
    """Seconds of each test in a JUnit `report`, by its id; a file's first test also pays for what all of it needs."""
    found = {}
    for case in xml.parse(report).iter("testcase"):
        path = case.get("classname", "").replace(".", "/") + ".py"
        found[f"{path}::{case.get('name')}"] = float(case.get("time", 0))
    return found


def write(report: Path) -> None:
    """Write the list from a JUnit `report` of all tests."""
    slow = sorted(name for name, seconds in times(report).items() if seconds > SECONDS)
    LIST.write_text("\n".join(slow) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
