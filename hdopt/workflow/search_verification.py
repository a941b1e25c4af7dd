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
    # Drawn teeth beside effects take 2 ms a drive; without the effects the quantile would be of other drives.
    if "tolerances" not in study.sections or (added is not None and drive_problem_of(study).response.teeth):
        return Verification(high - low, kernel, None)
    blocks = quantile_blocks(study, design, setup.settings.quantile, seed + 1, setup.trade)
    from scipy.stats import t

    middle = float(blocks.mean())
    half = float(t.ppf(0.975, BLOCKS - 1) * blocks.std(ddof=1) / np.sqrt(BLOCKS))
    searched = result.best.quantities.get("peak_to_peak_quantile_arcmin")
    fresh = QuantileCheck(setup.settings.quantile, middle, middle - half, middle + half, searched, VERIFICATION)
    return Verification(high - low, kernel, fresh)


def quantile_blocks(study: Study, design: Design, quantile: float, seed: int, trade: DesignConditions) -> Array:
    """The `quantile` of the converged peak-to-peak of `design` under the tolerances of `study`, in each of 16
    independent scramblings of `seed`: shape (16,). `trade` says which tilts follow the width, and which effects
    count."""
    from hdopt.kinematics import peak_to_peak_arcmin
    from hdopt.tolerance.drawn_teeth import drawn_peak_to_peak_arcmin
    from hdopt.tolerance.sampling import ScrambledSobol

    problem, drive = drive_problem_of(study), design.drive
    response, space = problem.response, problem.space
    sampling = ScrambledSobol(BLOCKS)
    values = []
    for replicate in range(BLOCKS):
        points = np.concatenate(list(sampling.blocks(seed, replicate, VERIFICATION // BLOCKS, space.dimension)))
        inputs = space.sample(points)
        rows = trade.of(response.errors(inputs).to_matrix(), design)
        if response.teeth:
            spans = drawn_peak_to_peak_arcmin(drive, rows, inputs, response.teeth, 1.0, 1.0)
        elif trade.added is None:
            spans = peak_to_peak_arcmin(drive, DriveErrors.from_matrix(rows))
        else:
            from hdopt.simulation.batch import matrix_peak_to_peak_arcmin

            spans = matrix_peak_to_peak_arcmin(drive, rows, trade.added.table(drive))
        values.append(np.quantile(spans, quantile))
    return np.array(values)
