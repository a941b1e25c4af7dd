"""The register of runs: what stood still before each, and keys and answers kept so that anyone can score them again.

FOLDER/register.json holds one entry a run; beside it lie NAME.keys.jsonl.xz and NAME.answers.jsonl.xz. A hash of
sources is over the names and bytes of files, so that nothing of the judged program is imported here.
"""

from __future__ import annotations

import hashlib
import json
import lzma
from collections.abc import Iterable
from pathlib import Path
from typing import Any  # Any: values of JSON

from hdopt.bench.marking import COMPARED

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "proof"
PROGRAM = ("diagnosis", "effects", "simulation", "kinematics", "recordings")
"""Rooms of hdopt whose sources make an answer."""
SETTINGS = "diagnosis/settings"
FIT = (
    "heldout_rms_base_arcmin",
    "heldout_rms_extended_arcmin",
    "heldout_nested_rms_arcmin",
    "heldout_rms_generic_arcmin",
    "noise_floor_arcmin",
)


def sources_sha(*rooms: str, package: Path = ROOT / "hdopt") -> str:
    """SHA-256 of the Python sources of `rooms` (folders, or files without their suffix) below `package`."""
    digest = hashlib.sha256()
    for room in rooms:
        found = sorted((package / room).rglob("*.py")) or [package / f"{room}.py"]
        for path in found:
            digest.update(f"{path.relative_to(package).as_posix()}\n".encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def hashes(package: Path = ROOT / "hdopt") -> dict[str, str]:
    """SHA-256 of the program, its settings and the bench below `package`."""
    settings = [SETTINGS] if (package / f"{SETTINGS}.py").exists() or (package / SETTINGS).is_dir() else []
    return {
        "program": sources_sha(*PROGRAM, package=package),
        "settings": sources_sha(*settings, package=package),
        "bench": sources_sha("bench", package=package),
    }


def lines(records: Iterable[dict[str, Any]]) -> str:
    """`records` as text, one JSON object a line, keys in order: the form that is hashed and kept."""
    return "".join(
        json.dumps(r, sort_keys=True, separators=(",", ":"), default=lambda value: value.item()) + "\n" for r in records
    )


def sha(text: str) -> str:
    """SHA-256 of `text`."""
    return hashlib.sha256(text.encode()).hexdigest()


def runs(folder: Path = FOLDER) -> list[dict[str, Any]]:
    """Entries of the register in `folder`, the first run first."""
    path = folder / "register.json"
    found: list[dict[str, Any]] = json.loads(path.read_text()) if path.exists() else []
    return found


def entry(folder: Path, name: str) -> dict[str, Any]:
    """The run `name` of the register in `folder`."""
    for run in runs(folder):
        if run["name"] == name:
            return run
    raise ValueError(f"no run {name!r} in {folder / 'register.json'}; there are {[r['name'] for r in runs(folder)]}")


def put(folder: Path, run: dict[str, Any]) -> None:
    """Write the entry `run` into the register in `folder`, in the place of one of the same name."""
    folder.mkdir(parents=True, exist_ok=True)
    others = [old for old in runs(folder) if old["name"] != run["name"]]
    (folder / "register.json").write_text(json.dumps([*others, run], indent=1) + "\n")


def compact(answer: dict[str, Any]) -> dict[str, Any]:
    """What of an `answer` is scored."""
    effects = []
    for effect in answer.get("effects") or []:
        compared = COMPARED.get(effect.get("id"), ())
        stated = {
            name: {part: _short(value.get(part)) for part in ("value", "low", "high")}
            for name, value in (effect.get("parameters") or {}).items()
            if name in compared
        }
        effects.append({"id": effect.get("id"), "confidence": effect.get("confidence"), "parameters": stated})
    fit = answer.get("fit") or {}
    return {
        "schema": answer.get("schema"),
        "verdict": answer.get("verdict"),
        "effects": effects,
        "ambiguous_with": answer.get("ambiguous_with") or [],
        "fit": {name: _short(fit.get(name)) for name in FIT if name in fit},
    }


def _short(value: Any) -> Any:
    return float(f"{value:.6g}") if isinstance(value, float) else value


def write_xz(path: Path, text: str) -> None:
    """Write `text` to `path`, compressed; the same text gives the same bytes."""
    path.write_bytes(lzma.compress(text.encode(), preset=9 | lzma.PRESET_EXTREME))


def read_xz(path: Path) -> str:
    """The text of the compressed file `path`."""
    return lzma.decompress(path.read_bytes()).decode()


def kept(folder: Path, name: str, method: str = "") -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Answers and keys of the run `name` of the register in `folder`; `method`: those of a baseline.

    Refuses keys or answers whose SHA-256 is not the registered one. Cases that the run did not begin are left out.
    """
    run = entry(folder, name)
    text = read_xz(folder / f"{name}.keys.jsonl.xz")
    if sha(text) != run["keys"]:
        raise ValueError(f"{name}: keys are not those registered (sha256 {run['keys']})")
    said = read_xz(folder / f"{name}.answers.jsonl.xz")
    if sha(said) != run["answers"]:
        raise ValueError(f"{name}: answers are not those registered (sha256 {run['answers']})")
    keys = [json.loads(line) for line in text.splitlines()][: run["begun"]]
    found = [json.loads(line) for line in said.splitlines()]
    return {a["case"]: a["answer"] for a in found if a["method"] == method}, keys
