"""A basis without physics: what any smooth structure in order, angle, torque, direction, speed or time could do.

The catalogue's explanation must be about as good as this on turns that neither saw; where this clearly wins,
something is there that the catalogue does not hold.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.effect import sine_columns, strongest_orders
from hdopt.diagnosis.probe import FitProbe
from hdopt.diagnosis.samples import Samples

Array = NDArray[np.float64]


ROWS_A_LINE, FEWEST_LINES, MOST_LINES = 800, 6, 16
"""Rows for each of the residual's strongest other orders, and how many of these there are."""


def generic_columns(samples: Samples, probe: FitProbe | None = None) -> tuple[Array, list[str]]:
    """Columns (n, q) and the domain each stands for; with a `probe` also sines at the residual's strongest other
    orders.
    """
    columns: list[Array] = []
    domains: list[str] = []

    def add(block: Array, domain: str) -> None:
        block = np.atleast_2d(block.T).T
        columns.append(block)
        domains.extend([domain] * block.shape[1])

    n, ratio = samples.theta, samples.ratio
    if samples.locked:
        add(_polynomial(np.arange(len(samples)), 4), "time")
    else:
        span = samples.span_turns
        integer = [k for k in range(1, 13) if k < 0.4 * samples.rows_per_turn]
        add(sine_columns(n, integer), "integer order")
        if span > 0.4 * ratio:
            slow = [k / ratio for k in (1, 2, 3, 4)]
            add(sine_columns(n, slow), "output order")
        if span > 0.8 * ratio:
            sides = [k + s / ratio for k in (1, 2, 3, 4) for s in (-1, 1, k)]
            add(sine_columns(n, sorted(set(sides))), "output-synchronous order")
    if samples.time is not None and not samples.locked:
        add(_polynomial(samples.time, 4), "time")
    if samples.torque is not None and np.std(samples.torque) > 0:
        add(_polynomial(samples.torque, 4), "torque")
        if not samples.locked:
            torque = samples.torque / np.max(np.abs(samples.torque))
            add(torque[:, None] * sine_columns(n, [1, 2]), "torque")
    if samples.temperature is not None and np.std(samples.temperature) > 0:
        add(_polynomial(samples.temperature, 2), "temperature")
    if samples.speed is not None and np.std(samples.speed) > 0.003 * np.max(np.abs(samples.speed)):
        add(_polynomial(samples.speed, 3), "speed")
        if not samples.locked and np.std(np.abs(samples.speed)) > 0.05 * np.max(np.abs(samples.speed)):
            speed = np.abs(samples.speed) / np.max(np.abs(samples.speed))
            add(speed[:, None] * sine_columns(n, [1, 2, 4]), "speed")
    if samples.reverses:
        direction = samples.direction
        add(direction, "direction")
        longest = float(samples.travel.max())
        for length in longest * np.array([0.003, 0.02, 0.1]):
            add(direction * np.exp(-samples.travel / length) * ~samples.first, "reversal")
        if not samples.locked:
            add(direction[:, None] * sine_columns(n, [1, 2]), "direction")
    if probe is not None and not samples.locked:
        found = strongest_orders(probe, int(np.clip(len(samples) // ROWS_A_LINE, FEWEST_LINES, MOST_LINES)))
        if len(found):
            add(sine_columns(n, found), "asynchronous order")
    return np.column_stack(columns), domains


def useful_columns(probe: FitProbe, inflation: float, most: int = 10) -> tuple[Array, list[str]]:
    """The generic basis reduced, group by group, to what pays for its freedom on this residual: (n, q) and domains."""
    columns, domains = generic_columns(probe.samples, probe)
    groups = _groups(domains)
    white = probe.project(probe.noise.whiten(columns))
    norm = np.sqrt(np.maximum((white**2).sum(0), 1e-300))
    raw = np.sqrt(np.maximum((probe.noise.whiten(columns) ** 2).sum(0), 1e-300))
    white = white / norm
    gram, moment = white.T @ white, white.T @ probe.white_residual
    alive = norm > 1e-3 * raw
    cost = np.log(max(len(probe.samples), 2))
    chosen: list[int] = []
    gain = 0.0
    for _ in range(most):
        best = (0.0, None, 0.0)
        for group in groups:
            members = [i for i in group if alive[i]]
            if not members or any(i in chosen for i in members):
                continue
            index = chosen + members
            part = gram[np.ix_(index, index)] + 1e-6 * np.eye(len(index))
            total = float(moment[index] @ np.linalg.solve(part, moment[index])) / probe.noise.sigma**2
            searched = np.log(4 * probe.samples.span_turns * 50) if domains[members[0]] == "asynchronous order" else 2.0
            score = (total - gain) / 2 / inflation - 0.5 * len(members) * cost - searched
            if score > best[0]:
                best = (score, members, total)
        if best[1] is None:
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
    low, high = float(np.min(values)), float(np.max(values))
    x = 2 * (values - low) / (high - low) - 1 if high > low else np.zeros(len(values))
    return np.polynomial.legendre.legvander(x, degree)[:, 1:]
