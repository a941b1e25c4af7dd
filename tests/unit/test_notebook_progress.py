"""A call in a notebook says what it does and how long still; an allocation also on the command line."""

from __future__ import annotations

import re
import sys
import threading
import types

import pytest

import hdopt
from hdopt.allocation import rules
from hdopt.workflow import allocation_stages, doing, notebook
from hdopt.workflow.allocation_stages import AllocationWatch, models_left


@pytest.fixture
def cell(monkeypatch):
    """A notebook's cell: what its line says, one text after the other."""
    said: list[str] = []
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    real = notebook._line_of_a_cell
    monkeypatch.setattr(notebook, "_line_of_a_cell", lambda: real() and (lambda: said.append))
    monkeypatch.setattr(notebook, "LOOK_EVERY_S", 0.002)
    return said


def _until(cell, words):
    """Wait, 10 s at most, until the line of the `cell` has said `words`."""
    waiting = threading.Event()
    for _ in range(5000):
        if any(words in text for text in cell):
            return
        waiting.wait(0.002)
    pytest.fail(f"never said {words!r}: {cell[-3:]}")


@pytest.mark.parametrize("compare", [False, True])
def test_an_allocation_in_a_notebook_says_rule_model_and_time(cell, monkeypatch, compare):
    """Would catch a call that works in silence, a line that stays when it is done, and a rule that is not said."""

    class Enough(Exception):
        """The work is left here: what follows costs, and says no more."""

    def successive(problem, constraint, measured):
        step, change = 2, 0.1
        _until(cell, f": model {step}, ")
        step = 3
        _until(cell, f": model {step}, ")
        raise Enough(change)

    monkeypatch.setattr(rules, "_successive", successive)
    with pytest.raises(Enough):
        hdopt.allocate("csf-25-80-tolerances", "rss", compare=compare, curve=())
    rule = r"rss rule \(1 of 4\)" if compare else "rss rule"
    assert any(re.fullmatch(rf"hdopt\.allocate: {rule}: model 3, 0 to \d+ s more, \d+ s so far", text) for text in cell)
    assert cell[-1] == ""


def test_a_call_outside_of_a_notebook_says_nothing(capsys, monkeypatch):
    monkeypatch.setattr(notebook, "LOOK_EVERY_S", 0.0)
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    with notebook.said_in_a_notebook("stack", {}, {}):
        pass
    assert capsys.readouterr() == ("", "")


def test_a_run_in_a_notebook_counts_its_steps(cell, monkeypatch):
    """The line's words come from the steps that `run_study` tells of."""
    arguments = {}
    with notebook.said_in_a_notebook("run_study", arguments, {"progress": None}):
        for name in arguments["progress"](["stack", "search", "export"]):
            if name == "search":
                _until(cell, "hdopt.run_study: search, 1 of 3 done, about ")
    assert cell[-1] == ""


def test_what_is_left_of_an_allocation_follows_from_how_its_reaches_shrink():
    """Each reach is at best 0.6 of the one before, until 0.005 is left: from 0.5 that is ln 100 / ln (1 / 0.6) = 9
    models; there are 60 at most."""
    assert models_left(11, 0.5) == (pytest.approx(9.015, abs=0.001), 50.0)
    assert models_left(11, 0.005) == models_left(11, 1e-9) == (1.0, 50.0)
    assert models_left(58, 0.5) == (3.0, 3.0)


def test_models_are_timed_from_the_second_on(monkeypatch):
    """Thirty seconds for the first model, which compiles, and one for each of the others: after the fifth, whose last
    change was 0.5, 9 to 56 s are left. Would catch a first model's time that is taken for every one's."""
    clock = [0.0]
    monkeypatch.setattr(allocation_stages.time, "monotonic", lambda: clock[0])
    watch, said = AllocationWatch(threading.get_ident(), begun=0.0), []

    def successive():
        for step in range(1, 6):
            said.append(watch._model(sys._getframe(), clock[0]))
            clock[0] += 30.0 if step == 1 else 1.0
            change = 0.5
        return change

    successive()
    assert said == [": model 1", ": model 2", *(f": model {n}, 9 to {61 - n} s more" for n in (3, 4, 5))]


def test_a_watch_says_what_the_other_rules_take(monkeypatch):
    """Ten seconds for the first of three rules: two more take twenty."""
    clock = [0.0]
    monkeypatch.setattr(allocation_stages.time, "monotonic", lambda: clock[0])
    watch, said = AllocationWatch(threading.get_ident(), begun=0.0), []

    def verify():
        other = threading.Thread(target=lambda: said.append(watch.words()))
        other.start()
        other.join()

    monkeypatch.setattr(allocation_stages, "_stages", lambda: {verify.__code__: "work"})
    for _ in watch.rules(["yield", "rss", "worst_case"]):
        verify()
        clock[0] += 10.0
    verify()
    assert said == [
        "work (1 of 3)",
        "work (2 of 3); about 20 s more for all rules",
        "work (3 of 3); about 10 s more for all rules",
        "work",
    ]


def test_a_long_step_says_its_case_and_how_long_still(monkeypatch):
    """Ten seconds a case: after two of five, three more take thirty. Would catch a proof of hours that says no more
    than the name of its step, and words that stay when the step is done."""
    clock, seen = [0.0], []
    monkeypatch.setattr(doing.time, "monotonic", lambda: clock[0])

    def work(heard):
        for case in range(5):
            seen.append(heard.words())
            clock[0] += 10.0
            yield case

    with doing.told(doing.Doing(begun=0.0)) as heard:
        for _ in heard.steps(["concealed_physics"]):
            assert list(doing.counted(work(heard), 5, "case")) == [0, 1, 2, 3, 4]
            seen.append(heard.words())
    assert seen[0] == "concealed physics, case 1 of 5"
    assert seen[2] == "concealed physics, case 3 of 5, about 30 s more"
    assert seen[5] == "concealed physics"
    assert list(doing.counted([1, 2], 2, "case")) == [1, 2]
