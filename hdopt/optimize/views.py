"""What the trade report draws besides the search itself: a map about the chosen design, and each profile's ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.mechanics.bending import curvature_change
from hdopt.optimize.objectives import NOMINAL, ROBUST, find_quantity
from hdopt.optimize.problem import Limit
from hdopt.optimize.records import SearchResult, choose

MAP_POINTS = 25
TURN = np.linspace(0.0, 2 * np.pi, 361)
MAPPED = ("bearing_life_h", "carrying_teeth", "trailing_flank_room_mm", "flank_pressure_mpa", "lag_arcmin")
"""Limits that depend on pressure angle or width, those first that matter most on the map."""


@dataclass(frozen=True)
class DesignMap:
    """Peak-to-peak (m, n) over pressure angle (m,) and width (n,), all else as chosen, and limits over that grid."""

    pressure_angle_deg: Array
    width_mm: Array
    peak_to_peak_arcmin: Array
    title: str
    limits: tuple[tuple[Limit, Array], ...]


@dataclass(frozen=True)
class Rings:
    """Deflection and change of curvature of each profile's best design, over one turn."""

    phi: Array
    deflection_mm: dict[str, Array]
    curvature_change_per_mm: dict[str, Array]
    radius_mm: float


@dataclass(frozen=True)
class TradeViews:
    design_map: DesignMap
    rings: Rings


def trade_views(result: SearchResult) -> TradeViews:
    """The map and the rings of a search's `result`."""
    return TradeViews(_map(result), _rings(result))


def _map(result: SearchResult) -> DesignMap:
    setup, chosen, baseline = result.setup, result.chosen, result.baseline.variables
    both = [(chosen.values.get(name, baseline[name]), baseline[name]) for name in ("pressure_angle_deg", "width_mm")]
    angles, widths = (np.linspace(0.75 * min(pair), 1.15 * max(pair), MAP_POINTS) for pair in both)
    quantity = find_quantity(ROBUST if result.objective == ROBUST else NOMINAL)
    shown = [limit for key in MAPPED for limit in setup.limits() if limit.quantity == key]
    values = np.empty((len(angles), len(widths)))
    limited = [np.empty_like(values) for _ in shown]
    for i, angle in enumerate(angles):
        for j, width in enumerate(widths):
            here = {**chosen.values, "pressure_angle_deg": float(angle), "width_mm": float(width)}
            design = setup.space.design(chosen.combination, here)
            values[i, j] = quantity.value(setup.trade, design)
            for limit, grid in zip(shown, limited, strict=True):
                grid[i, j] = find_quantity(limit.quantity).value(setup.trade, design)
    return DesignMap(angles, widths, values, quantity.title, tuple(zip(shown, limited, strict=True)))


def _rings(result: SearchResult) -> Rings:
    deflection, change = {}, {}
    for profile in dict.fromkeys(s.combination.profile for s in result.solutions):
        best = choose([s for s in result.solutions if s.combination.profile == profile])
        mesh = result.setup.space.design(best.combination, best.values).mesh
        deflection[profile] = mesh.profile.radius(TURN) - mesh.geometry.flexspline_inner_radius
        change[profile] = curvature_change(mesh.geometry, mesh.profile, TURN)
    return Rings(TURN, deflection, change, result.setup.space.baseline.geometry.flexspline_inner_radius)
