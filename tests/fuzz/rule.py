"""One command on one input, held to the rule."""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path

from hypothesis import strategies as st

from hdopt.cli import main
from tests.fuzz import strategies

LONGEST_MESSAGE = 2000


def held(arguments: list[str], *places: str) -> int:
    """Run a command in this process; its status, after checking how it ended. A refusal names one of the `places`."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(arguments)
        except SystemExit as ended:
            status = ended.code
    said = err.getvalue()
    if status in (130, 143):
        raise KeyboardInterrupt  # it is the soak that was to end
    assert status in (0, 1, 2), (arguments, status)
    assert "Traceback (most" not in said and "HDOPT_TRACEBACK=1" not in said, said
    assert len(said) <= LONGEST_MESSAGE, said[:200]
    if status == 2 and "Usage:" not in said:
        assert said.startswith("hdopt: ") and said.count("\n") <= 3, said
        assert any(place in said for place in places), (arguments, said)
    if "--json" in arguments and arguments[-1] == "-" and status != 2:
        json.loads(out.getvalue(), parse_constant=lambda name: 1 / 0)
    return status


def study(content: bytes, folder: Path) -> None:
    """A refusal says at which line to look, or what stands nowhere."""
    (folder / "s.toml").write_bytes(content)
    no_toml = ("s.toml is not a text file: line ", "TOML, line ", "(at line ", "(at the end, line ")
    held(["profile", str(folder / "s.toml"), "--json", "-"], "s.toml, line ", *no_toml, " missing", "does not have")


def number(content: tuple[str, list[str]], folder: Path) -> None:
    """One number far off: whatever fails over it says in which file, and at which line, to look."""
    text, command = content
    (folder / "s.toml").write_text(text)
    held([command[0], str(folder / "s.toml"), *command[1:], "--json", "-"], "s.toml, line ")


def recording(content: bytes, folder: Path) -> None:
    """Read and checked only: what a diagnosis does after that takes seconds."""
    from hdopt.errors import HdoptError
    from hdopt.recordings.read import read_recording

    (folder / "r.csv").write_bytes(content)
    try:
        read_recording(folder / "r.csv", 80.0)
    except HdoptError as error:
        assert "r.csv" in str(error) or "ratio" in str(error), str(error)[:300]


def cam(content: bytes, folder: Path) -> None:
    (folder / "cam.csv").write_bytes(content)
    chosen = ("profile=measured", "wave_generator.surface=cam", f"wave_generator.file={folder / 'cam.csv'}")
    held(["profile", *(word for one in chosen for word in ("--set", one)), "--json", "-"], "cam.csv", "--set ")


def allocation(content: bytes, folder: Path) -> None:
    from hdopt.errors import HdoptError
    from hdopt.study import load_study
    from hdopt.workflow.allocation_file import read_allocation

    (folder / "a.json").write_bytes(content)
    try:
        found = read_allocation(folder / "a.json", load_study("csf-25-80"))
    except HdoptError as error:
        assert "a.json" in str(error)
    else:
        assert all(0 < value < float("inf") for value in found.values())


def options(words: list[str], folder: Path) -> None:
    words = [word for word in words if word != "--json"]
    given = (repr(word)[1:-1][:20] for word in words if word)
    held(["profile", *words], "--", "option", "unknown study", "extra argument", *given)


KINDS: dict[str, tuple[st.SearchStrategy, object]] = {
    "studies": (strategies.STUDY_FILES, study),
    "numbers": (strategies.NUMBERS, number),
    "recordings": (strategies.RECORDING_FILES, recording),
    "cams": (strategies.CAM_FILES, cam),
    "allocations": (strategies.ALLOCATION_FILES, allocation),
    "options": (strategies.OPTIONS, options),
}
"""Kind of input -> how it is made, and what is done with one."""
