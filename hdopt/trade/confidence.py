"""How sure a choice is: the best design checked by other means, and every constant of the trade perturbed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hdopt.drive import Drive
from hdopt.kinematics.extremes import extremes_arcmin
from hdopt.study import Study
from hdopt.trade.bearing import SOURCES
from hdopt.trade.quantities import find_quantity
from hdopt.trade.run import DesignRecord, SearchResult, choose, method_of, record_of
from hdopt.trade.setup import Setup, tolerance_problem, with_trade
from hdopt.trade.solve import Solution, solve

if TYPE_CHECKING:
    from hdopt.trade.added import DesignEffects

Array = NDArray[np.float64]

VERIFICATION = 1 << 16
"""Fresh drives that verify a quantile; none of them was seen by the search."""
BLOCKS = 16
CONTENDERS = 0.1
"""Combinations within this share of the best are searched anew under every perturbed constant; so are all of them
where a constant bears on the lag, the one quantity besides the error itself that the structure decides."""


@dataclass(frozen=True)
class Constant:
    """A constant of the trade: its value in its unit, where it comes from, and the setup with it multiplied."""

    name: str
    value: float
    unit: str
    source: str
    scaled: Callable[[Setup, float], Setup]


@dataclass(frozen=True)
class Perturbation:
    """What becomes of the choice where one constant is changed: the design chosen then, and whether it is another."""

    constant: str
    value: float
    unit: str
    source: str
    factor: float
    chosen: DesignRecord
    feasible: bool
    objective: float
    same_choice: bool
    regret: float | None
    """By how much the design chosen now would miss the new best, as a share; None where it breaks a limit then."""

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class Verification:
    """The best design's peak-to-peak (arcmin) by the exact geometry, and its quantile over fresh drives."""

    exact_arcmin: float
    kernel_arcmin: float
    quantile: float | None
    quantile_arcmin: float | None
    low: float | None
    high: float | None
    searched_arcmin: float | None
    drives: int

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def constants_of(setup: Setup) -> list[Constant]:
    """Every constant of the trade that has a value in this study."""
    trade, bearing = setup.trade, setup.trade.bearing
    drive = setup.space.baseline
    found = [
        _bearing("WG bearing, L50", "rated_life_h", bearing.rated_life_h, "h"),
        _bearing("WG bearing, torque exponent", "torque_exponent", bearing.torque_exponent, ""),
        _bearing("WG bearing, L10 over L50", "l10_share", bearing.l10_share, ""),
        _bearing("WG bearing, capacity over width: exponent", "capacity_exponent", bearing.capacity_exponent, ""),
        _bearing("Friction coefficient", "friction", bearing.friction, ""),
        _trade("Torque", "torque", trade.torque, "N mm", "cited: rated torque of the drive, makers' catalogue"),
        _trade("Tooth face width", "face_width", trade.face_width, "mm", "assumed"),
        _trade("Backlash", "backlash", trade.backlash, "mm", "assumed"),
        _trade(
            "Notch factor",
            "notch_factor",
            trade.notch_factor,
            "",
            "assumed: upper end of the 1.7 to 2.2 that handbooks give for flexspline teeth",
        ),
    ]
    if drive.geometry.flexspline_wall is not None:
        found.append(Constant("Flexspline wall", drive.geometry.flexspline_wall, "mm", "assumed", _wall))
    if drive.material is not None:
        found.append(Constant("Young's modulus", drive.material.modulus, "MPa", "assumed", _material("modulus")))
        if drive.material.endurance is not None:
            found.append(
                Constant("Endurance limit", drive.material.endurance, "MPa", "assumed", _material("endurance"))
            )
    for key, given in setup.limit_sections.items():
        side = next(iter(given.model_fields_set))
        bound = getattr(given, side)
        words = "share of the baseline" if side.endswith("baseline") else find_quantity(key).unit
        title = f"Limit: {find_quantity(key).title}"
        if bound:
            found.append(Constant(title, bound, words, "the study's choice", _limit(key, side)))
    return [constant for constant in found if constant.value is not None]


def perturb(setup: Setup, result: SearchResult, factors: tuple[float, float], seed: int) -> list[Perturbation]:
    """Each constant times each of `factors`, every combination searched anew from where it stands now."""
    method = method_of(setup, seed)
    made = []
    for constant in constants_of(setup):
        for factor in factors:
            changed = constant.scaled(setup, factor)
            solved = []
            for solution in contenders(result, constant):
                start = solution.values
                solved.append(solve(changed.problem(solution.combination), method, [start]))
            best = choose(solved)
            now = changed.problem(best.combination)
            kept = now.space.design(result.chosen.combination, result.chosen.values)
            broken = any(
                x.excess(find_quantity(x.quantity).value(changed.trade, kept)) > 1e-4 for x in changed.limits()
            )
            value = find_quantity(setup.section.objective).value(changed.trade, kept)
            made.append(
                Perturbation(
                    constant.name,
                    constant.value,
                    constant.unit,
                    constant.source,
                    factor,
                    record_of(changed, best),
                    best.feasible,
                    best.objective,
                    best.combination == result.chosen.combination,
                    None if broken else value / best.objective - 1,
                )
            )
    return made


def contenders(result: SearchResult, constant: Constant) -> list[Solution]:
    if "Backlash" in constant.name or "lag" in constant.name.split():
        return list(result.solutions)
    reach = (1 + CONTENDERS) * result.chosen.objective
    return [s for s in result.solutions if (s.feasible and s.objective <= reach) or not result.feasible]


def verify(study: Study, result: SearchResult, seed: int) -> Verification:
    """The best design against the exact geometry, and its quantile over drives drawn with another seed."""
    setup = result.setup
    drive = setup.space.design(result.chosen.combination, result.chosen.values).drive
    added = setup.trade.added
    if added is None:
        low, high = extremes_arcmin(drive, study.errors, "exact")
    else:
        from hdopt.extended import ExtendedModel
        from hdopt.extended.extremes import extremes_arcmin as extended_extremes_arcmin

        low, high = extended_extremes_arcmin(ExtendedModel(drive, study.errors, added.at(drive), added.operation))
    kernel = result.best.quantities.get("peak_to_peak_arcmin", float("nan"))
    if "tolerances" not in study.sections:
        return Verification(high - low, kernel, None, None, None, None, None, 0)
    blocks = quantile_blocks(study, drive, setup.section.quantile, seed + 1, added)
    from scipy.stats import t

    middle = float(blocks.mean())
    half = float(t.ppf(0.975, BLOCKS - 1) * blocks.std(ddof=1) / np.sqrt(BLOCKS))
    searched = result.best.quantities.get("peak_to_peak_quantile_arcmin")
    return Verification(
        high - low, kernel, setup.section.quantile, middle, middle - half, middle + half, searched, VERIFICATION
    )


def quantile_blocks(
    study: Study, drive: Drive, quantile: float, seed: int, added: DesignEffects | None = None
) -> Array:
    """The quantile of the converged peak-to-peak in each of 16 independent scramblings."""
    from hdopt.kinematics import peak_to_peak_arcmin
    from hdopt.tolerance.sampling import ScrambledSobol

    response, space = tolerance_problem(study)
    sampling = ScrambledSobol(BLOCKS)
    values = []
    for replicate in range(BLOCKS):
        points = np.concatenate(list(sampling.blocks(seed, replicate, VERIFICATION // BLOCKS, space.dimension)))
        errors = response.errors(space.sample(points))
        if added is None:
            spans = peak_to_peak_arcmin(drive, errors)
        else:
            from hdopt.extended.many import matrix_peak_to_peak_arcmin

            spans = matrix_peak_to_peak_arcmin(drive, errors.to_matrix(), added.table(drive))
        values.append(np.quantile(spans, quantile))
    return np.array(values)


def _bearing(name: str, field: str, value: float, unit: str) -> Constant:
    def scaled(setup: Setup, factor: float) -> Setup:
        bearing = setup.trade.bearing
        return with_trade(setup, bearing=replace(bearing, **{field: factor * getattr(bearing, field)}))

    return Constant(name, value, unit, SOURCES[field], scaled)


def _trade(name: str, field: str, value: float, unit: str, source: str) -> Constant:
    def scaled(setup: Setup, factor: float) -> Setup:
        return with_trade(setup, **{field: factor * value})

    return Constant(name, value, unit, source, scaled)


def _with_baseline(setup: Setup, drive) -> Setup:
    changed = replace(setup, space=replace(setup.space, baseline=drive))
    return with_trade(changed, reference=drive)


def _wall(setup: Setup, factor: float) -> Setup:
    """A thicker wall at the same inner radius, as the neutral line and the stress see it: teeth and module stay."""
    drive = setup.space.baseline
    gear = replace(drive.geometry, flexspline_wall=factor * drive.geometry.flexspline_wall)
    return _with_baseline(setup, replace(drive, geometry=gear))


def _material(field: str) -> Callable[[Setup, float], Setup]:
    def scaled(setup: Setup, factor: float) -> Setup:
        drive = setup.space.baseline
        material = replace(drive.material, **{field: factor * getattr(drive.material, field)})
        return _with_baseline(setup, replace(drive, material=material))

    return scaled


def _limit(key: str, side: str) -> Callable[[Setup, float], Setup]:
    def scaled(setup: Setup, factor: float) -> Setup:
        from hdopt.study.search import LimitSection

        given = setup.limit_sections[key]
        changed = LimitSection(**{side: factor * getattr(given, side)})
        return replace(setup, limit_sections={**setup.limit_sections, key: changed})

    return scaled
