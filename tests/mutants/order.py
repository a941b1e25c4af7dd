"""Which tests of a file run first: those that call what a fault is in, the quickest of them before the others."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from tests.mutants.hand_made import Fault
from tests.mutants.in_memory import changed_functions, mark_calls


@dataclass
class Watch:
    """What the run of a file without any fault tells: which test calls the functions of which fault, and its time."""

    faults: Sequence[Fault]
    tree: Path
    callers: dict[int, set[str]] = field(default_factory=lambda: defaultdict(set))
    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    now: str = ""

    def pytest_collection_finish(self) -> None:
        sys._fault_called = lambda number: self.callers[number].add(self.now)  # type: ignore[attr-defined]
        for number, fault in enumerate(self.faults):
            path = self.tree / fault.file
            text = path.read_text(encoding="utf-8")
            mark_calls(path, text, changed_functions(path, text, text.replace(fault.old, fault.new)), number)

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.now = nodeid

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call":
            self.seconds[report.nodeid] += report.duration


@dataclass(frozen=True)
class LikelyFirst:
    """The order of a file's tests for the fault with this `number`; no test is left out."""

    watch: Watch
    number: int

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        callers = self.watch.callers[self.number]
        items.sort(key=lambda item: (item.nodeid not in callers, self.watch.seconds[item.nodeid]))
