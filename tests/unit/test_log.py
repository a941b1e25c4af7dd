"""Progress in a log: long work says now and then what it does, short work nothing, and nothing runs on afterwards."""

from __future__ import annotations

import re
import threading
import time

import pytest

from hdopt.cli import log


def watched(items, capsys, pause):
    for _ in log.logged(items, "my-drive"):
        time.sleep(pause)
    return capsys.readouterr().err.splitlines()


def test_long_work_says_what_is_done_and_how_long_still(monkeypatch, capsys):
    """Would catch a log without lines, and lines that name the wrong step or count one that is not done."""
    monkeypatch.setattr(log, "EVERY_S", 0.05)
    said = watched(["waveform", "search"], capsys, 0.3)
    assert said and all(re.match(r"my-drive: (waveform|search), [01] of 2 done, \d+ s so far", line) for line in said)
    assert said[0].startswith("my-drive: waveform, 0 of 2 done") and "more" not in said[0]
    assert said[-1].startswith("my-drive: search, 1 of 2 done") and re.search(r"about \d+ s more$", said[-1])


def test_work_that_is_counted_only(monkeypatch, capsys):
    monkeypatch.setattr(log, "EVERY_S", 0.05)
    said = watched([3, 4], capsys, 0.3)
    assert said[0].startswith("my-drive: 0 of 2 done") and said[-1].startswith("my-drive: 1 of 2 done")


def test_short_work_says_nothing(capsys):
    assert watched(range(5), capsys, 0) == []


def test_nothing_is_said_after_the_work_has_failed(monkeypatch, capsys):
    """Would catch a thread that outlives the command's error and writes below its message."""
    monkeypatch.setattr(log, "EVERY_S", 0.05)
    before = threading.active_count()
    with pytest.raises(ValueError, match="no"), log.lines_in_a_log("x"):
        raise ValueError("no")
    time.sleep(0.12)
    assert capsys.readouterr().err == "" and threading.active_count() == before
