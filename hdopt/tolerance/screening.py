"""Sensitivity by SALib's own samplers and analyses: Morris, delta, PAWN, RBD-FAST, DGSM.

All of them see the unit cube: an input of 0.3 is the value below which 30 % of its distribution lie, so that one
problem serves every distribution. The response is evaluated by hdopt, whatever SALib samples; the numbers are SALib's.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from typing import TYPE_CHECKING, Any  # Any: SALib's functions and results, which have no types

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError, unknown_name
from hdopt.figures import drawn
from hdopt.files import ShownAsTable
from hdopt.parallel.engine import Engine, engine_from
from hdopt.tolerance.response import Response, evaluate
from hdopt.tolerance.sampling import ScrambledSobol
from hdopt.tolerance.space import InputSpace

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure


EDGE = 1e-3
"""Share of an unbounded distribution that is left out at an open end: Morris and DGSM step to the ends of the cube,
where such an input is infinite."""
BLOCK = 4096
"""Rows that one task evaluates."""


@dataclass(frozen=True)
class Method:
    """One of SALib's methods: how many base points it takes as a rule, what it says, and whether its inputs must be
    independent. `sample(problem, n, seed)` is SALib's sampler, None where any sample serves; `analyze(problem, X, Y,
    seed)` its analysis."""

    n: int
    measures: tuple[str, ...]
    says: str
    independent: bool
    analyze: Callable[[dict[str, Any], Array, Array, int], Any]
    sample: Callable[[dict[str, Any], int, int], Array] | None = None


@dataclass(frozen=True)
class Screening(ShownAsTable):
    """What one of SALib's methods says of each input. `inputs` holds its measures by input, intervals as `_conf` (half
    width at 95 %); `X` (n, d) in the unit cube and `Y` (n,) are what it was computed from."""

    method: str
    n: int
    evaluations: int
    seed: int
    unit: str
    inputs: dict[str, dict[str, float]]
    says: str
    X: Array = field(repr=False)
    Y: Array = field(repr=False)
    result: Any = field(repr=False)
    """SALib's own, which has no type."""
    notes: tuple[str, ...] = ()
    """What SALib said while it worked."""
    study: str = ""

    def to_dict(self) -> dict[str, Any]:
        return {
            "study": self.study,
            "method": self.method,
            "n": self.n,
            "evaluations": self.evaluations,
            "seed": self.seed,
            "unit": self.unit,
            "inputs": self.inputs,
            "estimator": f"SALib: {self.says}",
            "notes": list(self.notes),
        }

    def to_frame(self) -> pd.DataFrame:
        """A pandas table: one row an input."""
        import pandas as pd

        return pd.DataFrame.from_dict(self.inputs, orient="index").rename_axis("name")

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """The method's first measure of every input. `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        table = self.to_frame()
        measure = str(table.columns[0])
        bars = go.Bar(y=table.index, x=table[measure], orientation="h")
        title = f"{self.study}: {self.method}"
        return drawn(go.Figure(bars, {"title": title, "xaxis_title": measure, "yaxis_title": "input"}), backend)

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet."""
        return {self.method: self.to_frame().reset_index()}

    def to_salib(self) -> Any:
        """SALib's own result: a `ResultDict` with `to_df()` and `plot()`."""
        return self.result


def salib_problem(space: InputSpace) -> dict[str, Any]:
    """SALib's description of `space`: the names of its inputs, each in the unit cube; an open end of a distribution is
    `EDGE` away from the end of the cube."""
    lower, upper = space.box
    low = np.where(np.isfinite(lower), 0.0, EDGE)
    high = np.where(np.isfinite(upper), 1.0, 1 - EDGE)
    bounds = np.stack([low, high], axis=1).tolist()
    return {"num_vars": space.dimension, "names": list(space.names), "bounds": bounds}


def run_screening(
    response: Response,
    space: InputSpace,
    method: str,
    *,
    n: int | None = None,
    seed: int = 1,
    engine: Engine | str | None = None,
    unit: str = "arcmin",
) -> Screening:
    """Sensitivity of `response` (in `unit`) to the inputs of `space` by one of SALib's methods.

    `method` is 'morris', 'delta', 'pawn', 'rbd_fast' or 'dgsm'; `n` its base points, its own number where None; `seed`
    that of sampling and resampling; `engine` computes the responses. 'delta', 'pawn' and 'rbd_fast' take the first
    points that a stack of the same seed takes. Raises `HdoptError` for an unknown method, for correlated inputs where
    the method takes independent ones, and for teeth that are drawn at random.
    """
    if method not in METHODS:
        raise HdoptError(unknown_name("sensitivity method", method, ("sobol", *METHODS)))
    chosen = METHODS[method]
    if chosen.independent and not space.copula.is_independent:
        raise HdoptError(
            f"{method} takes independent inputs, but some of this study are correlated; take delta or pawn, which "
            "need no independence, or Shapley effects"
        )
    if space.fields:
        raise HdoptError(
            f"{method} compares neighbouring values of an input, and {', '.join(sorted(space.fields))} are drawn at "
            "random, without neighbours; take the method 'sobol', or tooth amplitudes instead of pitch tolerances"
        )
    n = chosen.n if n is None else n
    if n < 2**7:
        raise HdoptError(f"n is {n}, too small for {method}; take at least {2**7}, as a rule {chosen.n}")
    problem = salib_problem(space)
    if chosen.sample is None:
        u = next(ScrambledSobol().blocks(seed, 0, n, space.dimension))[:n]
        points = space.copula.correlate(u)
    else:
        points = np.asarray(chosen.sample(problem, n, seed), float)
    values = _responses(response, space, points, method, engine)
    if np.ptp(values) == 0:
        raise HdoptError(f"the response is {values[0]:g} for every sample; there is no variance to attribute")
    with redirect_stdout(StringIO()) as said, warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        found = chosen.analyze(problem, points, values, seed)
    heard = [*said.getvalue().splitlines(), *(str(warning.message) for warning in warned)]
    notes = tuple(f"SALib: {line.strip()}" for line in dict.fromkeys(heard) if line.strip())
    inputs = {
        name: {measure: float(found[measure][i]) for measure in chosen.measures} for i, name in enumerate(space.names)
    }
    return Screening(method, n, len(values), seed, unit, inputs, chosen.says, points, values, found, notes)


def _responses(response: Response, space: InputSpace, points: Array, method: str, engine: Engine | str | None) -> Array:
    blocks = [points[i : i + BLOCK] for i in range(0, len(points), BLOCK)]
    tasks = [ScreeningTask(response, space, block, f"block {i} of {method}") for i, block in enumerate(blocks)]
    return np.concatenate(list(engine_from(engine).map(run_screening_task, tasks)))


@dataclass(frozen=True)
class ScreeningTask:
    """Points of the unit cube whose responses are wanted."""

    response: Response
    space: InputSpace
    points: Array
    where: str


def run_screening_task(task: ScreeningTask) -> Array:
    """The responses of one `task`, shape (n,)."""
    inside = np.clip(task.points, 1e-12, 1 - 1e-12)
    return evaluate(task.response, task.space.from_uniform(inside), task.space.names, task.where)


def _morris_sample(problem: dict[str, Any], n: int, seed: int) -> Array:
    from SALib.sample import morris

    return np.asarray(morris.sample(problem, n, seed=seed), float)


def _morris(problem: dict[str, Any], x: Array, y: Array, seed: int) -> Any:
    from SALib.analyze import morris

    return morris.analyze(problem, x, y, seed=seed)


def _delta(problem: dict[str, Any], x: Array, y: Array, seed: int) -> Any:
    from SALib.analyze import delta

    return delta.analyze(problem, x, y, seed=seed)


def _pawn(problem: dict[str, Any], x: Array, y: Array, seed: int) -> Any:
    from SALib.analyze import pawn

    return pawn.analyze(problem, x, y, seed=seed)


def _rbd_fast(problem: dict[str, Any], x: Array, y: Array, seed: int) -> Any:
    from SALib.analyze import rbd_fast

    return rbd_fast.analyze(problem, x, y, seed=seed)


def _dgsm_sample(problem: dict[str, Any], n: int, seed: int) -> Array:
    from SALib.sample import finite_diff

    return np.asarray(finite_diff.sample(problem, n, seed=seed), float)


def _dgsm(problem: dict[str, Any], x: Array, y: Array, seed: int) -> Any:
    from SALib.analyze import dgsm

    return dgsm.analyze(problem, x, y, seed=seed)


METHODS: dict[str, Method] = {
    "morris": Method(
        256,
        ("mu_star", "mu_star_conf", "mu", "sigma"),
        "elementary effects over percentiles (Morris 1991, Campolongo et al. 2007)",
        True,
        _morris,
        _morris_sample,
    ),
    "delta": Method(
        2**9,
        ("delta_balanced", "delta_balanced_conf", "S1", "S1_conf"),
        "moment-independent importance (Borgonovo 2007, Plischke et al. 2013)",
        False,
        _delta,
    ),
    "pawn": Method(
        2**12,
        ("median", "mean", "minimum", "maximum", "CV"),
        "Kolmogorov-Smirnov distance of conditional distributions (Pianosi and Wagener 2018)",
        False,
        _pawn,
    ),
    "rbd_fast": Method(
        2**11,
        ("S1", "S1_conf"),
        "random balance designs, first order (Tarantola et al. 2006, bias corrected: Tissot and Prieur 2012)",
        True,
        _rbd_fast,
    ),
    "dgsm": Method(
        512,
        ("dgsm", "dgsm_conf", "vi", "vi_std"),
        "derivatives over percentiles; dgsm is no less than the total index (Sobol' and Kucherenko 2009)",
        True,
        _dgsm,
        _dgsm_sample,
    ),
}
"""SALib's methods by the name that `hdopt sobol --method` takes."""
