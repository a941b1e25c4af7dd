"""Explanations without physics that compete with the catalogue: where one of them wins, the verdict is `unknown`.

A sine at any order, a sine at any frequency in time, a jump, a bump, an order whose size changes with time, an even
function of torque or speed: each is a plain description of structure, searched over all its shapes like an effect and
priced like one. A catalogue effect that merely resembles such a structure loses against it.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import convolve1d

from hdopt.diagnosis.effect import Term, best_terms, sine_columns, strongest_orders, terms_at
from hdopt.diagnosis.steps import find_steps, step_columns
from hdopt.recording import TURN

JUMPS = (1, 2, 3, 4, 5, 6, 7, 9, 11, 13, 16, 20, 25, 30)
"""How many jumps a search tries."""
AT_A_REVERSAL = 0.5
"""Part of a turn about a reversal in which a jump may be what a loop leaves."""
ODDS = -3.0
"""Log prior odds against the catalogue's explanations at equal fit."""


class AnyOrder:
    """One sine, or three neighbours (a modulated sine), at any order."""

    id = "_sine_in_angle"
    domain = "asynchronous order"
    needs_base = False

    def lacks(self, samples):
        return None if samples.span_turns >= 4 else "at least 4 input turns"

    def search(self, probe):
        span = probe.samples.span_turns
        highest = min(0.45 * probe.samples.rows_per_turn, probe.order_range[1])
        lines = strongest_orders(probe, 3, lowest=max(2 / span, probe.order_range[0]), highest=highest)
        if not lines:
            return []
        found = []
        for line in lines[:2]:
            near = [self.term(probe.samples, {"order": line + d / span}) for d in np.linspace(-0.3, 0.3, 5)]
            found += best_terms(probe, near)
        best = best_terms(probe, found)[0]
        order = best.shape["order"]
        modulated = [
            self.term(probe.samples, {"order": order, "side": s})
            for s in np.unique(np.round(np.geomspace(1.2 / span, 0.5, 24), 5))
            if s < order
        ]
        return [best, *best_terms(probe, modulated)]

    def term(self, samples, shape, base_value=None):
        orders = [shape["order"]]
        if "side" in shape:
            orders += [shape["order"] - shape["side"], shape["order"] + shape["side"]]
        span = max(samples.span_turns, 1.0)
        trials = 4 * span * 0.45 * samples.rows_per_turn * (24.0 if "side" in shape else 1.0)
        return Term(
            self.id,
            dict(shape),
            columns=sine_columns(samples.theta, orders),
            steps={"order": 0.01 / span},
            trials=trials,
            odds=ODDS,
            doubtful=True,
        )


class AnyFrequency:
    """A sine at any fixed frequency in time, slow waves among them."""

    id = "_sine_in_time"
    domain = "time"
    needs_base = False

    def lacks(self, samples):
        return None if samples.time is not None and not samples.locked else "a time column"

    def search(self, probe):
        samples = probe.samples
        time = samples.time - samples.time.min()
        duration = float(np.ptp(time))
        step = duration / max(4 * len(samples), 64)
        length = 1 << int(np.ceil(np.log2(4 * duration / step)))
        cell = np.minimum((time / step).astype(int), length - 1)
        amplitude = np.abs(
            np.fft.rfft(np.bincount(cell, probe.residual - probe.residual.mean(), minlength=length)[:length])
        )
        frequencies = np.arange(len(amplitude)) / (length * step)
        usual = float(np.median(np.diff(samples.time)[np.diff(samples.piece) == 0])) if len(samples) > 2 else step
        amplitude[(frequencies < 0.4 / duration) | (frequencies > 0.45 / max(usual, step))] = 0
        found = []
        for _ in range(3):
            at = int(np.argmax(amplitude))
            found.append(frequencies[at])
            amplitude[max(at - 8, 0) : at + 8] = 0
        slow = list(np.array([0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8]) / duration)
        terms = [
            self.term(samples, {"frequency_hz": f + d / duration})
            for f in found
            for d in (np.linspace(-0.3, 0.3, 5) if f > 0 else [])
            if f + d / duration > 0
        ] + [self.term(samples, {"frequency_hz": f}) for f in slow]
        return best_terms(probe, terms)

    def term(self, samples, shape, base_value=None):
        duration = float(np.ptp(samples.time))
        frequency = max(shape["frequency_hz"], 0.2 / duration)
        return Term(
            self.id,
            {"frequency_hz": frequency},
            columns=sine_columns(TURN * (samples.time - samples.time.min()), [frequency]),
            steps={"frequency_hz": 0.01 / duration},
            trials=float(len(samples)),
            odds=ODDS,
            doubtful=True,
        )


class Event:
    """Something that happened at moments of the recording, whatever the angle."""

    domain = "time"
    needs_base = False

    def lacks(self, samples):
        return None if not samples.locked else "an input that turns"


class Jump(Event):
    """One jump or several, each at its moment of the recording, as of something that slipped."""

    id = "_jump"

    def search(self, probe):
        samples = probe.samples
        n = len(samples)
        edge = max(10, n // 200)
        grid = np.linspace(edge, n - edge, 60).astype(int)
        first = best_terms(probe, terms_at(self, samples, [{"row": float(i)} for i in grid]))[0]
        near = np.unique(np.clip(first.shape["row"] + np.linspace(-n / 60, n / 60, 41), edge, n - edge).astype(int))
        first = best_terms(probe, [self.term(samples, {"row": float(i)}) for i in near])[0]
        rows, _ = find_steps(probe.residual, most=JUMPS[-1])
        several = [
            self.term(samples, {f"row_{i}" if i else "row": float(row) for i, row in enumerate(rows[:count])})
            for count in JUMPS
            if count <= len(rows)
        ]
        return best_terms(probe, [first, *several])

    def term(self, samples, shape, base_value=None):
        rows = np.array(list(shape.values()))
        trials = float(len(samples)) ** len(rows)
        # A jump at a reversal could be the misfit of any loop; elsewhere nothing of the catalogue jumps.
        reversals = np.flatnonzero(np.diff(samples.direction) != 0) + 1
        near = np.abs(rows[:, None] - reversals[None, :]) < AT_A_REVERSAL * samples.rows_per_turn
        columns = step_columns(len(samples), rows)
        return Term(self.id, dict(shape), columns=columns, trials=trials, odds=ODDS, doubtful=bool(near.any()))


class Bump(Event):
    """One bump at one moment of the recording."""

    id = "_bump"

    def search(self, probe):
        samples = probe.samples
        shapes = []
        for width in np.geomspace(0.01, 3.0, 8) * samples.rows_per_turn:
            if not 1.0 <= width <= len(samples) / 12:
                continue
            reach = int(4 * width) + 1
            kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
            score = np.abs(convolve1d(probe.residual, kernel, mode="constant"))
            shapes.append({"row": float(np.argmax(score)), "width": float(width)})
        return best_terms(probe, [self.term(samples, shape) for shape in shapes])

    def term(self, samples, shape, base_value=None):
        width = min(max(shape["width"], 1.0), len(samples) / 6)
        row = min(max(shape["row"], 0.0), len(samples) - 1.0)
        column = np.exp(-0.5 * ((np.arange(len(samples)) - row) / width) ** 2)
        return Term(
            self.id,
            {"row": row, "width": width},
            columns=column[:, None],
            steps={"row": 0.05 * width, "width": 0.05 * width},
            trials=8.0 * len(samples),
            odds=ODDS,
            doubtful=True,
        )


class ChangingOrder:
    """A whole order, or a whole order of the flexspline, whose amplitude changes steadily over the recording."""

    id = "_changing_order"
    domain = "time"
    needs_base = False

    def lacks(self, samples):
        return None if samples.span_turns >= 4 else "at least 4 input turns"

    def search(self, probe):
        ratio = probe.samples.ratio
        orders = [k * f for k in (1, 2, 3, 4) for f in (1.0, 1 + 1 / ratio)]
        return best_terms(probe, terms_at(self, probe.samples, [{"order": o} for o in orders]))

    def term(self, samples, shape, base_value=None):
        along = np.linspace(-1, 1, len(samples))[:, None]
        columns = along * sine_columns(samples.theta, [shape["order"]])
        return Term(self.id, dict(shape), columns=columns, trials=8.0, odds=ODDS, doubtful=True)


class EvenLoad:
    """An even function of torque, or an order whose size follows the torque."""

    id = "_even_in_torque"
    domain = "torque"
    needs_base = False

    def lacks(self, samples):
        return None if samples.torque is not None and np.std(samples.torque) > 0 else "torque that varies"

    def search(self, probe):
        return best_terms(probe, terms_at(self, probe.samples, [{"kind": float(k)} for k in range(4)]))

    def term(self, samples, shape, base_value=None):
        torque = samples.torque / np.max(np.abs(samples.torque))
        kind = int(shape["kind"])
        if kind < 2:
            columns = (np.abs(torque) if kind == 0 else torque**2)[:, None]
        else:
            columns = torque[:, None] * sine_columns(samples.theta, [1.0 if kind == 2 else 2.0])
        return Term(self.id, dict(shape), columns=columns, trials=4.0, odds=ODDS, doubtful=True)


class EvenSpeed:
    """A function of speed that is the same in both directions."""

    id = "_even_in_speed"
    domain = "speed"
    needs_base = False

    def lacks(self, samples):
        if (
            samples.locked
            or samples.speed is None
            or np.std(np.abs(samples.speed)) < 0.05 * np.max(np.abs(samples.speed))
        ):
            return "speed that varies"
        return None

    def search(self, probe):
        return best_terms(probe, terms_at(self, probe.samples, [{"power": p} for p in (1.0, 2.0)]))

    def term(self, samples, shape, base_value=None):
        speed = np.abs(samples.speed) / np.max(np.abs(samples.speed))
        columns = (speed ** shape["power"])[:, None]
        return Term(self.id, dict(shape), columns=columns, trials=2.0, odds=ODDS, doubtful=True)


OUTSIDE = {e.id: e for e in (AnyOrder(), AnyFrequency(), Jump(), Bump(), ChangingOrder(), EvenLoad(), EvenSpeed())}
"""Descriptions that compete with the catalogue."""
