"""What a tolerance costs. Each model is a record with its cost, its slope, and, where convex, its form for cvxpy."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Protocol, TypeAlias, runtime_checkable  # Any: cvxpy's expressions, which have no types

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.keywords import names_keywords

Expression: TypeAlias = Any
"""A variable or expression of cvxpy, which has no types for them."""
ROUNDING = 1e-9
"""How much finer than the finest of the cost data, relative to it, a tolerance may be and still count as that one."""


class CostModel(Protocol):
    """Cost of a tolerance, falling as the tolerance grows. `discrete` models offer a list of choices."""

    @property
    def discrete(self) -> bool: ...

    def cost(self, tolerance: ArrayLike) -> Array: ...

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest tolerance the model speaks of."""


@runtime_checkable
class ConvexCost(CostModel, Protocol):
    """A cost that a convex solver can take whole."""

    def slope(self, tolerance: ArrayLike) -> Array:
        """d cost/d tolerance."""

    def expression(self, variable: Expression, scale: float) -> Expression:
        """The cost as a cvxpy expression of tolerance = variable * scale."""


def _positive(model: str, **values: float) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise HdoptError(f"{name} of the {model} cost is {value!r}; it must be a finite number above 0")


@names_keywords
@dataclass(frozen=True)
class Power:
    """a + b/t^k, k > 0 (Sutherland and Roth 1975; k = 1 is the reciprocal model of Chase and Greenwood 1988)."""

    a: float
    b: float
    k: float
    discrete = False
    range = (0.0, math.inf)

    def __post_init__(self) -> None:
        _positive("power", b=self.b, k=self.k)

    def cost(self, tolerance: ArrayLike) -> Array:
        return self.a + self.b * np.asarray(tolerance, float) ** -self.k

    def slope(self, tolerance: ArrayLike) -> Array:
        return -self.k * self.b * np.asarray(tolerance, float) ** (-self.k - 1)

    def expression(self, variable: Expression, scale: float) -> Expression:
        import cvxpy as cp

        # k is a decimal such as 0.43899: the power cone of Clarabel takes it as it is, fractions would only come near
        return self.a + self.b * scale**-self.k * cp.power(variable, -self.k, approx=False)


@names_keywords
@dataclass(frozen=True)
class Reciprocal(Power):
    """a + b/t (Chase and Greenwood 1988)."""

    k: float = 1.0


@names_keywords
@dataclass(frozen=True)
class Exponential:
    """a exp(-t/b) + fixed (Speckhart 1972)."""

    a: float
    b: float
    fixed: float = 0.0
    discrete = False
    range = (0.0, math.inf)

    def __post_init__(self) -> None:
        _positive("exponential", a=self.a, b=self.b)

    def cost(self, tolerance: ArrayLike) -> Array:
        return self.fixed + self.a * np.exp(-np.asarray(tolerance, float) / self.b)

    def slope(self, tolerance: ArrayLike) -> Array:
        return -self.a / self.b * np.exp(-np.asarray(tolerance, float) / self.b)

    def expression(self, variable: Expression, scale: float) -> Expression:
        import cvxpy as cp

        return self.fixed + self.a * cp.exp(-variable * (scale / self.b))


@names_keywords
@dataclass(frozen=True)
class Piecewise:
    """Straight lines between quoted points (tolerance, cost), at least two, tolerances rising. What is finer than all
    of them has an unknown cost, NaN; what is wider costs no more than the last."""

    points: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        tolerances = [t for t, _ in self.points]
        if len(tolerances) < 2 or any(b <= a for a, b in pairwise(tolerances)):
            raise HdoptError(
                f"the piecewise cost has tolerances {tolerances}; give at least two points, tolerances rising"
            )

    @property
    def range(self) -> tuple[float, float]:
        return self.points[0][0], self.points[-1][0]

    @property
    def segments(self) -> list[tuple[float, float]]:
        """Slope and intercept of each line."""
        pairs = pairwise(self.points)
        slopes = [((c2 - c1) / (t2 - t1), t1, c1) for (t1, c1), (t2, c2) in pairs]
        return [(slope, c1 - slope * t1) for slope, t1, c1 in slopes]

    @property
    def convex(self) -> bool:
        slopes = [slope for slope, _ in self.segments]
        return all(b >= a - 1e-12 * abs(a) for a, b in pairwise(slopes))

    @property
    def discrete(self) -> bool:
        """Lines that turn down need a choice between them."""
        return not self.convex

    def cost(self, tolerance: ArrayLike) -> Array:
        tolerances, costs = np.transpose(self.points)
        at = np.asarray(tolerance, float)
        known = at >= tolerances[0] * (1 - ROUNDING)
        return np.where(known, np.interp(at, tolerances, costs), math.nan)

    def slope(self, tolerance: ArrayLike) -> Array:
        slopes = np.array([slope for slope, _ in self.segments])
        index = np.searchsorted([t for t, _ in self.points[1:-1]], tolerance, side="right")
        return slopes[index]

    def expression(self, variable: Expression, scale: float) -> Expression:
        import cvxpy as cp

        return cp.maximum(*(slope * scale * variable + start for slope, start in self.segments), -1e300)


@names_keywords
@dataclass(frozen=True)
class Grade:
    """One grade: its name, tolerance and cost; `extrapolated` says why its standard does not reach here, if so."""

    name: str
    tolerance: float
    cost: float
    extrapolated: str = ""


@names_keywords
@dataclass(frozen=True)
class GradeTable:
    """A choice of grades."""

    grades: tuple[Grade, ...] = field(repr=False)
    discrete = True

    def __post_init__(self) -> None:
        if not self.grades:
            raise HdoptError("the table of grades is empty; give at least one grade with tolerance and cost")
        for grade in self.grades:
            _positive(f"grade {grade.name}", tolerance=grade.tolerance)

    @property
    def range(self) -> tuple[float, float]:
        tolerances = [grade.tolerance for grade in self.grades]
        return min(tolerances), max(tolerances)

    def nearest(self, tolerance: float) -> Grade:
        """The grade of this tolerance, up to rounding."""
        return min(self.grades, key=lambda grade: abs(grade.tolerance - tolerance))

    def at_most(self, tolerance: float) -> Grade:
        """The cheapest grade that keeps this tolerance."""
        fitting = [grade for grade in self.grades if grade.tolerance <= tolerance * (1 + 1e-12)]
        if not fitting:
            raise HdoptError(f"no grade is as fine as {tolerance:g}; the finest is {self.range[0]:g}")
        return min(fitting, key=lambda grade: grade.cost)

    def cost(self, tolerance: ArrayLike) -> Array:
        costs: Array = np.vectorize(lambda t: self.at_most(t).cost, otypes=[float])(tolerance)
        return costs


COST_MODELS: dict[str, type] = {
    "reciprocal": Reciprocal,
    "power": Power,
    "exponential": Exponential,
    "piecewise": Piecewise,
    "table": GradeTable,
}
"""The cost models by the name a study file uses."""
