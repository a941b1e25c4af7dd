"""What is fitted beside the model without being its physics: zeros, a drift, a time warp, and less than one turn.

Every recording has a zero of its own that means nothing. A recording without a sensor at the input may have more: an
error that drifts with the bench (a telescope mount whose polar axis is off), and an input angle computed from a clock
that nobody recorded, so that the true angle is theta + w(t) with a small smooth warp w. To first order

    error(t) = KE(theta) + KE'(theta) w(t) + drift(t),

with w and drift polynomials of time (Legendre), free for each recording. KE' is the slope of the fitted base. A gear
without a model has none: where a warp is asked for, its KE is a free sum of whole orders, which then get no name. All
are free columns in every fit: base, candidates, placebo and generic basis alike, so that nothing they can explain is
ever named. Without a drive's model, a recording of less than one turn holds errors that only depend on the angle
(eccentricities, a ratio that is slightly off) and that it cannot tell from one another: they are one curve of the
angle, free too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.diagnosis.inference.common_slope import TakenSlope
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.settings import DEFAULT, NuisanceSettings
from hdopt.effects import EFFECTS
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.sines import sine_columns
from hdopt.errors import HdoptError, unknown_name
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.recordings.rows import Rows

DRIFT = "drift"
NUISANCES = (DRIFT, "time-warp")
"""What `--nuisance` may ask for."""


@dataclass(frozen=True)
class Nuisances:
    """Which columns are always free: one zero or one for each recording, `drift`, a curve of the `angle` between two
    angles (rad) with so many knots, whole `orders`, what is left of a slope that was `taken` out of the errors, and,
    where a time warp was asked for (`warps`), the warp, once the `slope` of the error by the input angle (arcmin/rad, a
    function of rad) is known.
    """

    separate_zeros: bool
    drift: bool = False
    angle: tuple[float, float, int] | None = None
    orders: tuple[int, ...] = ()
    slope: Callable[[Array], Array] | None = None
    warps: bool = False
    taken: TakenSlope | None = None
    settings: NuisanceSettings = DEFAULT.nuisance

    @property
    def hidden(self) -> tuple[str, ...]:
        """Effects that are no candidates beside these nuisances."""
        return tuple(name for name, effect in EFFECTS.items() if self.drift and effect.nuisance == DRIFT)

    def blocks(self, rows: Rows) -> dict[str, Array]:
        """Columns (n, q) in arcmin by kind: zero, drift, angle, orders, scale, time-warp. `rows` are those of the
        recordings.
        """
        n = len(rows)
        own = rows.record[:, None] == np.arange(rows.records)
        blocks = {"zero": own.astype(float) if self.separate_zeros else np.ones((n, 1))}
        if self.drift:
            blocks["drift"] = _for_each(own, legendre(place_in_recording(rows), self.settings.drift_degree))
        if self.angle is not None:
            blocks["angle"] = tent_functions(rows.theta, *self.angle)
        if self.orders:
            blocks["orders"] = sine_columns(rows.theta, self.orders)
        if self.taken is not None:
            blocks["scale"] = self.taken.columns(rows.theta)
        if self.slope is not None:
            blocks["time-warp"] = self.slope(rows.theta)[:, None] * warp_shapes(rows, self.settings)
        return blocks

    def columns(self, rows: Rows) -> Array:
        """All columns, (n, q), arcmin per coefficient; those of the time warp, last, arcmin per rad of input."""
        return np.column_stack(list(self.blocks(rows).values()))


def nuisances_for(
    rows: Rows,
    base: CartesianModel | None,
    asked: Sequence[str] = (),
    settings: NuisanceSettings = DEFAULT.nuisance,
) -> Nuisances:
    """The nuisances of these rows: zeros, what is `asked` for by name, and the angle where less than a turn has no
    `base` model.

    Raises `HdoptError` for one that does not exist, or a time warp of an input that stands still. `settings` are
    the thresholds.
    """
    for name in asked:
        if name not in NUISANCES:
            raise HdoptError(unknown_name("nuisance in --nuisance", name, NUISANCES))
    if "time-warp" in asked and rows.locked:
        raise HdoptError("--nuisance time-warp bends the input angle, but the input stands still; leave it out")
    free = base is None and "time-warp" in asked
    highest = min(settings.whole_orders, int(settings.order_share * rows.rows_per_turn)) if free else 0
    means = np.array([rows.error[rows.record == r].mean() for r in range(rows.records)])
    return Nuisances(
        separate_zeros=bool(np.ptp(means) >= settings.shared_zero_arcmin),
        drift=DRIFT in asked,
        angle=angle_range(rows, settings) if base is None and not rows.locked and rows.span_turns < 1 else None,
        orders=tuple(k for k in range(1, highest + 1) if k * rows.span_turns >= 1),
        warps="time-warp" in asked,
        settings=settings,
    )


def with_time_warp(nuisances: Nuisances, fit: Fit) -> Nuisances:
    """The same nuisances with a time warp, linearised where `fit` stands."""
    return replace(nuisances, slope=base_slope(fit) if fit.problem.base is not None else order_slope(fit, nuisances))


def base_slope(fit: Fit) -> Callable[[Array], Array]:
    """dKE/dtheta of the fitted base, arcmin/rad, by central differences. `fit` is the one looked at."""
    base, errors, step = fit.problem.base, fit.errors, fit.problem.settings.nuisance.slope_step_rad

    def slope(theta: Array) -> Array:
        if base is None:
            return np.zeros(len(theta))
        return (base.evaluate(theta + step, errors)[0] - base.evaluate(theta - step, errors)[0]) / (2 * step)

    return slope


def order_slope(fit: Fit, nuisances: Nuisances) -> Callable[[Array], Array]:
    """Slope of the free whole orders by the input angle, arcmin/rad. `fit` is the one looked at. `nuisances` are the
    columns that are always free.
    """
    pairs = coefficients(fit, nuisances)["orders"].reshape(-1, 2)

    def slope(theta: Array) -> Array:
        total = np.zeros(len(theta))
        for k, (s, c) in zip(nuisances.orders, pairs, strict=True):
            total += k * (s * np.cos(k * theta) - c * np.sin(k * theta))
        return total

    return slope


def slices_by_kind(fit: Fit, nuisances: Nuisances) -> dict[str, slice]:
    """Where each kind's coefficients stand among the fit's free ones. `nuisances` are the columns that are always
    free.
    """
    found, start = {}, 0
    for kind, columns in nuisances.blocks(fit.problem.rows).items():
        found[kind] = slice(start, start + columns.shape[1])
        start += columns.shape[1]
    return found


def coefficients(fit: Fit, nuisances: Nuisances) -> dict[str, Array]:
    """The fitted coefficients of each kind. `fit` is the one looked at. `nuisances` are the columns that are always
    free.
    """
    return {kind: fit.offsets[place] for kind, place in slices_by_kind(fit, nuisances).items()}


def place_in_recording(rows: Rows) -> Array:
    """-1 at the start of each recording, 1 at its end: by time, or by row where no clock was recorded. `rows` are
    those of the recordings.
    """
    clock = rows.time if rows.time is not None else np.arange(len(rows), dtype=float)
    result = np.empty(len(rows))
    for record in range(rows.records):
        own = rows.record == record
        result[own] = _to_unit(clock[own])
    return result


def warp_shapes(rows: Rows, settings: NuisanceSettings = DEFAULT.nuisance) -> Array:
    """Shapes of the warp w(t), (n, its degree times the recordings). `rows` are those of the recordings. `settings`
    are the thresholds.
    """
    own = rows.record[:, None] == np.arange(rows.records)
    return _for_each(own, legendre(place_in_recording(rows), settings.warp_degree))


def legendre(x: Array, degree: int) -> Array:
    """Legendre polynomials 1 to `degree` of `x` in -1..1, (n, degree)."""
    return np.asarray(np.polynomial.legendre.legvander(x, degree)[:, 1:], float)


def angle_range(rows: Rows, settings: NuisanceSettings = DEFAULT.nuisance) -> tuple[float, float, int]:
    """Lowest and highest input angle (rad), and the knots of a free curve between them. `rows` are those of the
    recordings. `settings` are the thresholds.
    """
    knots = int(np.clip(len(rows) / settings.rows_a_knot, settings.fewest_knots, settings.most_knots))
    return float(np.min(rows.theta)), float(np.max(rows.theta)), knots


def tent_functions(angle: Array, low: float, high: float, knots: int) -> Array:
    """Any piecewise linear curve of `angle` but for a zero: tent functions on even knots, (n, knots - 1). The knots
    lie from `low` to `high`, rad.
    """
    place = (angle - low) / (high - low) * (knots - 1)
    return np.asarray(np.clip(1 - np.abs(place[:, None] - np.arange(1, knots)), 0, None), float)


def estimated(fit: Fit, nuisances: Nuisances) -> dict[str, Parameter]:
    """How large the nuisances came out, with 95 % intervals: drift (arcmin) and warp (deg of input) from smallest to
    largest, whole orders by amplitude (arcmin). `fit` is the one looked at.
    """
    rows = fit.problem.rows
    covariance = fit.covariance()
    found = {}
    for kind, place in slices_by_kind(fit, nuisances).items():
        inside = slice(fit.problem.base_width + place.start, fit.problem.base_width + place.stop)
        estimate = FitEstimate(fit.offsets[place], covariance[inside, inside])
        if kind == "drift":
            found["drift_arcmin"] = estimate.range_of(nuisances.blocks(rows)[kind], "arcmin")
        elif kind == "time-warp":
            found["time_warp_deg"] = estimate.range_of(np.degrees(warp_shapes(rows, nuisances.settings)), "deg")
        elif kind == "orders":
            for i, order in enumerate(nuisances.orders):
                found[f"order_{order}_arcmin"] = estimate.amplitude(2 * i, 2 * i + 1)
    return found


def notes(fit: Fit, nuisances: Nuisances) -> list[str]:
    """What the nuisances keep from being named, in words. `fit` is the one looked at."""
    said = []
    if nuisances.angle is not None:
        said.append(
            f"the recording covers {fit.problem.rows.span_turns:.2g} input turns and the gear has no model: what "
            "depends on the angle alone (eccentricities, a ratio slightly off) is a free curve and gets no name"
        )
    if nuisances.drift:
        said.append("a slow drift was fitted as a nuisance: thermal drift gets no name")
    if nuisances.orders:
        said.append(
            "the gear has no model to bend: whole orders were fitted freely and get no name; the record's length tells "
            f"orders apart that differ by about {1 / fit.problem.rows.span_turns:.2g}"
        )
    if nuisances.slope is not None:
        warp = estimated(fit, nuisances)["time_warp_deg"].value
        said.append(
            f"a time warp of {warp:.2g} deg of input, end to end, was fitted as a nuisance; its steady part "
            "stretches every order alike, as k (1 + 1/N) would"
        )
        if warp > nuisances.settings.largest_warp_deg:
            said.append(
                f"the time warp is above {nuisances.settings.largest_warp_deg:g} deg, more than its linear model "
                "carries: check the input angle's rate"
            )
    return said


def _for_each(own: Mask, columns: Array) -> Array:
    """Columns repeated for each recording, zero on the rows of the others."""
    return np.column_stack([columns * own[:, [r]] for r in range(own.shape[1])])


def _to_unit(values: Array) -> Array:
    low, high = float(np.min(values)), float(np.max(values))
    return 2 * (values - low) / (high - low) - 1 if high > low else np.zeros(len(values))
