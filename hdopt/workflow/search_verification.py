"""The best design checked by other means: the exact geometry, and its quantile over fresh drives."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.extremes import extremes_arcmin
from hdopt.optimize.design_space import Design
from hdopt.optimize.objectives import DesignConditions
from hdopt.optimize.records import QuantileCheck, SearchResult, Verification
from hdopt.study import Study
from hdopt.workflow.stack import drive_problem_of

VERIFICATION = 1 << 16
"""Fresh drives that verify a quantile; none of them was seen by the search."""
BLOCKS = 16
DEARER = 4
"""How many times fewer drives verify it where teeth are drawn beside effects, about 1 ms each."""


def verify(study: Study, result: SearchResult, seed: int) -> Verification:
    """The best design of a `result` against the exact geometry, and its quantile over drives of the `study` that are
    drawn with a seed next to `seed`."""
    setup = result.setup
    design = setup.space.design(result.chosen.combination, result.chosen.values)
    drive, errors = design.drive, setup.trade.errors_of(design)
    added = setup.trade.added
    if added is None:
        low, high = extremes_arcmin(drive, errors, "exact")
    else:
        from hdopt.simulation import ExtendedModel
        from hdopt.simulation.extremes import extremes_arcmin as extended_extremes_arcmin

        low, high = extended_extremes_arcmin(ExtendedModel(drive, errors, added.at(drive), added.operation))
    kernel = result.best.quantities.get("peak_to_peak_arcmin", float("nan"))
    if "tolerances" not in study.sections:
        return Verification(high - low, kernel, None)
    dear = added is not None and bool(drive_problem_of(study).response.teeth)
    drives = VERIFICATION // DEARER if dear else VERIFICATION
    blocks = quantile_blocks(study, design, setup.settings.quantile, seed + 1, setup.trade, drives)
    from scipy.stats import t

    middle = float(blocks.mean())
    half = float(t.ppf(0.975, BLOCKS - 1) * blocks.std(ddof=1) / np.sqrt(BLOCKS))
    searched = result.best.quantities.get("peak_to_peak_quantile_arcmin")
    fresh = QuantileCheck(setup.settings.quantile, middle, middle - half, middle + half, searched, drives)
    return Verification(high - low, kernel, fresh)


def quantile_blocks(
    study: Study, design: Design, quantile: float, seed: int, trade: DesignConditions, drives: int = VERIFICATION
) -> Array:
    """The `quantile` of the converged peak-to-peak of `design` under the tolerances of `study`, in each of 16
    independent scramblings of `seed`, so many `drives` in all: shape (16,). `trade` says which tilts follow the width,
    and which effects count."""
    from hdopt.kinematics import peak_to_peak_arcmin
    from hdopt.optimize.sampled_teeth import SampledTeeth
    from hdopt.tolerance.sampling import ScrambledSobol

    problem, drive = drive_problem_of(study), design.drive
    response, space = problem.response, problem.space
    sampling = ScrambledSobol(BLOCKS)
    added = None if trade.added is None else trade.added.table(drive)
    values = []
    for replicate in range(BLOCKS):
        points = np.concatenate(list(sampling.blocks(seed, replicate, drives // BLOCKS, space.dimension)))
        inputs = space.sample(points)
        rows = trade.of(response.errors(inputs).to_matrix(), design)
        if response.teeth:
            spans = SampledTeeth.of(response.teeth, inputs).peak_to_peak_arcmin(drive, rows, added=added)
        elif trade.added is None:
            spans = peak_to_peak_arcmin(drive, DriveErrors.from_matrix(rows))
        else:
            spans = trade.added.peaks_to_peaks_arcmin(drive, rows)
        values.append(np.quantile(spans, quantile))
    return np.array(values)
