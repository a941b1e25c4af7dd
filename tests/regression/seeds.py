"""Asks the short cases with other seeds of the diagnosis: which answers hang on the draws of its starts?

`python -m tests.regression.seeds --seeds 0 2 3 [--only TEXT]`: some 5 minutes of two cores for each seed. A case that
is answered otherwise with one of them is a fault like any other, whatever the default seed says of it.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from hdopt.parallel.engine import engine_in_force
from tests.regression.cases import SPECS, answered
from tests.unit.test_named_cases import is_as_it_should_be


def asked(name: str, seed: int) -> str:
    """What the case `name` is answered with this `seed`; "" where it is as it should be."""
    with engine_in_force("process"):
        said = answered(name, ("--seed", str(seed)))
    try:
        is_as_it_should_be(name, said)
    except AssertionError:
        return f"{name}, seed {seed}: {said['verdict']}, {[effect['id'] for effect in said['effects']]}"
    return ""


def main() -> None:
    parser = argparse.ArgumentParser(description="The short cases with other seeds of the diagnosis.")
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--only", default="", help="what the names of the cases hold")
    options = parser.parse_args()
    names = [name for name in SPECS if options.only in name]
    total = wrong = 0
    with ProcessPoolExecutor(2) as pool:
        for seed in options.seeds:
            for found in pool.map(asked, names, repeat(seed)):
                total += 1
                wrong += bool(found)
                if found:
                    print(found, flush=True)
    print(f"{total - wrong} of {total} as they should be")


if __name__ == "__main__":
    main()
