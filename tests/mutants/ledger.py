"""What was asked of the tests and what came, kept in `tests/mutants/asked.json`: nobody need ask the same twice."""

from __future__ import annotations

import fcntl
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

from tests.mutants.hand_made import ROOT, Fault, faults_of, rooms

KEPT = ROOT / "tests" / "mutants" / "asked.json"


def digest_of(fault: Fault, tests: Sequence[str] = ()) -> str:
    """Of what an answer rests on: the text that the fault is in, and `tests`, all of its own where none is named."""
    digest = hashlib.sha256()
    for name in (fault.file, *(f"tests/{test}" for test in tests or fault.tests)):
        path = ROOT / name.split("::")[0]
        digest.update(path.read_bytes() if path.is_file() else b"gone")
    return digest.hexdigest()[:10]


def asked(kept: Path = KEPT) -> dict[str, list[str]]:
    """Fault's key -> what came, the digest it rests on, and the test file that noticed it, empty where none did."""
    found: dict[str, list[str]] = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    return found


def is_known(fault: Fault, found: dict[str, list[str]]) -> bool:
    """Whether `fault` was noticed by a test that stands as it stood, in a text that stands as it stood."""
    said, digest, by = found.get(fault.key, ["", "", ""])
    return said == "killed" and by in fault.tests and digest == digest_of(fault, (by,))


def keep(fault: Fault, answer: list[str], kept: Path = KEPT) -> None:
    """Write down an answer beside those of another process; faults that are on no list any more go."""
    with open(kept.with_suffix(".lock"), "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        found = asked(kept)
        found[fault.key] = answer
        listed = {one.key for room in rooms() for one in faults_of(room)} | {fault.key}
        lines = [f"{json.dumps(key)}: {json.dumps(found[key])}" for key in sorted(found) if key in listed]
        kept.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
