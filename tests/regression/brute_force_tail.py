"""Renews `brute_force_tail.json`: plain Monte Carlo of the shipped drive, 1e8 samples, at a limit near 1e-5.

python tests/regression/brute_force_tail.py
"""

from __future__ import annotations

import json
from pathlib import Path

from hdopt.tolerance.sampling import PlainMonteCarlo
from hdopt.tolerance.stack import StackRequest, run_stack
from hdopt.workflow.stack import study_problem

FILE = Path(__file__).with_suffix(".json")
LIMIT_ARCMIN = 1.32
N = 10**8
SEED = 2026


def main() -> None:
    problem = study_problem("csf-25-80")
    result = run_stack(
        problem.response,
        problem.space,
        StackRequest(limit=LIMIT_ARCMIN, n=N, sampling=PlainMonteCarlo(), seed=SEED, quantiles=()),
    )
    beyond = round(result.n * (1 - result.conforming.value))
    FILE.write_text(json.dumps({"limit_arcmin": LIMIT_ARCMIN, "n": N, "seed": SEED, "beyond": beyond}, indent=2) + "\n")


if __name__ == "__main__":
    main()
