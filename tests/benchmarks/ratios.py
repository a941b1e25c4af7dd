"""What `make benchmark` measured, as ratios within one run, for the page on verification.

    python -m tests.benchmarks.ratios build/benchmark.json docs/verification.md

writes the table between its two marks. A ratio of the shortest times of one run says more than seconds elsewhere.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path

START = "<!-- written by: make benchmark -->"
END = "<!-- end of the ratios -->"
PAIRS = (
    ("converged peak-to-peak of a drive: NumPy's walk of 80 turns at 1 deg over the compiled kernel",
     "test_walk_of_80_turns_in_numpy", "test_kernel[1]"),
    ("the same: the exact geometry's converged value over the kernel",
     "test_against_the_exact_geometry", "test_kernel[1]"),
    ("the same: one turn at 180 fixed angles, vectorized, 1-3 % low, over the kernel",
     "test_fixed_angles_in_numpy", "test_kernel[1]"),
    ("one design with slopes: the exact geometry by differences over the envelope",
     "test_exact_geometry", "test_envelope"),
)  # fmt: skip
"""What is compared, the slower benchmark, and the faster one."""


def seconds(measured: Mapping[str, dict]) -> dict[str, float]:
    """Name of a benchmark -> its shortest time, for one drive where it says how many it took."""
    return {name: one["stats"]["min"] / one["extra_info"].get("drives", 1) for name, one in measured.items()}


def table(run: dict) -> str:
    """The ratios of a `run` of pytest-benchmark, and what its own tests found beside times."""
    measured = {one["name"]: one for one in run["benchmarks"]}
    times = seconds(measured)
    rows = [
        f"| {what} | {times[slow] / times[fast]:,.3g} |".replace("e+05", "e5").replace("e+04", "e4")
        for what, slow, fast in PAIRS
        if slow in times and fast in times
    ]
    teeth = measured.get("test_measured_teeth_against_the_sines", {}).get("extra_info", {})
    if "times_the_sine" in teeth:
        rows.append(f"| a drive with measured teeth over one with sines | {teeth['times_the_sine']:.3g} |")
    if "own_times_the_sine" in teeth:
        rows.append(f"| the same, each drive with teeth of its own | {teeth['own_times_the_sine']:.3g} |")
    exact = measured.get("test_against_the_exact_geometry", {}).get("extra_info", {})
    if "largest" in exact:
        what = f"largest difference from the exact geometry, of {exact['drives']} random drives, arcmin"
        rows.append(f"| {what} | {exact['largest']:.1e} |")
    return "\n".join(["| what over what | ratio |", "|---|---|", *rows])


def renewed(page: str, run: dict) -> str:
    """`page` with the table of `run` between its marks."""
    before, start, rest = page.partition(START)
    _, end, after = rest.partition(END)
    assert start and end, f"the page has no lines {START!r} and {END!r}"
    return f"{before}{START}\n\n{table(run)}\n\n{END}{after}"


def main(measured: str, page: str) -> None:
    run = json.loads(Path(measured).read_text(encoding="utf-8"))
    Path(page).write_text(renewed(Path(page).read_text(encoding="utf-8"), run), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
