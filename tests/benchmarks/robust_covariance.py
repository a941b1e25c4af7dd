"""Our Newey-West covariance beside statsmodels'. `python -m tests.benchmarks.robust_covariance`

statsmodels is no dependency: `pip install statsmodels` first, in an environment of its own.
"""

from __future__ import annotations

import importlib.metadata
import time

import numpy as np

from hdopt.diagnosis.inference.newey_west import newey_west

TURNS, ROWS, NUMBERS, LAGS, REPEATS = 80, 8000, 30, 10, 20


def main() -> None:
    """Print how far apart the two are, how long each takes, and what statsmodels weighs."""
    start = time.perf_counter()
    from statsmodels.stats.sandwich_covariance import S_hac_groupsum

    print(f"import of statsmodels: {time.perf_counter() - start:.2f} s")
    rows = np.random.default_rng(0).normal(size=(ROWS, NUMBERS))
    turn = np.repeat(np.arange(TURNS), ROWS // TURNS)

    def ours() -> np.ndarray:
        scores = np.zeros((TURNS, NUMBERS))
        np.add.at(scores, turn, rows)
        return newey_west(scores, LAGS)

    found = {}
    for name, work in {"hdopt": ours, "statsmodels": lambda: S_hac_groupsum(rows, turn, nlags=LAGS)}.items():
        start = time.process_time()
        for _ in range(REPEATS):
            found[name] = work()
        print(f"{name}: {1e3 * (time.process_time() - start) / REPEATS:.2f} ms")
    apart = np.abs(found["hdopt"] - found["statsmodels"]).max() / np.abs(found["hdopt"]).max()
    print(f"they differ by {apart:.1e} of the largest entry")
    files = [file for package in ("statsmodels", "patsy") for file in importlib.metadata.files(package) or []]
    print(f"statsmodels and patsy: {sum(file.locate().stat().st_size for file in files) / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
