"""What active limits and bounds cost: their multipliers at the optimum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias  # Any: values of JSON

import numpy as np

from hdopt.arrays import Array
from hdopt.optimize.design_space import VARIABLES, Variable
from hdopt.optimize.objectives import find_quantity
from hdopt.optimize.problem import DesignProblem, Limit

ACTIVE = 1e-4
"""How near a limit (as a share of it) or a bound (of the range) counts as active."""


@dataclass(frozen=True)
class Price:
    """An active limit or bound: `per_unit` is by how much the objective falls per unit of it that is given way."""

    name: str
    title: str
    unit: str
    kind: str
    at: float
    per_unit: float

    def to_dict(self) -> dict[str, Any]:
        return dict(vars(self))


Owner: TypeAlias = Limit | tuple[Variable, float]
"""What is active: a limit, or a variable at its upper (+1) or lower (-1) bound."""


def prices(problem: DesignProblem, values: dict[str, float]) -> tuple[list[Price], float]:
    """Active limits and bounds of `problem` at the optimum `values` with their prices, and the residual of the
    optimality conditions.

    Karush-Kuhn-Tucker: the objective's slope (a mix of its active pieces) is balanced by the slopes of what is active,
    with multipliers of one sign: a non-negative least-squares problem. The residual is relative to the objective's
    slope; near 0 the design is a local optimum to first order.
    """
    from scipy.optimize import nnls

    if problem.n == 0:
        return [], 0.0
    u = problem.place(values)
    found = problem.evaluate(u)
    scale = max(abs(found.objective), 1e-12)
    top = np.flatnonzero(found.pieces >= found.objective - ACTIVE * scale)
    columns: list[Array] = [np.append(found.piece_slopes[i] / scale, 1.0) for i in top]
    owners: list[Owner] = []
    names = [limit for limit in problem.limits for _ in range(len(_pieces(problem, limit.quantity, values)))]
    for i, limit in enumerate(names):
        if found.constraints[i] >= -ACTIVE:
            columns.append(np.append(found.constraint_slopes[i], 0.0))
            owners.append(limit)
    for i, variable in enumerate(problem.variables):
        for sign, active in ((-1.0, u[i] <= ACTIVE), (1.0, u[i] >= 1 - ACTIVE)):
            if active:
                column = np.zeros(problem.n + 1)
                column[i] = sign
                columns.append(column)
                owners.append((variable, sign))
    matrix = np.array(columns).T
    target = np.append(np.zeros(problem.n), 1.0)
    multipliers, _ = nnls(matrix, target)
    mixed = matrix[:, : len(top)] @ multipliers[: len(top)]
    size = float(np.linalg.norm(mixed[:-1])) or 1.0
    residual = float(np.linalg.norm(matrix @ multipliers - target)) / size
    return _named(owners, multipliers[len(top) :] * scale), residual


def _pieces(problem: DesignProblem, quantity: str, values: dict[str, float]) -> Array:
    return find_quantity(quantity).pieces(problem.point(values))[0]


def _named(owners: list[Owner], multipliers: Array) -> list[Price]:
    found: dict[str, Price] = {}
    for owner, multiplier in zip(owners, multipliers, strict=True):
        if isinstance(owner, tuple):
            variable, sign = owner
            title, unit = VARIABLES[variable.name]
            at = variable.upper if sign > 0 else variable.lower
            kind = "upper bound" if sign > 0 else "lower bound"
            price = Price(variable.name, title, unit, kind, at, multiplier / (variable.upper - variable.lower))
        else:
            quantity = find_quantity(owner.quantity)
            kind = "at least" if owner.at_least else "at most"
            before = found[owner.quantity].per_unit if owner.quantity in found else 0.0
            per_unit = before + multiplier / owner.scale
            price = Price(owner.quantity, quantity.title, quantity.unit, kind, owner.bound, per_unit)
        found[price.name] = price
    return list(found.values())
