"""Put cosmic-ray's faults in, one at a time, and run a room's tests: `python -m tests.mutants ROOM... [--sample N]`.

They are tried as those made by hand are (`tests/mutants/trial.py`): in the test files that are about the faulted file
(`tests/mutants/drawing.py`), the tests that call the faulted function first.
"""

from __future__ import annotations

import argparse
import json
import tomllib
from collections.abc import Iterable
from itertools import islice
from pathlib import Path

from tests.mutants.drawing import drawn
from tests.mutants.hand_made import ROOT
from tests.mutants.rooms import ROOMS
from tests.mutants.trial import load_libraries, refreshed_tree, tried


def run(room: str, folder: Path, sample: int | None) -> dict[str, str]:
    """Mutant -> 'killed', 'survived', 'timeout' or 'no test', for the first `sample` of `room` in seeded order.

    What was run before is kept in `folder` and not run again.
    """
    kept = folder / f"{room}.json"
    done: dict[str, str] = json.loads(kept.read_text()) if kept.exists() else {}
    chosen = list(islice(drawn(room), sample))
    asked = [fault for fault in chosen if fault.tests and fault.name not in done]
    for number, (fault, said, _) in enumerate(tried(asked, refreshed_tree(folder), folder), start=1):
        done[fault.name] = said
        kept.write_text(json.dumps(done, indent=1))
        print(f"{number}/{len(asked)} {said}: {fault.name}", flush=True)
    return {one.name: done.get(one.name, "not asked" if one.tests else "no test") for one in chosen}


def report(room: str, found: dict[str, str], equivalent: Iterable[str]) -> bool:
    """Print the share killed, time-outs apart, and every survivor; whether the room's target is met."""
    left_out = set(equivalent)
    counted = {
        key: said for key, said in found.items() if key not in left_out and said in ("killed", "survived", "no test")
    }
    killed = sum(said == "killed" for said in counted.values())
    share = killed / len(counted) if counted else 1.0
    apart = sum(said == "timeout" for said in found.values())
    print(f"{room}: {killed} of {len(counted)} killed ({share:.0%}, target {ROOMS[room]:.0%}), {apart} timed out")
    for key in sorted(key for key, said in counted.items() if said != "killed"):
        print(f"  {counted[key]}: {key}")
    return share >= ROOMS[room]


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
