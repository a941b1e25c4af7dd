"""Put faults into a room one at a time and run its tests: `python -m tests.mutants ROOM... [--sample N]`."""

from __future__ import annotations

import argparse
import random
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from cosmic_ray.commands.init import init
from cosmic_ray.modules import find_modules
from cosmic_ray.mutating import mutate_and_test
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import TestOutcome

from tests.mutants.rooms import ROOMS

ROOT = Path(__file__).resolve().parents[2]
SEED = 2026
TIMEOUT_S = 600.0


def copy_of_tree(folder: Path) -> Path:
    """The files under version control, as they stand, below `folder`: mutants are made there and nowhere else."""
    tree = folder / "tree"
    if not tree.exists():
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
        for name in listed.decode().split("\0"):
            if name and (ROOT / name).is_file():
                (tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, tree / name)
    return tree


def key_of(item) -> str:
    """'module:line:operator:occurrence' of a mutant."""
    (mutation,) = item.mutations
    return f"{mutation.module_path}:{mutation.start_pos[0]}:{mutation.operator_name}:{mutation.occurrence}"


def command_of(room: str, tree: Path) -> str:
    """The test command of `room`, quick tests first failure last; golden answers are not among them."""
    files = [str(path.relative_to(tree)) for pattern in ROOMS[room].tests for path in (tree / "tests").glob(pattern)]
    quick = "-m 'not slow and not browser' --benchmark-disable -p no:cacheprovider"
    return f"{sys.executable} -m pytest -q -x {quick} {' '.join(sorted(set(files)))}"


def run(room: str, folder: Path, sample: int | None) -> dict[str, str]:
    """Mutant -> 'killed', 'survived', 'timeout' or 'incompetent', for the first `sample` of `room` in seeded order.

    What was run before is kept in `folder` and not run again.
    """
    import os

    tree = copy_of_tree(folder)
    os.chdir(tree)
    with use_db(str(folder / f"{room}.sqlite"), WorkDB.Mode.create) as database:
        if not database.num_work_items:
            init(find_modules([Path("hdopt") / room]), database, {})
        items = sorted(database.work_items, key=key_of)
        random.Random(SEED).shuffle(items)
        chosen = items[:sample]
        done = dict(database.results)
        for number, item in enumerate(chosen, start=1):
            if item.job_id not in done:
                result = mutate_and_test(item.mutations, command_of(room, tree), TIMEOUT_S)
                database.set_result(item.job_id, result)
                done[item.job_id] = result
                print(f"{number}/{len(chosen)} {key_of(item)}: {outcome(result)}", flush=True)
        return {key_of(item): outcome(done[item.job_id]) for item in chosen}


def outcome(result) -> str:
    """The outcome of one mutant in a word."""
    if result.test_outcome == TestOutcome.KILLED and result.output == "timeout":
        return "timeout"
    return str(result.test_outcome.value) if result.test_outcome else "incompetent"


def report(room: str, found: dict[str, str]) -> bool:
    """Print the share killed, time-outs apart, and every survivor; whether the room's target is met."""
    equivalent = tomllib.loads((ROOT / "tests" / "mutants" / "equivalents.toml").read_text())
    counted = {key: said for key, said in found.items() if key not in equivalent and said in ("killed", "survived")}
    killed = sum(said == "killed" for said in counted.values())
    share = killed / len(counted) if counted else 1.0
    apart = sum(said == "timeout" for said in found.values())
    print(
        f"{room}: {killed} of {len(counted)} killed ({share:.0%}, target {ROOMS[room].target:.0%}), {apart} timed out"
    )
    for key in sorted(key for key, said in counted.items() if said == "survived"):
        print(f"  survived: {key}")
    return share >= ROOMS[room].target


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"of {', '.join(ROOMS)}; all where omitted")
    parser.add_argument("--sample", type=int, help="only the first N mutants of each room, in seeded order")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "mutants", help="what was run is kept here")
    options = parser.parse_args()
    for room in options.rooms:
        if room not in ROOMS:
            parser.error(f"unknown room {room!r}; there are {', '.join(ROOMS)}")
    folder = options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    met = [report(room, run(room, folder, options.sample)) for room in options.rooms or ROOMS]
    return 0 if all(met) else 1


if __name__ == "__main__":
    raise SystemExit(main())
