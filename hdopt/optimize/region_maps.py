"""What is chosen over two constants of the trade at once: maps that are fine only where the choice changes."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from hdopt.optimize.constants import Constant
from hdopt.optimize.design_space import Combination
from hdopt.optimize.records import SearchResult
from hdopt.optimize.region_records import Boundary, RegionMap, Regions
from hdopt.optimize.regions import RIVALS, Bests, Followed, Ground, contenders, ranges
from hdopt.optimize.setup import Setup

MAPS = 2
"""Maps drawn: of the constant with the nearest boundary and each of the next ones."""
COARSE, FINE = 4, 2
"""Cells a side of the coarse grid, and into how many a coarse cell is divided where its corners differ."""
ALIKE = 0.01
"""Constants whose nearest boundary is the same to this share, or its inverse, with the same beyond it, do the same: one
of them is drawn."""
LEAST_REACH = math.log(1.1)
BEYOND = 2.0
"""How far a map reaches, in distances of the nearest boundary: it shows as much behind it as before."""

Node = tuple[int, int]


def find_regions(result: SearchResult, seed: int = 1) -> Regions:
    """Where the choice of a search's `result` holds, along each constant of its trade and over the pairs that bound it
    most; `seed` is that of the algorithms."""
    ground, followed = ranges(result, seed)
    drawn = _nearest(followed)
    maps = [_map(ground, drawn[0], other) for other in drawn[1 : MAPS + 1]]
    return Regions(tuple(f.range for f in followed), tuple(maps))


def _nearest(followed: Sequence[Followed]) -> list[Followed]:
    """Those of `followed` with a boundary of structure or profile, the nearest first, of those alike only one."""
    bounded = [(f, b) for f in followed if (b := f.range.nearest("structure", "profile")) is not None]
    taken: list[tuple[Followed, Boundary]] = []
    for one, boundary in sorted(bounded, key=lambda pair: _distance(pair[1])):
        alike = (k for _, k in taken if k.becomes == boundary.becomes)
        if not any(abs(_distance(boundary) - _distance(known)) < ALIKE for known in alike):
            taken.append((one, boundary))
    return [one for one, _ in taken]


def _distance(boundary: Boundary) -> float:
    return abs(math.log(boundary.factor))


def _map(ground: Ground, x: Followed, y: Followed) -> RegionMap:
    """The choice over the constants of `x` and `y`, each about its value."""
    factors = [_factors(ground, followed) for followed in (x, y)]
    solver = _Nodes(ground, x.constant, y.constant, factors, tuple({*x.rivals, *y.rivals, ground.chosen.combination}))
    n = COARSE * FINE + 1
    coarse = [(i, j) for i in range(0, n, FINE) for j in range(0, n, FINE)]
    middle = n // 2
    for node in sorted(coarse, key=lambda at: (at[0] - middle) ** 2 + (at[1] - middle) ** 2):
        solver.solve(node)
    chosen = np.full((n, n), -1)
    names: dict[Combination, int] = {ground.chosen.combination: 0}
    for i, j in np.ndindex(n, n):
        corners = {solver.choice(node) for node in _corners(i, j)}
        if len(corners) == 1:
            found = corners.pop()
        else:
            near = contenders(*(solver.solved[node] for node in _corners(i, j)), share=RIVALS)
            found = solver.choice(solver.solve((i, j), near))
        if found is not None:
            chosen[i, j] = names.setdefault(found, len(names))
    excess = [[ground.excess(solver.setup((i, j)))[0] for j in range(n)] for i in range(n)]
    return RegionMap(
        x.constant.name,
        y.constant.name,
        tuple(factors[0]),
        tuple(factors[1]),
        tuple(map(str, names)),
        tuple(tuple(map(int, row)) for row in chosen),
        tuple(map(tuple, excess)),
    )


def _factors(ground: Ground, followed: Followed) -> list[float]:
    boundary = followed.range.nearest("structure", "profile")
    assert boundary is not None, "only constants with a boundary are drawn"
    reach = min(max(BEYOND * _distance(boundary), LEAST_REACH), math.log(1 + ground.setup.settings.perturbation))
    return [float(f) for f in np.exp(np.linspace(-reach, reach, COARSE * FINE + 1))]


def _corners(i: int, j: int) -> set[Node]:
    """The corners of the coarse cell that a node lies in; of those it lies on the edge of, or at the corner of."""
    rows, columns = ({at - at % FINE, at + -at % FINE} for at in (i, j))
    return {(row, column) for row in rows for column in columns}


class _Nodes:
    """Nodes of a map solved, each from its nearest solved neighbour."""

    def __init__(
        self,
        ground: Ground,
        x: Constant,
        y: Constant,
        factors: Sequence[Sequence[float]],
        rivals: tuple[Combination, ...],
    ) -> None:
        self.ground, self.x, self.y, self.factors, self.rivals = ground, x, y, factors, rivals
        self.solved: dict[Node, Bests] = {}

    def setup(self, node: Node) -> Setup:
        i, j = node
        return self.y.scaled(self.x.scaled(self.ground.setup, self.factors[0][j]), self.factors[1][i])

    def solve(self, node: Node, among: Collection[Combination] | None = None) -> Node:
        """Solve `node` if it is not yet, for the rivals or those `among` them."""
        if node not in self.solved:
            full = [at for at, bests in self.solved.items() if len(bests) == len(self.rivals)]
            near = min(full, key=lambda at: math.dist(at, node), default=None)
            starts = {c: self.ground.today[c] for c in self.rivals} if near is None else self.solved[near]
            if among is not None:
                starts = {c: s for c, s in starts.items() if c in among} or starts
            self.solved[node] = self.ground.best(self.setup(node), starts)
        return node

    def choice(self, node: Node) -> Combination | None:
        return self.ground.choice(self.solved[node])
