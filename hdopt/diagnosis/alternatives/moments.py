"""What happened at moments of the recording, whatever the angle: jumps and a bump."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from hdopt.arrays import Array
from hdopt.diagnosis.alternatives.base import Alternative
from hdopt.diagnosis.inference.change_points import find_steps, step_columns
from hdopt.effects.base import terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Term


class Event(Alternative):
    """Something that happened at moments of the recording, whatever the angle."""

    domain = "time"

    def lacks(self, samples: Conditions) -> str | None:
        if samples.output_step > 0:
            return "an output encoder of finer steps"
        return None if not samples.locked else "an input that turns"


class Jump(Event):
    """One jump or several, each at its moment of the recording, as of something that slipped."""

    id = "_jump"

    def search(self, probe: Probe) -> list[Term]:
        s, samples = self.settings, probe.samples
        n = len(samples)
        edge = max(s.jump_edge_rows, n // s.jump_edge)
        grid = np.linspace(edge, n - edge, s.jump_grid).astype(int)
        first = best_terms(probe, terms_at(self, samples, [{"row": float(i)} for i in grid]))[0]
        beside = np.linspace(-n / s.jump_grid, n / s.jump_grid, s.jump_places)
        near = np.unique(np.clip(first.shape["row"] + beside, edge, n - edge).astype(int))
        first = best_terms(probe, [self.term(samples, {"row": float(i)}) for i in near])[0]
        rows, _ = find_steps(probe.residual, most=int(s.jumps[-1]))
        several = [
            self.term(samples, {f"row_{i}" if i else "row": float(row) for i, row in enumerate(rows[:count])})
            for count in s.jumps
            if count <= len(rows)
        ]
        return best_terms(probe, [first, *several])

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        rows = np.array(list(shape.values()))
        trials = float(len(samples)) ** len(rows)
        # A jump at a reversal could be the misfit of any loop, at a recording's start a new zero; elsewhere nothing of
        # the catalogue jumps.
        reversals = np.flatnonzero((np.diff(samples.direction) != 0) | (np.diff(samples.record) != 0)) + 1
        near = np.abs(rows[:, None] - reversals[None, :]) < self.settings.at_a_reversal * samples.rows_per_turn
        columns = step_columns(len(samples), rows)
        return Term(
            self.id, dict(shape), columns=columns, trials=trials, odds=self.settings.odds, doubtful=bool(near.any())
        )


class Bump(Event):
    """One bump at one moment of the recording."""

    id = "_bump"

    def search(self, probe: Probe) -> list[Term]:
        s, samples = self.settings, probe.samples
        shapes = []
        for width in np.geomspace(s.bump_narrowest, s.bump_widest, s.bump_widths) * samples.rows_per_turn:
            if not 1 <= width <= len(samples) / s.bump_record:
                continue
            reach = int(s.bump_reach * width) + 1
            kernel = np.exp(-((np.arange(-reach, reach + 1) / width) ** 2) / 2)
            score = np.abs(smoothed(probe.residual, kernel))
            shapes.append({"row": float(np.argmax(score)), "width": float(width)})
        return best_terms(probe, [self.term(samples, shape) for shape in shapes])

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        s = self.settings
        width = min(max(shape["width"], 1.0), len(samples) / s.bump_record_fit)
        row = min(max(shape["row"], 0.0), len(samples) - 1.0)
        column = np.exp(-(((np.arange(len(samples)) - row) / width) ** 2) / 2)
        return Term(
            self.id,
            {"row": row, "width": width},
            columns=column[:, None],
            steps={"row": s.bump_derivative * width, "width": s.bump_derivative * width},
            trials=s.bump_trials * len(samples),
            odds=s.odds,
            doubtful=True,
        )


def smoothed(values: Array, kernel: Array) -> Array:
    """The sum of the neighbours of each of `values` (n,) weighed by a symmetric `kernel` of odd length, nothing beyond
    the ends, (n,): as `scipy.ndimage.convolve1d`, which goes through all neighbours of each.
    """
    length = next_fast_len(len(values) + len(kernel) - 1, real=True)
    whole = irfft(rfft(values, length) * rfft(kernel, length), length)
    return np.asarray(whole[len(kernel) // 2 :][: len(values)], np.float64)
