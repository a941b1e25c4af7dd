"""A registered proof, step by step; what a step writes is committed before the next.

    python -m hdopt.bench.register open NAME --cases 48 --minutes 35     hashes of program, settings and bench; commit
    python -m hdopt.bench.register seal NAME --out DIR                   cases by the seed of that commit; commit
    python -m hdopt.bench.answer --dir DIR --minutes 35 -- hdopt diagnose
    python -m hdopt.bench.baselines --dir DIR
    python -m hdopt.bench.register keep NAME --dir DIR                   keys, answers and figures; commit
    python -m hdopt.bench.page                                           docs/proof.md of all runs

The seed of a run is the hash of the commit that opened it, so that nobody can choose it. Cases are answered in the
order of their numbers, which is shuffled, until the minutes are over; one that was begun counts, whatever came of it.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any  # Any: values of JSON

from hdopt.bench import registry
from hdopt.bench.figures import figures
from hdopt.bench.generate import write
from hdopt.bench.score import score

SEED_DIGITS = 8


def open_run(folder: Path, name: str, cases: int, minutes: float, note: str = "") -> dict[str, Any]:
    """Enter the run `name` of `cases`, answered for `minutes` at most, into the register in `folder`, with a `note`."""
    if any(run["name"] == name for run in registry.runs(folder)):
        raise ValueError(f"the register has a run {name!r} already; runs stay, good or bad: choose another name")
    run = {
        "name": name,
        "date": datetime.now(UTC).date().isoformat(),
        "cases": cases,
        "minutes": minutes,
        "note": note,
        **registry.hashes(),
    }
    registry.put(folder, run)
    return run


def seed_of(commit: str) -> int:
    """Seed of a run from the hash of the `commit` that opened it."""
    return int(commit[:SEED_DIGITS], 16)


def opening_commit(folder: Path, name: str) -> str:
    """Hash of the commit that entered the run `name` into the register in `folder`."""
    log = ["git", "log", "--format=%H", "--reverse", f'-S"name": "{name}"', "--", "register.json"]
    done = subprocess.run(log, cwd=folder, capture_output=True, text=True)
    if not done.stdout.split():
        raise ValueError(f"no commit enters {name!r} into {folder / 'register.json'}; commit it first")
    return done.stdout.split()[0]


def seal(folder: Path, name: str, out: Path, workers: int = 1) -> dict[str, Any]:
    """Write the cases of the run `name` below `out` by `workers` processes, and their keys' SHA-256 into the register
    in `folder`."""
    run = registry.entry(folder, name)
    check_unchanged(run)
    run["commit"] = opening_commit(folder, name)
    run["seed"] = seed_of(run["commit"])
    run["keys"] = write(out, run["seed"], workers=workers, cases=run["cases"])
    registry.put(folder, run)
    return run


def check_unchanged(run: dict[str, Any]) -> None:
    """Raise where program, settings or bench are not those of the entry `run`."""
    for what, now in registry.hashes().items():
        if run[what] != now:
            raise ValueError(f"{what} is not what {run['name']} registered ({run[what][:12]}, now {now[:12]})")


def keep(folder: Path, name: str, source: Path) -> dict[str, Any]:
    """Keep keys and answers of the run `name`, made in `source`, beside the register in `folder`, with its figures."""
    run = registry.entry(folder, name)
    text = (source / "sealed" / "keys.jsonl").read_text()
    if registry.sha(text) != run["keys"]:
        raise ValueError(f"the keys in {source} are not those registered for {name}")
    told = json.loads((source / "answers.json").read_text())
    if told["program"] != run["program"]:
        raise ValueError(f"{source} was answered by another program than {name} registered")
    run["begun"] = told["begun"]
    run["seconds"] = round(told["seconds"])
    answers = [
        {"case": path.stem, "method": method, "answer": registry.compact(json.loads(path.read_text()))}
        for method, place in methods(source)
        for path in sorted(place.glob("*.json"))
    ]
    said = registry.lines(answers)
    run["answers"] = registry.sha(said)
    registry.write_xz(folder / f"{name}.keys.jsonl.xz", text)
    registry.write_xz(folder / f"{name}.answers.jsonl.xz", said)
    registry.put(folder, run)
    run["figures"] = {method: figures(score(*registry.kept(folder, name, method))) for method, _ in methods(source)}
    registry.put(folder, run)
    return run


def methods(source: Path) -> list[tuple[str, Path]]:
    """Name ("" for the program itself) and folder of every method that answered the cases in `source`."""
    others = sorted(path for path in (source / "baselines").glob("*") if path.is_dir())
    return [("", source / "answers"), *((path.name, path) for path in others)]


def main(arguments: Sequence[str] | None = None) -> None:
    """One step of a registered proof, as `arguments` say."""
    parser = argparse.ArgumentParser(prog="python -m hdopt.bench.register", description=__doc__)
    parser.add_argument("--register", type=Path, default=registry.FOLDER, help="folder of the register")
    steps = parser.add_subparsers(dest="step", required=True)
    opening = steps.add_parser("open")
    opening.add_argument("--cases", type=int, required=True)
    opening.add_argument("--minutes", type=float, default=0.0, help="0: until all are answered")
    opening.add_argument("--note", default="")
    sealing = steps.add_parser("seal")
    sealing.add_argument("--out", type=Path, required=True)
    sealing.add_argument("--workers", type=int, default=1)
    keeping = steps.add_parser("keep")
    keeping.add_argument("--dir", type=Path, required=True)
    for step in (opening, sealing, keeping):
        step.add_argument("name")
    options = parser.parse_args(arguments)
    if options.step == "open":
        run = open_run(options.register, options.name, options.cases, options.minutes, options.note)
    elif options.step == "seal":
        run = seal(options.register, options.name, options.out, options.workers)
    else:
        run = keep(options.register, options.name, options.dir)
    print(json.dumps(run, indent=1))


if __name__ == "__main__":
    main()
