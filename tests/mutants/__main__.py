"""Put cosmic-ray's faults in, one at a time, and run a room's tests: `python -m tests.mutants ROOM... [--sample N]`.

They are tried as those made by hand are (`tests/mutants/trial.py`): the tests that call the faulted function first.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path

import cosmic_ray.plugins
from cosmic_ray.commands.init import init
from cosmic_ray.modules import find_modules
from cosmic_ray.mutating import mutate_code
from cosmic_ray.work_db import WorkDB, use_db

from tests.mutants.hand_made import ROOT, Fault
from tests.mutants.rooms import ROOMS
from tests.mutants.trial import load_libraries, refreshed_tree, tried

SEED = 2026
INCOMPETENT = "incompetent"
"""A mutant that is no Python, or no other text than before."""


def key_of(mutation) -> str:
    """'module:line:operator:occurrence' of a mutation."""
    return f"{mutation.module_path}:{mutation.start_pos[0]}:{mutation.operator_name}:{mutation.occurrence}"


def mutations_of(room: str, folder: Path) -> list:
    """All of cosmic-ray's mutations of `room`, in the order that the seed draws; their list is made in `folder`."""
    listed = folder / f"{room}.sqlite"
    listed.unlink(missing_ok=True)
    before = Path.cwd()
    os.chdir(ROOT)
    try:
        with use_db(str(listed), WorkDB.Mode.create) as database:
            init(find_modules([Path("hdopt") / room]), database, {})
            found = sorted((one for item in database.work_items for one in item.mutations), key=key_of)
    finally:
        os.chdir(before)
    random.Random(SEED).shuffle(found)
    return found


def fault_of(room: str, mutation) -> Fault | None:
    """`mutation` as a fault of `room`, asked of all its tests; None where it makes no other text."""
    path = ROOT / mutation.module_path
    text = path.read_text(encoding="utf-8")
    operator = cosmic_ray.plugins.get_operator(mutation.operator_name)(**mutation.operator_args)
    mutated = mutate_code(text, operator, mutation.occurrence)
    if mutated is None or mutated == text:
        return None
    try:
        compile(mutated, str(path), "exec")
    except SyntaxError:
        return None
    return Fault(room, key_of(mutation), str(mutation.module_path), text, mutated, tests_of(room))


def tests_of(room: str) -> tuple[str, ...]:
    """Files of the tests of `room`, below `tests`."""
    tests = ROOT / "tests"
    named = (str(path.relative_to(tests)) for pattern in ROOMS[room].tests for path in sorted(tests.glob(pattern)))
    return tuple(dict.fromkeys(named))


def run(room: str, folder: Path, sample: int | None) -> dict[str, str]:
    """Mutant -> 'killed', 'survived', 'timeout' or 'incompetent', for the first `sample` of `room` in seeded order.

    What was run before is kept in `folder` and not run again.
    """
    kept = folder / f"{room}.json"
    done: dict[str, str] = json.loads(kept.read_text()) if kept.exists() else {}
    chosen = mutations_of(room, folder)[:sample]
    faults = {key_of(one): fault_of(room, one) for one in chosen if key_of(one) not in done}
    done |= {key: INCOMPETENT for key, fault in faults.items() if fault is None}
    asked: Sequence[Fault] = [fault for fault in faults.values() if fault is not None]
    for number, (fault, said, _) in enumerate(tried(asked, refreshed_tree(folder), folder), start=1):
        done[fault.name] = said
        kept.write_text(json.dumps(done, indent=1))
        print(f"{number}/{len(asked)} {said}: {fault.name}", flush=True)
    return {key_of(one): done.get(key_of(one), "not asked") for one in chosen}


def report(room: str, found: dict[str, str], equivalent: Iterable[str]) -> bool:
    """Print the share killed, time-outs apart, and every survivor; whether the room's target is met."""
    left_out = set(equivalent)
    counted = {key: said for key, said in found.items() if key not in left_out and said in ("killed", "survived")}
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
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "mechanical", help="what was run is kept here")
    options = parser.parse_args()
    for room in options.rooms:
        if room not in ROOMS:
            parser.error(f"unknown room {room!r}; there are {', '.join(ROOMS)}")
    folder = options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    load_libraries()
    equivalent = tomllib.loads((ROOT / "tests" / "mutants" / "equivalents.toml").read_text(encoding="utf-8"))
    met = [report(room, run(room, folder, options.sample), equivalent) for room in options.rooms or ROOMS]
    return 0 if all(met) else 1


if __name__ == "__main__":
    raise SystemExit(main())
