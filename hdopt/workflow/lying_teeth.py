"""How teeth that were measured lie in a record: where tooth 1 stands, which way they count, and their sign.

A gear inspector numbers teeth from a mark of his own, seen from either face and on either flank; the record counts from
the zero of its input. The table is laid on the spline in each of the four ways and at every half tooth. What it would
leave of the record is told by a fit of the drive without it and the slopes there, which both orientations of the record
have; the likeliest are fitted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.base_fit import fit_base
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.settings import DEFAULT
from hdopt.drive.geometry import Drive
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.effects.met import Spline, met_angles
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.kinematics.load_sharing import LoadSharing
from hdopt.recordings.recording import TURN, Recording
from hdopt.recordings.rows import Rows, gather, neighbours_for
from hdopt.workflow.waveform_fit import WaveformFit, fit_rows, offset_columns

A_TOOTH = 2
"""Places of tooth 1 that are tried, of each tooth."""
FINEST = 0.02
"""Part of a tooth by which the best is moved at last."""
LIKELY = 60
"""Lies of either spline that are laid beside those of the other, where both were measured."""
LIKELIEST = 5
"""Lies that are fitted, no two of them neighbours."""
APART = (0.0, 20.0, 2.0)
"""Values an input turn that are taken for independent where a drive is fitted without teeth; 0: all of them."""
REFINED = 10
"""Steps in which the errors of a drive are refined beside teeth that lie otherwise."""
ROUNDS, KEPT = 3, 3
"""How often at most lies are compared anew beside the drives of the best, and of how many."""
MOST_ROWS = 4000
"""Rows that lies are compared on, evenly spread: 40 MB for all lies of a spline."""


@dataclass(frozen=True)
class Lie:
    """How measured teeth lie: tooth 1 at `first_angle` (rad, clockwise from the major axis at input angle 0), numbered
    the other way round than they were given where `backwards`, of the other sign where `negated`."""

    first_angle: float
    backwards: bool = False
    negated: bool = False

    def of(self, teeth: MeasuredTeeth) -> MeasuredTeeth:
        """`teeth` as they lie so."""
        return teeth.laid(self.first_angle, self.backwards, self.negated)

    def is_beside(self, other: Lie, pitch: float) -> bool:
        """Whether the `other` lie is like this one but for a `pitch` (rad) or less."""
        apart = (self.first_angle - other.first_angle + TURN / 2) % TURN - TURN / 2
        alike = (self.backwards, self.negated) == (other.backwards, other.negated)
        return alike and abs(apart) <= pitch * (1 + 1e-9)


def keys_of(teeth: MeasuredTeeth) -> str:
    """How `teeth` lie by the keys of a study: 'first_tooth_deg = 88.9, numbered = "counterclockwise"'."""
    said = [f"first_tooth_deg = {math.degrees(teeth.first_angle) % 360.0:.1f}"]
    said += ['numbered = "counterclockwise"'] * teeth.backwards
    said += ["sign = -1"] * teeth.negated
    return ", ".join(said)


Lies = dict[Spline, Lie]
"""How the teeth of each spline lie that were measured."""


def fit_with_teeth_as_they_lie(
    recordings: Sequence[Recording], drive: Drive, enough: float, seed: int
) -> tuple[WaveformFit, dict[Spline, MeasuredTeeth]]:
    """`drive` fitted to `recordings` with its measured teeth as they lie in them best, and those teeth, of one spline
    at least; tooth 1 of the first stands in the first half turn. The search ends where no more than `enough` is left,
    arcmin rms. The same `seed` gives the same fit."""
    rows = gather(recordings, neighbours_for(recordings))
    search = _Search.of(rows, drive)
    tries: list[_Try] = []
    for start in product((1.0, -1.0), APART):
        tries += search.first(*start, seed)
        if _least(tries).left <= enough:
            break
    best = _least(tries)
    for _ in range(ROUNDS):
        if best.left <= enough:
            break
        tries.sort(key=_left)
        found = search.further(tries[:KEPT])
        tries = tries[KEPT:] + found
        best = _least([best, *found])
    best = search.finer(best)
    laid = search.laid(_in_the_first_half(best.lies))
    return fit_rows(rows, _with(drive, laid), seed, (best.sign,)), laid


def _in_the_first_half(lies: Lies) -> Lies:
    """The same, all half a turn on where the first would else stand in the second half: zones then change their names,
    and a drive whose errors are turned as well has the same error."""
    first = next(iter(lies.values())).first_angle % TURN
    on = 0.0 if first < TURN / 2 else TURN / 2
    return {spline: replace(lie, first_angle=(lie.first_angle + on) % TURN) for spline, lie in lies.items()}


def stride_of(rows: int, rows_per_turn: float) -> int:
    """The stride that leaves no more than `MOST_ROWS` of so many `rows`, and in time each of the `rows_per_turn`: one
    that divides a turn would look at the same teeth of the circular spline turn after turn."""
    stride = -(-rows // MOST_ROWS)
    while math.gcd(stride, max(round(rows_per_turn), 1)) > 1:
        stride += 1
    return stride


def _with(drive: Drive, teeth: Mapping[Spline, MeasuredTeeth]) -> Drive:
    """`drive` with these `teeth` on the splines, and no others."""
    return replace(drive, cs_teeth=teeth.get(Spline.CIRCULAR), fs_teeth=teeth.get(Spline.FLEX))


@dataclass(frozen=True)
class _Try:
    """Teeth that lie so beside a drive with these `errors` (12,) mm, in rows of which the error counts with `sign`;
    what that has `left`, arcmin rms."""

    lies: Lies
    sign: float
    errors: Array
    left: float


def _left(one: _Try) -> float:
    return one.left


def _least(tries: Sequence[_Try]) -> _Try:
    return min(tries, key=_left)


@dataclass(frozen=True)
class _Search:
    """Thinned `rows` (n,) of a `drive` and the teeth `given`, with every way in which they are tried to lie."""

    rows: Rows
    drive: Drive
    given: Mapping[Spline, MeasuredTeeth]
    everywhere: Mapping[Spline, Sequence[Lie]]

    @classmethod
    def of(cls, rows: Rows, drive: Drive) -> _Search:
        """Of all `rows` of the `drive`."""
        some = np.zeros(len(rows), bool)
        some[:: stride_of(len(rows), rows.rows_per_turn)] = True
        both = {Spline.CIRCULAR: drive.cs_teeth, Spline.FLEX: drive.fs_teeth}
        given = {spline: teeth for spline, teeth in both.items() if teeth is not None}
        return cls(rows.rows(some), drive, given, {spline: _ways(teeth) for spline, teeth in given.items()})

    def first(self, sign: float, apart: float, seed: int) -> list[_Try]:
        """The likeliest beside a drive without teeth that is fitted with this `sign`, and with so many values an input
        turn taken for independent (`apart`; 0: all rows). One that is fitted closely takes teeth for errors of its own,
        a loose one leaves them."""
        problem = self._problem(CartesianModel.of(_with(self.drive, {})), sign, apart)
        errors = fit_base(problem, np.random.default_rng(seed)).errors
        return self._about(sign, errors, problem.noise.sigma)

    def further(self, tries: Sequence[_Try]) -> list[_Try]:
        """The likeliest beside the drives of `tries`, which teeth that lie better have brought nearer to their own."""
        return [other for one in tries for other in self._about(one.sign, one.errors, one.left)]

    def laid(self, lies: Lies) -> dict[Spline, MeasuredTeeth]:
        """The teeth given as they lie so."""
        return {spline: lie.of(self.given[spline]) for spline, lie in lies.items()}

    def finer(self, best: _Try) -> _Try:
        """The `best` moved on in ever smaller parts of a tooth, spline by spline, as long as less is left."""
        part = 1.0 / A_TOOTH
        while (part := part / 2) > FINEST:
            for (spline, teeth), side in product(self.given.items(), (1.0, -1.0)):
                lie = best.lies[spline]
                on = replace(lie, first_angle=lie.first_angle + side * part * TURN / len(teeth.deviations))
                best = _least([best, self._tried({**best.lies, spline: on}, best.sign, best.errors)])
        return best

    def _about(self, sign: float, errors: Array, sigma: float) -> list[_Try]:
        """The likeliest beside a drive with `errors` (12,), refined from there; no two of them neighbours."""
        chosen: list[Lies] = []
        beside = _Beside.of(self.rows, self.drive, self.given, sign, errors, sigma)
        for lies in beside.likeliest(self.everywhere):
            if len(chosen) < LIKELIEST and not any(self._neighbours(lies, other) for other in chosen):
                chosen.append(lies)
        return [self._tried(lies, sign, errors) for lies in chosen]

    def _neighbours(self, lies: Lies, others: Lies) -> bool:
        """Whether the teeth lie alike but for a pitch or less."""
        pitch = {spline: TURN / len(teeth.deviations) for spline, teeth in self.given.items()}
        return all(lie.is_beside(others[spline], pitch[spline]) for spline, lie in lies.items())

    def _tried(self, lies: Lies, sign: float, errors: Array) -> _Try:
        """Teeth that lie so beside a drive whose errors are refined from `errors` (12,) on."""
        problem = self._problem(CartesianModel.of(_with(self.drive, self.laid(lies))), sign)
        fit = refine(evaluate(problem, errors, np.zeros(problem.nuisance.shape[1]), (), []), REFINED)
        return _Try(lies, sign, fit.errors, float(np.std(fit.residual)))

    def _problem(self, model: CartesianModel, sign: float, apart: float = 0.0) -> FitProblem:
        """The fit of `model` to the rows with this `sign`; `apart`: values an input turn that are taken for independent
        (0: all rows)."""
        mine = replace(self.rows, error=sign * (self.rows.error - float(np.median(self.rows.error))))
        scale = max(float(np.std(mine.error)), 1e-9)
        count = apart * max(self.rows.span_turns, 1.0)
        sigma = scale * math.sqrt(len(mine) / count) if apart else 0.3 * scale
        return FitProblem(mine, model, offset_columns(mine), Noise.white(mine, sigma), max(1.0, scale / 0.3))


def _ways(teeth: MeasuredTeeth) -> list[Lie]:
    """Tooth 1 of `teeth` at every half pitch, numbered either way and of either sign."""
    count = A_TOOTH * len(teeth.deviations)
    ways = product(range(count), (False, True), (False, True))
    return [Lie(TURN * place / count, backwards, negated) for place, backwards, negated in ways]


@dataclass(frozen=True)
class _Beside:
    """A drive without teeth, beside whose error in (n,) rows lies of those given are compared: each spline's `tables`
    with tooth 1 at 0, closed, and the angles `met` of the spline, rad; what is `free` beside them, (n, q), and the
    `inverse` (q, q) of its inner products; and what is `seen` beyond the drive, (n,). Tables, free and seen are in
    units of the noise.
    """

    tables: Mapping[Spline, Array]
    met: Mapping[Spline, Array]
    free: Array
    inverse: Array
    seen: Array

    @classmethod
    def of(
        cls, rows: Rows, drive: Drive, given: Mapping[Spline, MeasuredTeeth], sign: float, errors: Array, sigma: float
    ) -> _Beside:
        """Beside the `drive` with `errors` (12,) and without the teeth `given`, in `rows` of noise `sigma`, arcmin. Its
        errors may move along their slopes, as far as their prior lets them."""
        model = CartesianModel.of(_with(drive, {}))
        rotation = model.rotation(rows.theta)
        value, zone, slopes = model.evaluate_at(rotation, errors)
        met = met_angles(rows.theta, model.advance, model.beyond_at(rotation, errors))[:, zone, np.arange(len(rows))]
        free = np.column_stack([slopes, offset_columns(rows)]) / sigma
        precision = np.zeros(free.shape[1])
        precision[: slopes.shape[1]] = 1 / np.array(DEFAULT.base.prior_mm) ** 2
        sharing, unit = LoadSharing.of(_with(drive, given)), model.arcmin_per_mm / sigma
        tables = {spline: sharing.table(replace(teeth, first_angle=0.0)) * unit for spline, teeth in given.items()}
        return cls(
            {spline: np.append(table, table[0]) for spline, table in tables.items()},
            {spline: met[spline] for spline in given},
            free,
            np.asarray(np.linalg.pinv(free.T @ free + np.diag(precision)), float),
            (sign * rows.error - value) / sigma,
        )

    def columns(self, spline: Spline, lies: Sequence[Lie]) -> Array:
        """What teeth on the `spline` add that lie so, (n, k), of the k `lies`."""
        met, closed = self.met[spline], self.tables[spline]
        around = np.arange(len(closed))
        found = np.empty((len(met), len(lies)))
        for k, lie in enumerate(lies):
            angle = lie.first_angle - met if lie.backwards else met - lie.first_angle
            added = np.interp(np.mod(angle / TURN, 1.0) * (len(closed) - 1), around, closed)
            found[:, k] = -added if lie.negated else added
        return found

    def inner(self, first: Array, second: Array) -> Array:
        """Inner products of columns (n, k) and (n, m) with what is free taken out, (k, m)."""
        return np.asarray(first.T @ second - (first.T @ self.free) @ self.inverse @ (self.free.T @ second), float)

    def raised(self, columns: Array) -> Array:
        """By how much each of `columns` (n, k), taken from what is seen, makes its square larger, (k,)."""
        crossed = columns.T @ self.free
        itself = np.sum(columns**2, axis=0) - np.sum((crossed @ self.inverse) * crossed, axis=1)
        return np.asarray(itself - 2 * self.inner(columns, self.seen[:, None])[:, 0], float)

    def likeliest(self, lies: Mapping[Spline, Sequence[Lie]]) -> list[Lies]:
        """Those of all `lies` of one spline, or of both together, that leave least of what is seen, the best first."""
        best: dict[Spline, tuple[list[Lie], Array, Array]] = {}
        for spline, ways in lies.items():
            columns = self.columns(spline, ways)
            raised = self.raised(columns)
            some = np.argsort(raised)[:LIKELY]
            best[spline] = [ways[k] for k in some], columns[:, some], raised[some]
        if len(best) == 1:
            ((spline, (those, _, _)),) = best.items()
            return [{spline: lie} for lie in those]
        (one, (ones, columns, of_one)), (other, (others, more, of_other)) = best.items()
        both = of_one[:, None] + of_other + 2 * self.inner(columns, more)
        places = zip(*np.unravel_index(np.argsort(both, axis=None), both.shape), strict=True)
        return [{one: ones[i], other: others[k]} for i, k in places]
