"""Sobol' indices as SALib's own result, for those who know its tables and plots."""

from __future__ import annotations

from types import MethodType
from typing import Any  # Any: SALib's results have no types

import numpy as np

from hdopt.tolerance.sensitivity import Sobol


def sobol_in_salib(found: Sobol) -> Any:
    """The indices `found` as `SALib.analyze.sobol.analyze` gives them: a `ResultDict` with `to_df()` and `plot()`.

    S1, S1_conf, ST, ST_conf (d,) and, where pairs were asked for, S2, S2_conf (d, d), NaN but above the diagonal; each
    `_conf` is half the width of hdopt's own interval. Indices of groups are left out.
    """
    from SALib.analyze.sobol import to_df
    from SALib.util.results import ResultDict

    names = list(found.inputs)
    estimates = {
        "S1": [index.S1 for index in found.inputs.values()],
        "ST": [index.ST for index in found.inputs.values()],
    }
    result = ResultDict()
    for key, of in estimates.items():
        result[key] = np.array([one.value for one in of])
        result[f"{key}_conf"] = np.array([(one.high - one.low) / 2 for one in of])
    if found.second:
        for key in ("S2", "S2_conf"):
            result[key] = np.full((len(names), len(names)), np.nan)
        for pair, estimate in found.second.items():
            place = tuple(sorted(names.index(name) for name in pair))
            result["S2"][place] = estimate.value
            result["S2_conf"][place] = (estimate.high - estimate.low) / 2
    result.problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    result.to_df = MethodType(to_df, result)
    return result
