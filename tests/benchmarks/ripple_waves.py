"""What a ripple at the teeth takes and how close it comes, wave by wave and part by part, in one run.

`python -m tests.benchmarks.ripple_waves [DRIVES]` says, at the shipped tolerances and at three times them, how many
base kernels a drive and direction takes under ripples of several sizes, both ways; then how far DRIVES drives (600, two
minutes) under the first of them are from the exact geometry, both ways.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from cases import drive, random_errors

from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.kernel import design_of
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin
from hdopt.simulation import EffectValues, Operation
from hdopt.simulation.batch import stacked_peak_to_peak_arcmin, tabulate
from hdopt.simulation.extremes import peak_to_peak_arcmin
from hdopt.simulation.model import ExtendedModel
from hdopt.simulation.turn.kernel import extremes_block
from hdopt.simulation.turn.waves import NO_WAVES
from tests.benchmarks.page import seconds_of

TIMED, DRIVES = 4096, 600
SIZES = (0.0224, 0.007, 0.003)
"""Amplitudes, arcmin; of the last no drive is taken wave by wave."""
SCALES = (1.0, 3.0)
"""Errors over the shipped tolerances."""
DRIVE = drive()
GEAR = DRIVE.geometry
WITHIN = 1e-3
"""arcmin."""


def ripple(arcmin: float) -> EffectValues:
    """A mesh without sidebands, twice as large in its sine as in its cosine."""
    return EffectValues("tooth_mesh", {"sidebands": (0,)}, (2 * arcmin / 5**0.5, arcmin / 5**0.5))


def tables(arcmin: float):
    """The table of such a ripple, part by part and wave by wave, and its turn."""
    both = []
    for by_waves in (False, True):
        table = tabulate(DRIVE, [ripple(arcmin)], Operation())
        turns, _ = table.in_lanes(GEAR.arcmin_per_mm, GEAR.beat_phases, GEAR.flexspline_advance)
        if not by_waves:
            turns[:] = [turn._replace(waves=NO_WAVES) for turn in turns]
        both.append((table, turns[0]))
    return both


def kernels(arcmin: float, matrix: np.ndarray) -> list[float]:
    """Base kernels that a drive of `matrix` takes, part by part and wave by wave."""
    design, base = design_of(DRIVE), seconds_of(lambda: matrix_peak_to_peak_arcmin(DRIVE, matrix))
    found = []
    for _, turn in tables(arcmin):
        out = np.full((len(matrix), 2), np.inf)
        found.append(seconds_of(lambda turn=turn, out=out: extremes_block(design, matrix, turn, out)) / base)
    return found


def main(drives: int) -> None:
    for scale in SCALES:
        for arcmin in SIZES:
            by_parts, by_waves = kernels(arcmin, random_errors(TIMED, seed=0, scale=scale).to_matrix())
            print(f"{scale:g} x, {arcmin:g} arcmin: {by_parts:.1f} base kernels part by part, {by_waves:.1f} by waves")
    for scale in SCALES:
        matrix, effects = random_errors(drives, seed=31, scale=scale).to_matrix(), (ripple(SIZES[0]),)
        models = (ExtendedModel(DRIVE, DriveErrors.from_matrix(row), effects, geometry="exact") for row in matrix)
        exact = np.array([peak_to_peak_arcmin(model) for model in models])
        for way, (table, _) in zip(("part by part", "by waves"), tables(SIZES[0]), strict=True):
            off = np.abs(stacked_peak_to_peak_arcmin(DRIVE, matrix, table) - exact)
            print(
                f"{scale:g} x, {way}: {100 * np.mean(off <= WITHIN):.2f} % within {WITHIN:g}, largest {off.max():.1e}"
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else DRIVES)
