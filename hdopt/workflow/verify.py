"""Repeat a run and compare: whether the same study, seed and version still give the same files."""

from __future__ import annotations

import json
import math
import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast  # Any: values of JSON

from hdopt.errors import HdoptError
from hdopt.files import ShownAsTable, read_json
from hdopt.report import REPORT_FILE, RESULTS_FILE
from hdopt.study import load_study
from hdopt.words import counted
from hdopt.workflow.provenance import provenance
from hdopt.workflow.run import Progress, run_study
from hdopt.workflow.texts import with_texts

if TYPE_CHECKING:
    import pandas as pd

MOST_TOLD = 5
"""Numbers that differ, of which the answer tells."""


@dataclass(frozen=True)
class Verification(ShownAsTable):
    """What a repetition gave. `same` and `differing` are file names; `numbers` those of results.json that differ, as
    (place, then, now); `changes` what has changed since: study, inputs, libraries, machine."""

    folder: Path
    same: tuple[str, ...]
    differing: tuple[str, ...]
    numbers: tuple[tuple[str, Any, Any], ...]
    changes: tuple[str, ...]

    @property
    def repeated(self) -> bool:
        """Whether every file came out with the same bytes (the moment of writing and the provenance apart)."""
        return not self.differing

    def to_dict(self) -> dict[str, Any]:
        return {
            "folder": str(self.folder),
            "repeated": self.repeated,
            "same": list(self.same),
            "differing": list(self.differing),
            "numbers": [{"place": place, "then": then, "now": now} for place, then, now in self.numbers],
            "changes": list(self.changes),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row a file: whether it came out with the same bytes."""
        import pandas as pd

        rows = [(name, name in self.same) for name in sorted((*self.same, *self.differing))]
        return pd.DataFrame(rows, columns=["file", "same"])

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: the files, and the numbers that differ."""
        import pandas as pd

        numbers = pd.DataFrame(list(self.numbers), columns=["place", "then", "now"])
        return {"files": self.to_frame(), "numbers": numbers}


def verify_run(folder: str | Path, progress: Progress = iter) -> Verification:
    """Do the run in `folder` again, in a temporary folder, and compare every file; `progress` is told of
    each step.

    Raises `HdoptError` where the folder holds no run, or its study is no longer where it was.
    """
    folder = Path(folder)
    old = _results_of(folder)
    known, seed = old["provenance"], old["provenance"].get("seed", 1)
    recipe = known["source"]
    study = load_study(recipe.get("source"), tuple(recipe.get("overrides", ())), recipe.get("drive"))
    with tempfile.TemporaryDirectory() as scratch:
        new_folder = Path(scratch) / "run"
        run_study(study, new_folder, seed, progress)
        new = json.loads((new_folder / RESULTS_FILE).read_bytes())
        same: list[str] = []
        differing: list[str] = []
        for name in sorted({*known["files"], *new["provenance"]["files"]}):
            (same if _alike(folder / name, new_folder / name, known, new["provenance"]) else differing).append(name)
        then, now = (with_texts(r["steps"], f"{place}{os.sep}", "") for r, place in ((old, folder), (new, new_folder)))
        numbers = tuple(_differences(then, now))
    (differing if numbers else same).append(RESULTS_FILE)
    changes = tuple(_changes(known, provenance(study, seed)))
    return Verification(folder, tuple(same), tuple(differing), numbers, changes)


FORM: Mapping[str, type[Any]] = {"source": dict, "files": dict, "inputs": dict, "libraries": dict, "machine": dict}
"""What a run's provenance holds under these keys, where it has them; it must have the first two."""


def _results_of(folder: Path) -> dict[str, Any]:
    """The results of the run in `folder`, of the form that a run writes them in; `HdoptError` for any other."""
    path = folder / RESULTS_FILE
    old = read_json(path, "a folder that `hdopt run` wrote")
    known = old.get("provenance") if isinstance(old, dict) else None
    if not isinstance(known, dict) or not known.get("source") or not isinstance(old.get("steps"), dict):
        raise HdoptError(f"{path} does not say which study it is of; run the study again")
    recipe, seed, date = known["source"], known.get("seed", 1), known.get("date", "")
    sound = all(isinstance(known.get(key, {}), kind) for key, kind in FORM.items()) and "files" in known
    sound = sound and type(seed) is int and 0 <= seed < 2**63 and isinstance(date, str)
    names = [recipe.get("source"), recipe.get("drive")] if isinstance(recipe, dict) else [0]
    overrides = recipe.get("overrides", []) if isinstance(recipe, dict) else 0
    listed = isinstance(overrides, list) and all(isinstance(text, str) for text in overrides)
    if not (sound and listed and all(name is None or isinstance(name, str) for name in names)):
        raise HdoptError(f"{path} is not as `hdopt run` writes it, under provenance; run the study again")
    return cast(dict[str, Any], old)


MOMENTS = {
    ".step": re.compile(rb"(?<=')\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?=')"),
    ".dxf": re.compile(rb"\$TD(?:CREATE|UPDATE)\n 40\n.*|(?<= @ )\d{4}-\d\d-\d\dT[\d:.+]+|(?<=date )\d{4}-\d\d-\d\d"),
    ".html": re.compile(rb'<script type="application/octet-stream".*?</script>', re.DOTALL),
}
"""Where a file says when it was written; of the page the files that it carries, each of which is compared by itself."""


def _alike(old: Path, new: Path, then: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether two files have the same bytes but for the moment that they were written."""
    try:
        one, two = old.read_bytes(), new.read_bytes()
    except OSError:
        return False
    if old.name == REPORT_FILE:
        one, two = (b.replace(p.get("date", "").encode(), b"") for b, p in ((one, then), (two, now)))
    if one != two and old.suffix in MOMENTS:
        one, two = (MOMENTS[old.suffix].sub(b"", content) for content in (one, two))
    return one == two


def _differences(old: Any, new: Any, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted({*old, *new}):
            yield from _differences(old.get(key), new.get(key), f"{place}.{key}" if place else key)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for number, pair in enumerate(zip(old, new, strict=True)):
            yield from _differences(*pair, f"{place}[{number}]")
    elif old != new:
        yield place, old, new


def _changes(then: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """What is not as it was: said whether or not the results differ."""
    if then.get("study_sha256") != now.get("study_sha256"):
        yield "the study has changed"
    for name, digest in then.get("inputs", {}).items():
        if now["inputs"].get(name, digest) != digest:
            yield f"the input {name} has changed"
    for kind in ("libraries", "machine"):
        before, after = then.get(kind, {}), now.get(kind, {})
        for name in sorted({*before, *after}):
            if before.get(name) != after.get(name):
                yield f"{name} was {before.get(name, 'absent')}, is {after.get(name, 'absent')}"
    if then.get("hdopt") != now.get("hdopt"):
        yield f"hdopt was {then.get('hdopt')}, is {now.get('hdopt')}"


def lines(result: Verification) -> Iterator[str]:
    """The answer `result` in lines for a person."""
    said = "repeated" if result.repeated else "not repeated"
    yield f"{result.folder}: {said}; {counted(len(result.same), 'file')} the same, {len(result.differing)} differ"
    for name in result.differing:
        yield f"  differs: {name}"
    for place, then, now in result.numbers[:MOST_TOLD]:
        share = ""
        if isinstance(then, float) and isinstance(now, float) and then and math.isfinite(then):
            share = f" ({100 * (now / then - 1):+.3g} %)"
        yield f"  {place}: was {then!r}, is {now!r}{share}"
    if len(result.numbers) > MOST_TOLD:
        yield f"  and {counted(len(result.numbers) - MOST_TOLD, 'more number')}"
    for change in result.changes:
        yield f"  note: {change}"
