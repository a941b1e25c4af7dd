"""`make fuzz`: a soak of many inputs of each kind, seeded, resumable, with a report.

    python -m tests.fuzz.soak --out build/fuzz --inputs 100000 --seed 1
    python -m tests.fuzz.soak --out build/fuzz --page docs/scale.md    # no inputs: writes what was done into the page

Inputs come in rounds of a hundred, each with a seed of its own; a round that is done is kept in OUT/state.json, and the
next call goes on after it. The kind that has had the least processor time is next. A failure is written whole to
OUT/failures and the soak goes on.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
import traceback
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings

from hdopt.files import write_text
from tests.fuzz.rule import KINDS

ROUND = 100
IN_MEMORY = Path("/dev/shm")
"""Where inputs are written if it can be: a disk takes longer than many a command."""
START, END = "<!-- written by: make fuzz -->", "<!-- end of the soak -->"


def soak_round(kind: str, number: int, folder: Path) -> tuple[int, str | None]:
    """Inputs tried and, where one failed, what it was and how."""
    strategy, rule = KINDS[kind]
    tried, failed = [0], [None]

    @seed(number)
    @settings(
        max_examples=ROUND,
        deadline=None,
        database=None,
        phases=(Phase.generate,),
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def one(content):
        tried[0] += 1
        try:
            rule(content, folder)
        except Exception:
            failed[0] = f"{content!r}\n\n{traceback.format_exc()}"
            raise

    try:
        one()
    except Exception:  # kept above, whole
        return tried[0], failed[0] or traceback.format_exc()
    return tried[0], None


def next_kind(kinds: dict[str, dict], inputs: int) -> str | None:
    """The kind that lacks inputs and has had the least time; None where all have theirs."""
    wanting = [kind for kind, done in kinds.items() if done["inputs"] < inputs]
    return min(wanting, key=lambda kind: kinds[kind]["seconds"], default=None)


def soak(state: dict, out: Path, inputs: int, seconds: float) -> None:
    """Go on from `state` until each kind has had its `inputs`, or for so many `seconds`; kept after each round."""
    (out / "failures").mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    with tempfile.TemporaryDirectory(dir=IN_MEMORY if os.access(IN_MEMORY, os.W_OK) else None) as scratch:
        while (kind := next_kind(state["kinds"], inputs)) and time.monotonic() - began < seconds:
            done, worked = state["kinds"][kind], time.process_time()
            tried, failure = soak_round(kind, state["seed"] * 10**9 + done["rounds"], Path(scratch))
            done["rounds"] += 1
            done["inputs"] += tried
            done["seconds"] += time.process_time() - worked
            if failure is not None:
                done["failures"] += 1
                write_text(out / "failures" / f"{kind}-{done['rounds']}.txt", failure)
            write_text(out / "state.json", json.dumps(state, indent=2) + "\n")


def opened(out: Path, seed: int | None) -> dict:
    """What the folder `out` holds of a soak with `seed` (None: with any) of the kinds that there are now."""
    file = out / "state.json"
    state = json.loads(file.read_text()) if file.is_file() else {}
    if not state or seed not in (None, state["seed"]) or state["kinds"].keys() != KINDS.keys():
        empty = {"rounds": 0, "inputs": 0, "failures": 0, "seconds": 0.0}
        state = {"seed": seed or 1, "versions": [], "kinds": {kind: dict(empty) for kind in KINDS}}
    return state


def version() -> str:
    """The commit that is tried, as git names it."""
    described = subprocess.run(["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False)
    return described.stdout.strip() or "unknown"


def report(state: dict) -> str:
    """What was done, as a table of Markdown."""
    rows = [
        f"| {kind} | {done['inputs']} | {done['failures']} | {done['seconds']:.0f} |"
        for kind, done in state["kinds"].items()
    ]
    head = [f"Seed {state['seed']}, commit {', '.join(state['versions'])}.", ""]
    return "\n".join([*head, "| kind | inputs | failures | processor time, s |", "|---|---|---|---|", *rows])


def renewed(page: str, state: dict) -> str:
    """`page` with the report between its marks."""
    before, start, rest = page.partition(START)
    _, end, after = rest.partition(END)
    assert start and end, f"the page has no lines {START!r} and {END!r}"
    return f"{before}{START}\n\n{report(state)}\n\n{END}{after}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("build/fuzz"))
    parser.add_argument("--inputs", type=int, default=100_000, help="of each kind")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after so long; the next call goes on")
    parser.add_argument("--page", type=Path, help="write the last report into this page and do nothing else")
    asked = parser.parse_args()
    state = opened(asked.out, asked.seed)
    if asked.page:
        write_text(asked.page, renewed(asked.page.read_text(encoding="utf-8"), state))
        return
    if version() not in state["versions"]:
        state["versions"].append(version())
    soak(state, asked.out, asked.inputs, 60 * asked.minutes)
    print(report(state))


if __name__ == "__main__":
    main()
