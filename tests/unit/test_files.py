"""Outputs are written whole or not at all, inputs are never outputs, and JSON input is refused in one sentence."""

import ast
import gc
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hdopt.errors import HdoptError
from hdopt.files import (
    check_output,
    claim_output,
    note_input,
    read_json,
    replacing,
    replacing_all,
    to_csv,
    to_json,
    watching_files,
    write_text,
)
from hdopt.interruption import noting_interruptions


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_failure_in_the_middle_leaves_the_old_file_and_nothing_else(tmp_path):
    target = tmp_path / "report.html"
    target.write_text("the good old one")
    with pytest.raises(RuntimeError), replacing(target) as passing:
        passing.write_text("half of the n")
        raise RuntimeError
    assert target.read_text() == "the good old one"
    assert names(tmp_path) == ["report.html"]


def test_files_that_belong_together_take_their_names_together(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    with pytest.raises(RuntimeError), replacing_all([one, two]) as passing:
        for path in passing:
            path.write_text("x")
        raise RuntimeError
    assert names(tmp_path) == []
    with replacing_all([one, two]) as passing:
        for path in passing:
            path.write_text("x")
    assert names(tmp_path) == ["one", "two"]


def test_a_symbolic_link_stays_and_its_target_changes(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    real, link = tmp_path / "elsewhere" / "real.json", tmp_path / "link.json"
    real.write_text("old")
    link.symlink_to(real)
    write_text(link, "new")
    assert link.is_symlink() and real.read_text() == "new"
    dangling = tmp_path / "dangling.json"
    dangling.symlink_to(tmp_path / "elsewhere" / "made.json")
    write_text(dangling, "new")
    assert dangling.is_symlink() and (tmp_path / "elsewhere" / "made.json").read_text() == "new"


def test_rights_of_the_old_file_are_kept_and_a_new_one_follows_the_mask(tmp_path):
    old = tmp_path / "old"
    old.write_text("x")
    old.chmod(0o640)
    write_text(old, "y")
    assert old.stat().st_mode & 0o777 == 0o640
    before = os.umask(0o027)
    try:
        write_text(tmp_path / "new", "y")
    finally:
        os.umask(before)
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o640


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_devices_are_written_to_and_stay_devices():
    write_text(__import__("pathlib").Path("/dev/null"), "x")
    assert not os.path.isfile("/dev/null")
    with pytest.raises(HdoptError, match="cannot write /dev/full: No space left on device"):
        write_text(__import__("pathlib").Path("/dev/full"), "x")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "it is a folder"),
        ("folder", "it is a folder"),
        ("no/such.json", "there is no folder"),
        ("x" * 300, "too long"),
        ("a\0b", "cannot write"),
        ("loop", "cannot write"),
    ],
)
def test_what_cannot_be_written_is_said_before_the_work(tmp_path, name, message):
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(HdoptError, match=message):
        check_output(tmp_path / name)


def test_an_input_can_be_no_output(tmp_path):
    (tmp_path / "r.csv").write_text("x")
    (tmp_path / "link.csv").symlink_to(tmp_path / "r.csv")
    with watching_files():
        claim_output(tmp_path / "link.csv")
        with pytest.raises(HdoptError, match=r"r\.csv is read and was also given as an output"):
            note_input(tmp_path / "r.csv")
    with watching_files():
        note_input(tmp_path / "r.csv")
        with pytest.raises(HdoptError, match="is an input of this command"):
            write_text(tmp_path / "link.csv", "new")
    with watching_files():
        claim_output(tmp_path / "a")
        with pytest.raises(HdoptError, match="is given for two outputs"):
            claim_output(tmp_path / "." / "a")
    assert (tmp_path / "r.csv").read_text() == "x"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 100_000, "line 1: is nested too deeply"),
        ('{"a": 1' + "0" * 400 + "}", "holds an integer of 401 digits"),
        ('{"a": 1' + "0" * 5000 + "}", "holds an integer of 5001 digits"),
        ('{"b": 1,\n"a": NaN}', "line 2: holds the number NaN, which is not finite"),
        ('{"a": 1e999}', "holds the number 1e999, which is not finite"),
        ("root:x:0:0:secret", r"line 1: is not valid JSON \(Expecting value\); give it"),
    ],
)
def test_json_that_is_none(tmp_path, text, message):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(HdoptError, match=message) as caught:
        read_json(tmp_path / "a.json", "it")
    assert "secret" not in str(caught.value)


SLOW_WRITER = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background work begins with it ignored
from pathlib import Path
from hdopt.cli.signals import Terminated, signals_raise
from hdopt.files import replacing
from hdopt.interruption import Interruption
try:
    with signals_raise(Interruption(), None), replacing(Path(sys.argv[1])) as passing:
        passing.write_text("half")
        print("writing", flush=True)
        for _ in range(3000):
            time.sleep(0.01)  # a signal just before a sleep is handled after it only
except (KeyboardInterrupt, Terminated):
    sys.exit(3)
"""


def test_the_largest_seed_is_read_again(tmp_path):
    """`hdopt run --verify` reads it from results.json."""
    (tmp_path / "r.json").write_text(to_json({"seed": 2**63 - 1, "least": -(2**63)}))
    assert read_json(tmp_path / "r.json", "another") == {"seed": 2**63 - 1, "least": -(2**63)}


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_leaves_no_passing_file(tmp_path, number):
    (tmp_path / "report.html").write_text("old")
    with subprocess.Popen(
        [sys.executable, "-c", SLOW_WRITER, str(tmp_path / "report.html")], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "writing\n"
        assert len(names(tmp_path)) == 2
        process.send_signal(number)
        assert process.wait(20) == 3
    assert names(tmp_path) == ["report.html"]
    assert (tmp_path / "report.html").read_text() == "old"


def interrupted_at(line, work):
    """Run `work` with a SIGINT at the `line`th line that hdopt.files or contextlib runs in it; whether it came."""
    left = line

    def trace(frame, event, argument):
        nonlocal left
        if not frame.f_code.co_filename.endswith(("hdopt/files.py", "contextlib.py")):
            return None
        if event == "line":
            left -= 1
            if left == 0:
                signal.raise_signal(signal.SIGINT)
        return trace

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.settrace(trace)
    try:
        work()
        return False
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(None)
        signal.signal(signal.SIGINT, before)


def test_an_interruption_at_any_line_leaves_all_files_or_none(tmp_path, monkeypatch):
    """And none of a passing name, however late it comes."""
    monkeypatch.setattr(os, "fsync", lambda handle: None)  # slow, and changes no name
    wanted = [tmp_path / name for name in "ab"]

    def write():
        with replacing_all(wanted) as passing:
            for path in passing:
                path.write_text("new")

    line, outcomes = 0, set()
    came = True
    while came:
        line += 1
        for path in wanted:
            path.write_text("old")
        came = interrupted_at(line, write)
        if names(tmp_path) != ["a", "b"]:
            gc.collect()  # what an interrupted `with` statement had not entered yet
        assert names(tmp_path) == ["a", "b"], line
        found = {path.read_text() for path in wanted}
        assert len(found) == 1, line
        outcomes |= found
    assert line > 50 and outcomes == {"old", "new"}


def test_a_signal_that_compiled_code_swallows_stops_the_names(tmp_path):
    with noting_interruptions() as noted, pytest.raises(KeyboardInterrupt), replacing(tmp_path / "a") as passing:
        passing.write_text("whole")
        noted.came.append(KeyboardInterrupt())
    assert names(tmp_path) == []
    with noting_interruptions() as noted:
        noted.came.append(KeyboardInterrupt())  # one that a search has answered with its best so far
        write_text(tmp_path / "a", "whole")
    assert names(tmp_path) == ["a"]


def test_a_pipe_that_nothing_reads_is_refused_and_one_with_a_reader_gets_it_all(tmp_path):
    pipe, link, other = tmp_path / "pipe.txt", tmp_path / "link.txt", tmp_path / "other.txt"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for name in (pipe, link):
        with pytest.raises(HdoptError, match=rf"cannot write {re.escape(str(name))}: it is a pipe that nothing reads"):
            with replacing_all([other, name]) as passing:
                for path in passing:
                    path.write_text("x")
        assert names(tmp_path) == ["link.txt", "pipe.txt"]
        text = "0123456789" * 100_000  # more than a pipe holds
        got = tmp_path / "got"
        with open(got, "w") as into, subprocess.Popen(["cat", str(name)], stdout=into) as reader:
            deadline = time.monotonic() + 20
            while True:
                try:
                    write_text(name, text)
                    break
                except HdoptError:  # not opened yet
                    assert time.monotonic() < deadline
            assert reader.wait(20) == 0
        assert got.read_text() == text
        got.unlink()
    assert link.is_symlink() and names(tmp_path) == ["link.txt", "pipe.txt"]


READER = """
import sys
from pathlib import Path
from hdopt.files import write_text
while True:
    for letter in "ab":
        write_text(Path(sys.argv[1]), letter * 1_000_000)
"""


def test_sigkill_at_any_moment_leaves_a_whole_file(tmp_path):
    target = tmp_path / "report.html"
    target.write_text("a" * 1_000_000)
    for delay in (0.21, 0.25, 0.3, 0.33):
        process = subprocess.Popen([sys.executable, "-c", READER, str(target)])
        time.sleep(delay)
        process.kill()
        process.wait(20)
        text = target.read_text()
        assert len(text) == 1_000_000 and text in ("a" * 1_000_000, "b" * 1_000_000)


def test_no_cell_of_a_table_is_a_formula_and_numbers_stay_numbers():
    import io

    import pandas as pd

    formulas = ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "\t=1", "\r=1"]
    frame = pd.DataFrame(
        {"=name": formulas, "value": [-1.5, 2, -3, 4e-9, 5, 6], "text": ["-1.5", "+2", "a=b", "", "x", "é"]},
        index=pd.Index(["=a", "b", "c", "d", "e", "f"], name="@index"),
    )
    before = frame.copy()
    back = pd.read_csv(io.StringIO(to_csv(frame, index=True)), keep_default_na=False, dtype={"text": str})
    assert list(back.columns) == ["'@index", "'=name", "value", "text"]
    assert list(back["'=name"]) == ["'" + formula for formula in formulas]
    assert list(back["value"]) == list(frame["value"]) and back["value"].dtype == float
    assert list(back["text"]) == list(frame["text"]) and back["'@index"][0] == "'=a"
    pd.testing.assert_frame_equal(frame, before)


WRITE_WHOLE_FILES = {
    "hdopt/files.py": "the one writer",
    "hdopt/cli/__init__.py": "/dev/null in place of a closed stream",
    "hdopt/workflow/compare.py": "into passing names of the one writer",
    **dict.fromkeys(
        (f"geometry/{name}.py" for name in
         ("step", "mesh", "dxf", "cam_table", "grinding", "inspection", "mating_sheet", "formats", "sheet_archive")),
        "into passing names of the one writer, which export gives them",
    ),
}  # fmt: skip
ROOT = Path(__file__).parents[2]


def opens_to_write(call):
    """Whether a call opens a file to write: Path.write_text, Path.write_bytes, or open with such a mode."""
    if isinstance(call.func, ast.Attribute) and call.func.attr in ("write_text", "write_bytes"):
        return True
    name = call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")
    modes = [*call.args[:2], *(keyword.value for keyword in call.keywords if keyword.arg == "mode")]
    said = {mode.value for mode in modes if isinstance(mode, ast.Constant)}
    return name == "open" and bool(said & {"w", "wb", "a", "ab", "x", "xb", "w+", "wt"})


def test_no_output_goes_past_the_one_writer():
    """The bench (`hdopt/bench`) apart, which shares no code with the rest, so that its proof is one."""
    found = set()
    for folder in ("hdopt", "geometry", "studies"):
        for path in (ROOT / folder).rglob("*.py"):
            name = path.relative_to(ROOT).as_posix()
            calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
            if any(map(opens_to_write, calls)) and not name.startswith("hdopt/bench/"):
                found.add(name)
    assert found <= WRITE_WHOLE_FILES.keys()
