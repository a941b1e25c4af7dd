"""Explanations without physics that compete with the catalogue: where one of them wins, the verdict is `unknown`.

A sine at any order, a sine at any frequency in time, a jump, a bump, an order whose size changes with time, an even
function of torque or speed, one that answers the speed late: each is a plain description of structure, searched over
all its shapes like an effect and charged like one. A catalogue effect that merely resembles such a structure loses
against it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.fft import fft, irfft, next_fast_len, rfft

from hdopt.arrays import Array
from hdopt.diagnosis.inference.change_points import find_steps, step_columns
from hdopt.diagnosis.settings import DEFAULT, AlternativeSettings
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.base import Explanation, terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.probe import Probe, best_terms, strongest_orders
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Shape, Term
from hdopt.recordings.read import TURN


class Alternative(Explanation):
    """A description without physics, searched as its `settings` say."""

    def __init__(self, settings: AlternativeSettings = DEFAULT.alternatives):
        self.settings = settings


class AnyOrder(Alternative):
    """One sine, or three neighbours (a modulated sine), at any order."""

    id = "_sine_in_angle"
    domain = "asynchronous order"

    def lacks(self, samples: Conditions) -> str | None:
        least = self.settings.least_turns
        return None if samples.span_turns >= least else f"at least {least:g} input turns"

    def search(self, probe: Probe) -> list[Term]:
        s, rows = self.settings, probe.samples
        span = rows.span_turns
        highest = min(s.order_share * rows.rows_per_turn, probe.order_range[1])
        lowest = max(s.lowest_cycles / span, probe.order_range[0])
        lines = strongest_orders(probe, s.lines, lowest=lowest, highest=highest)
        if not lines:
            return []
        found = []
        for line in lines[: s.refined_lines]:
            beside = np.linspace(-s.resolution, s.resolution, s.resolution_steps)
            found += best_terms(probe, [self.term(rows, {"order": line + d / span}) for d in beside])
        best = best_terms(probe, found)[0]
        order = best.shape["order"]
        sides = np.unique(np.round(np.geomspace(s.closest_side / span, s.farthest_side, s.sides), s.side_digits))
        modulated = [self.term(rows, {"order": order, "side": side}) for side in sides if side < order]
        return [best, *best_terms(probe, modulated)]

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        s = self.settings
        orders = [shape["order"]]
        if "side" in shape:
            orders += [shape["order"] - shape["side"], shape["order"] + shape["side"]]
        span = max(samples.span_turns, 1.0)
        trials = s.trials_a_step * span * s.order_share * samples.rows_per_turn * (s.sides if "side" in shape else 1)
        return Term(
            self.id,
            dict(shape),
            columns=sine_columns(samples.theta, orders),
            steps={"order": s.derivative / span},
            trials=trials,
            odds=s.odds,
            doubtful=True,
        )


class InTime(Alternative):
    """Something that follows the clock, whatever the angle."""

    domain = "time"

    def lacks(self, samples: Conditions) -> str | None:
        return None if samples.time is not None and not samples.locked else "a time column"


class AnyFrequency(InTime):
    """A sine at any fixed frequency in time, slow waves among them."""

    id = "_sine_in_time"

    def search(self, probe: Probe) -> list[Term]:
        s, rows = self.settings, probe.samples
        if rows.time is None:
            return []
        duration = float(np.ptp(rows.time))
        found = strongest_frequencies(rows, probe.residual, s)
        beside = np.linspace(-s.resolution, s.resolution, s.resolution_steps) / duration
        terms = [self.term(rows, {"frequency_hz": f + d}) for f in found if f > 0 for d in beside if f + d > 0]
        terms += [self.term(rows, {"frequency_hz": wave / duration}) for wave in s.slow_waves]
        return best_terms(probe, terms)

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        s, time = self.settings, np.zeros(len(samples)) if samples.time is None else samples.time
        duration = float(np.ptp(time))
        frequency = max(shape["frequency_hz"], s.slowest / duration)
        return Term(
            self.id,
            {"frequency_hz": frequency},
            columns=sine_columns(TURN * (time - time.min()), [frequency]),
            steps={"frequency_hz": s.derivative / duration},
            trials=float(len(samples)),
            odds=s.odds,
            doubtful=True,
        )


class Mains(InTime):
    """Hum of the mains: its frequency, or that and its double and triple. At one speed it is a line of some order,
    which an encoder or a tooth mesh may have too; that the line is at the mains' frequency is no chance.
    """

    id = "_mains"
    leaves_nothing = True

    def search(self, probe: Probe) -> list[Term]:
        s, samples = self.settings, probe.samples
        shapes = []
        for mains in s.mains_hz:
            held = [multiples for multiples in s.mains_multiples if multiples * mains < self._highest(samples)]
            if not held:
                continue
            off, power = self._spectrum(samples, probe.residual, mains, max(held))
            for multiples in held:
                best = off[int(np.argmax(power[:multiples].sum(axis=0)))]
                beside = np.linspace(-1, 1, s.resolution_steps) * (off[1] - off[0])
                shapes += [{"frequency_hz": mains + best + d, "multiples": float(multiples)} for d in beside]
        return best_terms(probe, [self.term(samples, shape) for shape in shapes])

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        s, time = self.settings, samples.known_time
        mains = min(s.mains_hz, key=lambda one: abs(one - shape["frequency_hz"]))
        frequency = float(np.clip(shape["frequency_hz"], mains * (1 - s.mains_off), mains * (1 + s.mains_off)))
        hum = [frequency * k for k in range(1, int(shape["multiples"]) + 1)]
        sines = sine_columns(TURN * (time - time.min()), hum)
        # Each recording has a clock of its own, which nobody set by the mains.
        own = [sines * (samples.record == record)[:, None] for record in range(samples.records)]
        return Term(
            self.id,
            {"frequency_hz": frequency, "multiples": shape["multiples"]},
            columns=np.hstack(own),
            steps={"frequency_hz": s.derivative / float(np.ptp(time))},
            trials=float(self._places(samples) * len(s.mains_hz) * len(s.mains_multiples)),
            odds=s.mains_odds,
        )

    def _spectrum(self, samples: Conditions, residual: Array, mains: float, multiples: int) -> tuple[Array, Array]:
        """Differences (k,), Hz, from the `mains`' frequency within its tolerance, and the power of the `residual` (n,)
        at 1 to `multiples` times the frequencies that they make, (multiples, k), added over the recordings, each with a
        phase of its own. Turned back by the mains' frequency, hum changes so slowly that means over a part of a cycle
        of the largest difference hold it.
        """
        s, widest = self.settings, self.settings.mains_off * mains
        time, starts = samples.known_time, np.flatnonzero(np.diff(samples.record, prepend=-1))
        since = time - time[starts][samples.record]
        cell = (since * (widest * multiples * s.mains_cells)).astype(int)
        length = next_fast_len(int(s.trials_a_step) * (int(cell.max()) + 1))
        step = widest * multiples * s.mains_cells / length
        last = max(int(widest / step), 1)
        at = np.arange(-last, last + 1)
        power = np.zeros((multiples, len(at)))
        for record in range(samples.records):
            own = samples.record == record
            for k in range(1, multiples + 1):
                turned = residual[own] * np.exp(-1j * TURN * k * mains * since[own])
                slow = np.bincount(cell[own], turned.real, length) + 1j * np.bincount(cell[own], turned.imag, length)
                power[k - 1] += np.abs(fft(slow)[k * at]) ** 2
        return np.asarray(at * step, np.float64), power

    def _places(self, samples: Conditions) -> int:
        """Places within the mains' tolerance that the time of `samples` tells apart."""
        wide = 2 * self.settings.mains_off * max(self.settings.mains_hz) * float(np.ptp(samples.known_time))
        return 1 + 2 * math.ceil(wide * self.settings.trials_a_step / 2)

    def _highest(self, samples: Conditions) -> float:
        """The highest frequency (Hz) that the rows of `samples` hold."""
        return self.settings.highest_frequency / usual_step(samples, samples.known_time)


def strongest_frequencies(rows: Conditions, residual: Array, settings: AlternativeSettings) -> list[float]:
    """The strongest separate frequencies (Hz) of `residual` (n,) in the time of `rows`, on a grid of cells whose width
    and number follow from `settings`.

    `scipy.signal.lombscargle` finds the same lines of 9 400 uneven rows at 17 000 frequencies in 72 s, this in 0.04 s.
    """
    time = np.zeros(len(rows)) if rows.time is None else rows.time - rows.time.min()
    duration = float(np.ptp(time))
    step = duration / max(settings.frequency_cells * len(rows), settings.fewest_cells)
    length = 1 << int(np.ceil(np.log2(settings.frequency_cells * duration / step)))
    cell = np.minimum((time / step).astype(int), length - 1)
    signal = np.bincount(cell, residual - residual.mean(), minlength=length)[:length]
    amplitude = np.abs(np.fft.rfft(signal))
    frequencies = np.arange(len(amplitude)) / (length * step)
    usual = usual_step(rows, time) if len(rows) > 2 else step
    highest = settings.highest_frequency / max(usual, step)
    amplitude[(frequencies < settings.lowest_frequency / duration) | (frequencies > highest)] = 0
    found = []
    for _ in range(settings.frequencies):
        at = int(np.argmax(amplitude))
        found.append(float(frequencies[at]))
        amplitude[max(at - settings.line_cells, 0) : at + settings.line_cells] = 0
    return found


def usual_step(rows: Conditions, time: Array) -> float:
    """The median time (s) from one of the `rows` to the next of its piece, by their `time` (n,)."""
    return float(np.median(np.diff(time)[np.diff(rows.piece) == 0]))


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


class ChangingOrder(Alternative):
    """A whole order, or a whole order of the flexspline, whose amplitude changes steadily over the recording."""

    id = "_changing_order"
    domain = "time"

    def lacks(self, samples: Conditions) -> str | None:
        least = self.settings.least_turns
        return None if samples.span_turns >= least else f"at least {least:g} input turns"

    def search(self, probe: Probe) -> list[Term]:
        ratio = probe.samples.ratio
        orders = [k * f for k in range(1, self.settings.growing_orders + 1) for f in (1.0, 1 + 1 / ratio)]
        return best_terms(probe, terms_at(self, probe.samples, [{"order": o} for o in orders]))

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        along = np.linspace(-1, 1, len(samples))[:, None]
        columns = along * sine_columns(samples.theta, [shape["order"]])
        trials = self.settings.growing_trials
        return Term(self.id, dict(shape), columns=columns, trials=trials, odds=self.settings.odds, doubtful=True)


class EvenLoad(Alternative):
    """An even function of torque, or an order whose size follows the torque."""

    id = "_even_in_torque"
    domain = "torque"

    def lacks(self, samples: Conditions) -> str | None:
        return None if samples.torque is not None and np.std(samples.torque) > 0 else "torque that varies"

    def search(self, probe: Probe) -> list[Term]:
        kinds = [{"kind": float(k)} for k in range(self.settings.load_forms)]
        return best_terms(probe, terms_at(self, probe.samples, kinds))

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        own = np.zeros(len(samples)) if samples.torque is None else samples.torque
        torque = own / np.max(np.abs(own))
        forms = (
            lambda: np.abs(torque)[:, None],
            lambda: (torque**2)[:, None],
            lambda: torque[:, None] * sine_columns(samples.theta, [1.0]),
            lambda: torque[:, None] * sine_columns(samples.theta, [2.0]),
        )
        columns = forms[int(shape["kind"]) % len(forms)]()
        trials = float(self.settings.load_forms)
        return Term(self.id, dict(shape), columns=columns, trials=trials, odds=self.settings.odds, doubtful=True)


class EvenSpeed(Alternative):
    """A function of speed that is the same in both directions, at once or with a lag, as of what heats itself by
    friction: slower and slower towards what this speed leads to, from rest at the start of each recording.
    """

    id = "_even_in_speed"
    domain = "speed"

    def lacks(self, samples: Conditions) -> str | None:
        if samples.locked or samples.speed is None:
            return "speed that varies"
        size = np.abs(samples.speed)
        return "speed that varies" if np.std(size) < self.settings.speed_levels * np.max(size) else None

    def search(self, probe: Probe) -> list[Term]:
        s, samples = self.settings, probe.samples
        powers = [{"power": p} for p in (1.0, 2.0)]
        found = best_terms(probe, terms_at(self, samples, powers))
        if samples.time is None:
            return found
        longest = longest_recording(samples)
        lags = [lag * longest for lag in s.speed_lags]
        return [
            *found,
            *best_terms(probe, terms_at(self, samples, [p | {"lag_s": lag} for p in powers for lag in lags])),
        ]

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        s, kept = self.settings, dict(shape)
        own = np.zeros(len(samples)) if samples.speed is None else np.abs(samples.speed)
        column, steps, trials = (own / np.max(own)) ** shape["power"], {}, s.speed_forms
        if "lag_s" in shape:
            longest = longest_recording(samples)
            kept["lag_s"] = float(np.clip(shape["lag_s"], s.shortest_lag * longest, longest))
            column = lagging(samples, column, kept["lag_s"])
            steps, trials = {"lag_s": s.lag_derivative * kept["lag_s"]}, s.speed_forms * len(s.speed_lags)
        return Term(self.id, kept, columns=column[:, None], steps=steps, trials=trials, odds=s.odds, doubtful=True)


def longest_recording(samples: Conditions) -> float:
    """Time (s) that the longest recording of `samples` lasts."""
    return max(float(np.ptp(samples.known_time[samples.record == record])) for record in range(samples.records))


def lagging(samples: Conditions, target: Array, lag: float) -> Array:
    """What follows a `target` (n,) with a `lag` (s) over the time of `samples`, from zero at the start of each
    recording, (n,): y' = (target - y)/lag, the target held over each step.
    """
    found = np.empty(len(target))
    for record in range(samples.records):
        own = samples.record == record
        time = samples.known_time[own]
        growth = np.exp((time - time[0]) / lag)
        found[own] = np.cumsum(target[own] * np.diff(growth, prepend=growth[0])) / growth
    return found


class Scale(Alternative):
    """A ratio that is not quite the one given, or an encoder whose count is not quite a turn: an error in proportion to
    the input angle. No physics of the drive, and no sign of something unknown: it is told as what it is.
    """

    id = "_scale"
    domain = "time"
    exact_shape = True

    def lacks(self, samples: Conditions) -> str | None:
        least = self.settings.scale_turns
        return None if not samples.locked and samples.span_turns >= least else f"at least {least:g} input turns"

    def search(self, probe: Probe) -> list[Term]:
        return [self.term(probe.samples, {})]

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        """The column is in arcmin for an error of one per rad of input."""
        columns = (samples.theta - samples.theta.mean())[:, None] / ARCMIN
        return Term(self.id, {}, columns=columns, odds=self.settings.scale_odds)


class Skew(Alternative):
    """Two clocks that run apart: a delay between the channels that grows with time. Where it does not grow it is an
    effect, `channel_delay`; at one speed one way it is a scale.
    """

    id = "_skew"
    domain = "time"
    exact_shape = True

    def lacks(self, samples: Conditions) -> str | None:
        if samples.locked or samples.speed is None or samples.time is None:
            return "time and speed"
        varies = float(np.std(samples.speed)) >= self.settings.speed_levels * float(np.max(np.abs(samples.speed)))
        return None if varies else "speed that varies"

    def search(self, probe: Probe) -> list[Term]:
        return [self.term(probe.samples, {})]

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        """The column is in arcmin for a delay that grows by one second a second."""
        time = samples.known_time
        columns = ((time - time[0]) * samples.known_speed / samples.ratio / ARCMIN)[:, None]
        return Term(self.id, {}, columns=columns, odds=self.settings.skew_odds)


class NewZero(Alternative):
    """Recordings of which one or more were begun with a zero of their own, a little off the first's: larger ones are
    seen before anything is fitted, and are always free.
    """

    id = "_zero"
    domain = "time"
    exact_shape = True
    aside = True

    def lacks(self, samples: Conditions) -> str | None:
        return None if samples.records > 1 else "two recordings"

    def search(self, probe: Probe) -> list[Term]:
        return [self.term(probe.samples, {})]

    def term(self, samples: Conditions, shape: Mapping[str, float], motion: Array | None = None) -> Term:
        """The columns are in arcmin, one for each recording but the first. What differs from recording to recording by
        direction, speed or load is an effect's first.
        """
        columns = (samples.record[:, None] == np.arange(1, samples.records)).astype(float)
        return Term(self.id, {}, columns=columns, odds=self.settings.zero_odds, doubtful=True)


class VaryingContact(Alternative):
    """A k_e that varies round the input's turn, as the number of teeth in mesh does where the wave generator's two ends
    differ: the drive's own error, larger and smaller with the input angle. Drives as built are so, and it is told.
    """

    id = "_varying_contact"
    domain = "angle"
    needs_base = True
    exact_shape = True
    aside = True
    has_parts = True
    driven = True
    at_once = True

    def lacks(self, samples: Conditions) -> str | None:
        least = self.settings.least_turns
        return None if not samples.locked and samples.span_turns >= least else f"at least {least:g} input turns"

    def search(self, probe: Probe) -> list[Term]:
        shapes = [{"waves": float(waves)} for waves in range(1, self.settings.contact_waves + 1)]
        return best_terms(probe, [self.term(probe.samples, shape, probe.motion) for shape in shapes])

    def term(self, samples: Conditions, shape: Mapping[str, float], motion: Array | None = None) -> Term:
        """The columns are in arcmin for a share of one: sine and cosine of each of 1 to `waves` waves a turn."""
        if motion is None:
            raise ValueError(f"{self.id} follows the drive's motion, which was not given")
        columns = motion[:, None] * self._waves(samples, shape)
        return Term(self.id, dict(shape), columns=columns, odds=self.settings.contact_odds)

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        """Whether it is no more than a contact varies."""
        return bool(np.abs(estimate.values[: term.width]).max() < self.settings.contact_most)

    def response(self, conditions: Conditions, shape: Shape, coefficients: Array, motions: Array) -> Array:
        return motions * (self._waves(conditions, shape) @ coefficients)[:, None]

    def _waves(self, samples: Conditions, shape: Shape) -> Array:
        return samples.waves_of_input(int(shape["waves"]))


ALTERNATIVES: tuple[type[Alternative], ...] = (
    AnyOrder,
    AnyFrequency,
    Mains,
    Jump,
    Bump,
    ChangingOrder,
    EvenLoad,
    EvenSpeed,
    Scale,
    Skew,
    NewZero,
    VaryingContact,
)


def alternatives(settings: AlternativeSettings) -> tuple[Alternative, ...]:
    """Every description that competes with the catalogue, searched as `settings` say."""
    return tuple(one(settings) for one in ALTERNATIVES)
