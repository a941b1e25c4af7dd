"""How close the compiled peak-to-peak is to the exact geometry, over every structure and every smooth profile.

`python -m tests.benchmarks.kernel_accuracy [DRIVES] [--processes N]` compares DRIVES drives (20,000) at the shipped
tolerances and as many at three times them, zero errors included, and says by how much they differ. The exact values
are kept in `build/kernel_accuracy`, so that a run that was stopped goes on where it was, and a changed kernel is
compared again in a second.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from cases import PROFILES, drive, random_errors

from hdopt.drive.errors import ERROR_NAMES, DriveErrors
from hdopt.drive.geometry import Structure
from hdopt.kinematics.extremes import peak_to_peak_by_search_arcmin
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin

KEPT = Path("build/kernel_accuracy")
DRIVES = 20_000
PART = 100
"""Drives that are kept at a time."""
WITHIN = 1e-3
"""arcmin."""


def sample(seed: int, scale: float) -> np.ndarray:
    """A part's errors, (PART, 12): random ones, and in the first drives of each part some or all of them zero."""
    matrix = random_errors(PART, seed=seed, scale=scale).to_matrix()
    matrix[0] = 0.0
    for row in range(1, 9):
        matrix[row, np.random.default_rng([seed, row]).random(len(ERROR_NAMES)) < 0.5] = 0.0
    return matrix


def exact(profile: str, structure: Structure, scale: float, part: int) -> np.ndarray:
    """The exact peak-to-peak of a part's drives, arcmin, (PART,): kept from an earlier run, or computed and kept."""
    file = KEPT / f"{profile}-{structure.value}-{scale:g}-{part}.npy"
    if file.exists():
        return np.load(file)
    errors = DriveErrors.from_matrix(sample(part, scale))
    values = peak_to_peak_by_search_arcmin(drive(PROFILES[profile], structure), errors)
    file.parent.mkdir(parents=True, exist_ok=True)
    np.save(file, values)
    return values


def main() -> None:
    """Print a line for each profile and structure, and one for all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("drives", type=int, nargs="?", default=DRIVES)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    designs = [(p, s) for p in PROFILES if PROFILES[p].tip_is_smooth for s in Structure]
    parts = -(-given.drives // (PART * len(designs)))
    with ProcessPoolExecutor(given.processes) as pool:
        for scale in (1.0, 3.0):
            differences = []
            for profile, structure in designs:
                jobs = [pool.submit(exact, profile, structure, scale, part) for part in range(parts)]
                design = drive(PROFILES[profile], structure)
                found = [matrix_peak_to_peak_arcmin(design, sample(part, scale)) for part in range(parts)]
                off = np.concatenate(found) - np.concatenate([job.result() for job in jobs])
                differences.append(off)
                says(f"{scale:g} x shipped tolerances, {profile}, {structure.value}", off)
            says(f"{scale:g} x shipped tolerances, all", np.concatenate(differences))


def says(title: str, off: np.ndarray) -> None:
    """One line about the differences `off`, arcmin."""
    size = np.abs(off)
    print(
        f"{title}: {len(off)} drives, {100 * np.mean(size <= WITHIN):.3f} % within {WITHIN:g} arcmin, "
        f"median {np.median(size):.1e}, mean {off.mean():+.1e}, largest {size.max():.1e}",
        flush=True,
    )


if __name__ == "__main__":
    main()
