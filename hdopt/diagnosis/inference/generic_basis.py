"""A basis without physics: what any smooth structure in order, angle, torque, direction, speed or time could do.

The catalogue's explanation must be about as good as this on turns that neither saw; where this clearly wins,
something is there that the catalogue does not hold.
"""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import RIDGE, TINY
from hdopt.diagnosis.settings import DEFAULT, GenericSettings
from hdopt.effects.conditions import varies
from hdopt.effects.probe import strongest_orders
from hdopt.effects.sines import sine_columns
from hdopt.recordings.rows import Rows

SPEED_ORDERS = (1, 2, 4)
"""Orders of the base whose size may follow the speed."""


class _Columns:
    """Columns as they are gathered, with the domain that each stands for."""

    def __init__(self) -> None:
        self.blocks: list[Array] = []
        self.domains: list[str] = []

    def add(self, block: Array, domain: str) -> None:
        """Takes `block`, (n,) or (n, q)."""
        block = block.reshape(len(block), -1)
        self.blocks.append(block)
        self.domains.extend([domain] * block.shape[1])


def generic_columns(
    rows: Rows, probe: FitProbe | None = None, settings: GenericSettings = DEFAULT.generic
) -> tuple[Array, list[str]]:
    """Columns (n, q) of `rows` and the domain each stands for; with a `probe`, whose own settings then hold, also sines
    at the residual's strongest other orders.
    """
    settings = settings if probe is None else probe.fit.problem.settings.generic
    found = _Columns()
    if rows.locked:
        found.add(_polynomial(np.arange(len(rows), dtype=float), settings.time_degree), "time")
    else:
        _add_orders(found, rows, settings)
    if rows.time is not None and not rows.locked:
        found.add(_polynomial(rows.time, settings.time_degree), "time")
    _add_load(found, rows, settings)
    _add_speed(found, rows, settings)
    if rows.reverses:
        _add_direction(found, rows, settings)
    if probe is not None and not rows.locked:
        count = int(np.clip(len(rows) // settings.rows_a_line, settings.fewest_lines, settings.most_lines))
        if orders := strongest_orders(probe, count):
            found.add(sine_columns(rows.theta, orders), "asynchronous order")
    return np.column_stack(found.blocks), found.domains


def _add_orders(found: _Columns, rows: Rows, settings: GenericSettings) -> None:
    n, ratio, span = rows.theta, rows.ratio, rows.span_turns
    whole = range(1, settings.whole_orders + 1)
    found.add(sine_columns(n, [k for k in whole if k < settings.order_share * rows.rows_per_turn]), "integer order")
    multiples = range(1, settings.output_harmonics + 1)
    if span > settings.output_span * ratio:
        found.add(sine_columns(n, [k / ratio for k in multiples]), "output order")
    if span > settings.side_span * ratio:
        sides = {k + s / ratio for k in multiples for s in (-1, 1, k)}
        found.add(sine_columns(n, sorted(sides)), "output-synchronous order")


def _add_load(found: _Columns, rows: Rows, settings: GenericSettings) -> None:
    if rows.torque is not None and np.std(rows.torque) > 0:
        found.add(_polynomial(rows.torque, settings.torque_degree), "torque")
        if not rows.locked:
            torque = rows.torque / np.max(np.abs(rows.torque))
            found.add(torque[:, None] * sine_columns(rows.theta, [1, 2]), "torque")
            if rows.reverses:
                found.add(torque * rows.direction, "torque")
            if varies(rows.speed, settings.speed_varies):
                found.add(torque * rows.known_speed, "torque")
    if rows.temperature is not None and np.std(rows.temperature) > 0:
        found.add(_polynomial(rows.temperature, settings.temperature_degree), "temperature")


def _add_speed(found: _Columns, rows: Rows, settings: GenericSettings) -> None:
    if not varies(rows.speed, settings.speed_varies):
        return
    found.add(_polynomial(rows.known_speed, settings.speed_degree), "speed")
    size = np.abs(rows.known_speed)
    if not rows.locked and varies(size, settings.speed_levels):
        found.add((size / np.max(size))[:, None] * sine_columns(rows.theta, SPEED_ORDERS), "speed")


def _add_direction(found: _Columns, rows: Rows, settings: GenericSettings) -> None:
    direction = rows.direction
    found.add(direction, "direction")
    for length in float(rows.travel.max()) * np.array(settings.reversal_lengths):
        found.add(direction * np.exp(-rows.travel / length) * ~rows.first, "reversal")
    if not rows.locked:
        found.add(direction[:, None] * sine_columns(rows.theta, [1, 2]), "direction")


def useful_columns(probe: FitProbe, inflation: float) -> tuple[Array, list[str]]:
    """The generic basis reduced, group by group, to what pays for its freedom on the residual of `probe`, whose noise
    is rougher by `inflation`: (n, q) and domains.
    """
    settings = probe.fit.problem.settings.generic
    columns, domains = generic_columns(probe.rows, probe)
    whitened = probe.noise.whiten(columns)
    white = probe.project(whitened)
    norm = np.sqrt(np.maximum((white**2).sum(0), TINY))
    alive = norm > settings.absorbed * np.sqrt(np.maximum((whitened**2).sum(0), TINY))
    white = white / norm
    gram, moment = white.T @ white, white.T @ probe.white_residual
    cost = np.log(max(len(probe.rows), 2))
    line_cost = np.log(max(settings.line_trials * probe.rows.span_turns, 1.0))
    left = [[i for i in group if alive[i]] for group in _groups(domains)]
    chosen: list[int] = []
    gain = 0.0
    for _ in range(settings.most_groups):
        best: tuple[float, list[int], float] | None = None
        for members in left:
            if not members or any(i in chosen for i in members):
                continue
            index = chosen + members
            part = gram[np.ix_(index, index)] + RIDGE * np.eye(len(index))
            total = float(moment[index] @ np.linalg.solve(part, moment[index])) / probe.noise.sigma**2
            searched = line_cost if domains[members[0]] == "asynchronous order" else settings.other_cost
            score = (total - gain) / 2 / inflation - len(members) * cost / 2 - searched
            if score > (best[0] if best is not None else 0):
                best = (score, members, total)
        if best is None:
            break
        chosen += best[1]
        gain = best[2]
    return columns[:, chosen], [domains[i] for i in chosen]


def _groups(domains: list[str]) -> list[list[int]]:
    """Sines go in pairs, polynomials and the rest one by one."""
    groups, i = [], 0
    while i < len(domains):
        pair = domains[i].endswith("order")
        groups.append([i, i + 1] if pair else [i])
        i += 2 if pair else 1
    return groups


def _polynomial(values: Array, degree: int) -> Array:
    """Legendre polynomials 1 to `degree` of `values` (n,) on their own range, (n, degree)."""
    low, high = float(np.min(values)), float(np.max(values))
    x = 2 * (values - low) / (high - low) - 1 if high > low else np.zeros(len(values))
    return np.asarray(np.polynomial.legendre.legvander(x, degree)[:, 1:], float)
