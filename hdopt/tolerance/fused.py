"""Which stacks one compiled pass can make, and the values it gives: the same drives as the general path's, at a third
of the cost. What it cannot do (correlations, callouts, measured samples, drawn teeth, effects) goes the general path.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array, Singles
from hdopt.drive.errors import ERROR_NAMES
from hdopt.drive.geometry import Drive
from hdopt.tolerance.distributions import Distribution, Fixed, Scaled, Triangular, Uniform
from hdopt.tolerance.drive_inputs import Direct, DriveResponse
from hdopt.tolerance.response import Response
from hdopt.tolerance.sampling import Scrambling
from hdopt.tolerance.space import InputSpace

if TYPE_CHECKING:
    from hdopt.kinematics.lanes.motion import Design
    from hdopt.tolerance.fused_kernel import Columns


@dataclass(frozen=True)
class Input:
    """How the pass makes one input of points: its `kind` of the kernel, `constants`, and a table or none."""

    kind: int
    constants: tuple[float, ...]
    table: Singles | None = field(default=None, repr=False)


@dataclass(frozen=True)
class FusedPass:
    """All that the compiled pass needs of a problem: its `columns`, the kernel's `design`, mm of arc to arcmin and
    k_e."""

    columns: Columns
    design: Design
    arcmin_per_mm: float
    homogenization: float

    def of_sobol(self, scrambling: Scrambling, start: int, stop: int) -> Array | None:
        """Peak-to-peak (arcmin) of the drives of points `start` to `stop` of a `scrambling`, shape (stop - start,);
        `start` is a multiple of the kernel's LANES.

        None where a point lies nearer to 0 or 1 than the tables go, or a value is not finite: the general path knows.
        """
        from hdopt.tolerance.fused_kernel import sobol_block

        out = np.empty(stop - start)
        return self._finished(sobol_block(*scrambling, start, self.columns, self.design, out), out)

    def of_points(self, points: Array) -> Array | None:
        """The same of the drives of ready `points` (n, d) of the unit cube, shape (n,)."""
        from hdopt.tolerance.fused_kernel import points_block

        out = np.empty(len(points))
        return self._finished(points_block(points, self.columns, self.design, out), out)

    def _finished(self, beyond: int, out: Array) -> Array | None:
        values: Array = self.homogenization * (out * self.arcmin_per_mm)
        return values if not beyond and np.isfinite(values.sum()) else None


def fused_pass(response: Response, space: InputSpace) -> FusedPass | None:
    """The compiled pass of `response` over `space`; None where only the general path can do it."""
    if not (isinstance(response, DriveResponse) and space.copula.is_independent and _is_plain(response)):
        return None
    feeds = [feed for feed in response.feeds if isinstance(feed, Direct)]
    if len(feeds) < len(response.feeds) or [feed.column for feed in feeds] != list(range(space.dimension)):
        return None
    inputs = [_input(marginal, feed.per_unit) for marginal, feed in zip(space.marginals, feeds, strict=True)]
    known = [one for one in inputs if one is not None]
    if len(known) < len(inputs):
        return None
    from hdopt.kinematics.kernel import design_of

    return FusedPass(
        _columns(known, feeds, response),
        design_of(response.drive),
        response.drive.geometry.arcmin_per_mm,
        response.homogenization,
    )


def _is_plain(response: DriveResponse) -> bool:
    """Whether the base's compiled kernel is all that `response` needs."""
    drive: Drive = response.drive
    return drive.wave_generator.profile.tip_is_smooth and not (response.teeth or drive.has_measured_teeth)


def _columns(inputs: list[Input], feeds: list[Direct], response: DriveResponse) -> Columns:
    from hdopt.tolerance.fused_kernel import CONSTANTS, Columns

    tables = [one.table for one in inputs if one.table is not None]
    has_table = np.array([one.table is not None for one in inputs])
    return Columns(
        np.array([one.kind for one in inputs]),
        np.array([ERROR_NAMES.index(feed.error) for feed in feeds]),
        np.array([(*one.constants, *[0.0] * (CONSTANTS - len(one.constants))) for one in inputs]),
        np.cumsum(has_table) - has_table,
        np.concatenate([table.ravel() for table in tables]) if tables else np.empty(0, np.float32),
        np.array([float(getattr(response.held, name)) for name in ERROR_NAMES]),
    )


def _input(distribution: Distribution, factor: float) -> Input | None:
    """How the pass makes quantiles of a `distribution` times a `factor`; None where it cannot."""
    from hdopt.tolerance.fused_kernel import LINE, TABLE, TRIANGLE
    from hdopt.tolerance.quantile_table import quantile_table

    base, gain, shift = _unscaled(distribution, factor)
    if isinstance(base, Fixed):
        return Input(LINE, (shift + gain * base.value, 0.0))
    if isinstance(base, Uniform):
        return Input(LINE, (shift + gain * base.lower, gain * (base.upper - base.lower)))
    if isinstance(base, Triangular):
        (above, below), width = base.tails, base.maximum - base.minimum
        rise, fall = width * (base.mode - base.minimum), width * (base.maximum - base.mode)
        low, high = shift + gain * base.minimum, shift + gain * base.maximum
        return Input(TRIANGLE, (above, above - below, fall / width**2, low, rise, high, fall, gain))
    table = quantile_table(distribution, factor)
    return None if table is None else Input(TABLE, (), table)


def _unscaled(distribution: Distribution, factor: float) -> tuple[Distribution, float, float]:
    """What `distribution` times `factor` is a scaled form of, with gain and shift: gain * base + shift."""
    gain, shift = factor, 0.0
    while isinstance(distribution, Scaled):
        shift += gain * distribution.centre * (1 - distribution.factor)
        gain *= distribution.factor
        distribution = distribution.base
    return distribution, gain, shift
