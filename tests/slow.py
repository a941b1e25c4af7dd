"""Which tests `make check` leaves out for their time: the list in `tests/slow.txt`, and the command that writes it.

    make test PYTEST_ARGS=--junitxml=$PWD/build/tests.xml
    python -m tests.slow build/tests.xml
    make check PYTEST_ARGS=--junitxml=$PWD/build/check.xml
    python -m tests.slow build/tests.xml build/check.xml

Where many tests wait for one compilation or fixture, the first pays for all, and the next one where that is left out:
so the list is written once more with what `make check` took then. A test on the list is marked `timed`, beside those
that call themselves `slow`; one that is new is quick until the list is written anew. Faults that are put in
(`tests.mutants`) are asked of timed tests too: time is no reason not to notice.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as xml
from collections.abc import Sequence
from pathlib import Path

LIST = Path(__file__).with_name("slow.txt")
SECONDS = 0.12
"""Time from which a test is on the list: 7,123 quicker ones took 64 s on two cores."""


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


def write(reports: Sequence[Path]) -> None:
    """Write the list from JUnit `reports`, of all tests and of those that were quick then."""
    slow = sorted({name for report in reports for name, seconds in times(report).items() if seconds > SECONDS})
    LIST.write_text("\n".join(slow) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("give the JUnit reports that the list is to be written from")
    write([Path(report) for report in sys.argv[1:]])
