"""The constants of the trade: value, unit, where each comes from, and the search with one of them changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from hdopt.drive.geometry import Drive, Structure
from hdopt.mechanics.bearing_life import SOURCES
from hdopt.optimize.objectives import find_quantity
from hdopt.optimize.setup import Setup, with_trade


@dataclass(frozen=True)
class Constant:
    """A constant of the trade: its value in its unit, where it comes from, and the setup with it multiplied."""

    name: str
    value: float
    unit: str
    source: str
    scaled: Callable[[Setup, float], Setup]


def constants_of(setup: Setup) -> list[Constant]:
    """Every constant of the trade that has a value in `setup`."""
    trade, bearing = setup.trade, setup.trade.bearing
    drive = setup.space.baseline
    found: list[Constant | None] = [
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
        _trade(
            "Sensitivity to the mean stress",
            "mean_stress_sensitivity",
            trade.mean_stress_sensitivity or None,
            "",
            "assumed: 0.2, of the size that handbooks give for alloyed steel; not checked against a source",
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
    for structure, cost in trade.structure_costs:
        if cost:
            name = f"Cost of the structure {structure.value.replace('_', ' ')}"
            found.append(Constant(name, 100 * cost, "% of the objective", "the study's", _structure_cost(structure)))
    for key, given in setup.limit_rules.items():
        words = "share of the baseline" if given.of_baseline else find_quantity(key).unit
        if given.bound:
            found.append(
                Constant(f"Limit: {find_quantity(key).title}", given.bound, words, "the study's choice", _limit(key))
            )
    return [constant for constant in found if constant is not None]


def _bearing(name: str, field: str, value: float, unit: str) -> Constant:
    def scaled(setup: Setup, factor: float) -> Setup:
        bearing = setup.trade.bearing
        return with_trade(setup, bearing=replace(bearing, **{field: factor * getattr(bearing, field)}))

    return Constant(name, value, unit, SOURCES[field], scaled)


def _trade(name: str, field: str, value: float | None, unit: str, source: str) -> Constant | None:
    if value is None:
        return None

    def scaled(setup: Setup, factor: float) -> Setup:
        return with_trade(setup, **{field: factor * value})

    return Constant(name, value, unit, source, scaled)


def _with_baseline(setup: Setup, drive: Drive) -> Setup:
    changed = replace(setup, space=replace(setup.space, baseline=drive))
    return with_trade(changed, reference=drive)


def _wall(setup: Setup, factor: float) -> Setup:
    """A thicker wall at the same inner radius, as the neutral line and the stress see it: teeth and module stay."""
    drive = setup.space.baseline
    wall = drive.geometry.flexspline_wall
    gear = replace(drive.geometry, flexspline_wall=None if wall is None else factor * wall)
    return _with_baseline(setup, replace(drive, geometry=gear))


def _material(field: str) -> Callable[[Setup, float], Setup]:
    def scaled(setup: Setup, factor: float) -> Setup:
        drive = setup.space.baseline
        assert drive.material is not None, "a constant of the material is perturbed only where there is a material"
        material = replace(drive.material, **{field: factor * getattr(drive.material, field)})
        return _with_baseline(setup, replace(drive, material=material))

    return scaled


def _structure_cost(structure: Structure) -> Callable[[Setup, float], Setup]:
    def scaled(setup: Setup, factor: float) -> Setup:
        costs = tuple((s, cost * factor if s == structure else cost) for s, cost in setup.trade.structure_costs)
        return with_trade(setup, structure_costs=costs)

    return scaled


def _limit(key: str) -> Callable[[Setup, float], Setup]:
    def scaled(setup: Setup, factor: float) -> Setup:
        given = setup.limit_rules[key]
        changed = replace(given, bound=factor * given.bound)
        return replace(setup, limit_rules={**setup.limit_rules, key: changed})

    return scaled
