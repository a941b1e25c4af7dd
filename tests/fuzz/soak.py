"""`make fuzz`: a soak of many inputs of each kind, seeded, resumable, with a report.

    python -m tests.fuzz.soak --out build/fuzz --inputs 100000 --seed 1

Inputs come in rounds of a hundred, each with a seed of its own; a round that is done is kept in OUT/state.json, and the
next call goes on after it. A failure is written whole to OUT/failures and the soak goes on.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
import traceback
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings

from hdopt.files import write_text
from tests.fuzz.rule import KINDS

ROUND = 100


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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("build/fuzz"))
    parser.add_argument("--inputs", type=int, default=100_000, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after so long; the next call goes on")
    asked = parser.parse_args()
    (asked.out / "failures").mkdir(parents=True, exist_ok=True)
    state_file = asked.out / "state.json"
    state = json.loads(state_file.read_text()) if state_file.is_file() else {}
    if state.get("seed") != asked.seed or state["kinds"].keys() != KINDS.keys():
        state = {"seed": asked.seed, "kinds": {kind: {"rounds": 0, "inputs": 0, "failures": 0} for kind in KINDS}}
    began, spent = time.monotonic(), state.get("seconds", 0.0)
    todo = True
    with tempfile.TemporaryDirectory() as scratch:
        while todo and time.monotonic() - began < 60 * asked.minutes:
            todo = False
            for kind, done in state["kinds"].items():
                if done["inputs"] >= asked.inputs:
                    continue
                todo = True
                tried, failure = soak_round(kind, asked.seed * 10**9 + done["rounds"], Path(scratch))
                done["rounds"] += 1
                done["inputs"] += tried
                if failure is not None:
                    done["failures"] += 1
                    write_text(asked.out / "failures" / f"{kind}-{done['rounds']}.txt", failure)
                state["seconds"] = spent + time.monotonic() - began
                write_text(state_file, json.dumps(state, indent=2) + "\n")
    print(f"{'kind':14s} {'inputs':>8s} {'failures':>8s}")
    for kind, done in state["kinds"].items():
        print(f"{kind:14s} {done['inputs']:8d} {done['failures']:8d}")
    print(f"seed {state['seed']}, {state.get('seconds', 0.0):.0f} s in all")


if __name__ == "__main__":
    main()
