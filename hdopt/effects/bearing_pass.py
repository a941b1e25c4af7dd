"""Ball passes of the wave generator's bearing: orders that are no multiples of 1/N.

Kinematics of a ball bearing without slip (Harris, "Rolling Bearing Analysis", ch. on ball speeds), inner ring on the
wave generator, outer ring on the flexspline, which turns at -1/N; r = ball over pitch diameter, n balls: cage f_c =
(1 - r)/2 - (1 + r)/(2 N); one odd ball 1 - f_c relative to the load zone, (1 + r)(1 + 1/N)/2, and twice that (two
zones); outer-race pass (n/2)(1 - r)(1 + 1/N); inner-race pass (n/2)(1 + r)(1 + 1/N). Units: arcmin; prior r 0.04 to
0.35, n 7 to 40.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects._zone_harmonics import zone_harmonics
from hdopt.effects.base import Effect, Keys
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import UM, Quantity, Sines, needed, number, smallest_set
from hdopt.effects.estimate import FitEstimate, Parameter, counted
from hdopt.effects.probe import Probe, best_terms, worth
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Shape, Term
from hdopt.errors import HdoptError, MissingValue

BALLS = np.arange(7, 41)
RATIO_RANGE = (0.04, 0.35)


def bearing_orders(ball_ratio: Array | float, balls: int, gear_ratio: float) -> Array:
    """Cage, odd ball once and twice, outer pass, inner pass: orders in cycles per input turn, shape (5, ...).

    `ball_ratio` is ball over pitch diameter, any shape; `balls` their number, `gear_ratio` N.
    """
    r, n, relative = np.asarray(ball_ratio), balls, 1 + 1 / gear_ratio
    return np.stack(
        [
            (1 - r) / 2 - (1 + r) / (2 * gear_ratio) + 0 * n,
            (1 + r) * relative / 2 + 0 * n,
            (1 + r) * relative + 0 * n,
            n / 2 * (1 - r) * relative,
            n / 2 * (1 + r) * relative,
        ]
    )


ZONE_HARMONICS: tuple[tuple[int, ...], ...] = (
    (2,),
    (2, 4),
    (1, 2),
    *(tuple(range(1, k + 1)) for k in (4, 6, 10, 16, 28)),
)
"""Balls of unequal diameter or spacing: harmonics of the balls' place under the lobes, (1 + r)(1 + 1/N)/2, met by one
lobe and, half a turn of the ring of balls on, by the other: even ones act directly, odd ones through the change of
the driving zone.
"""

COUNTED = 2.0
"""Size of the wave of n balls over the usual wave of balls unlike in place, from which it counts the balls."""
STANDS_OUT = 10.0
"""Power over the median from which a line may be more than noise (whose largest of thousands is about 14 times it):
below it no bearing is looked for.
"""

LINE_SHOWS, LEAST_LINE = 4.0, 0.1
"""Standard deviations, and part of the strongest, from which a line is there."""
FEW_WAVES, MANY_SHOW = 3, 0.5
"""Sets of so few waves must show all of them, larger ones this part."""

LINES: tuple[tuple[int, ...], ...] = (
    (0, 1, 2, 3, 4),
    (0, 3),
    (0, 2),
    (0, 1, 2),
    (3, 4),
    (0, 3, 4),
    (0, 2, 3),
    (1, 2),
    (2, 3),
    (1, 2, 3),
)
"""Which of the five orders a variant shows."""
LINE_NAMES = ("cage", "odd_ball_half", "odd_ball", "outer_pass", "inner_pass")
PASSES = (3, 4)
"""Of these the ones that count balls."""

AT_THE_OUTPUT = Sines(
    {i: (f"{name}_arcmin", f"{name}_phase_deg") for i, name in enumerate(LINE_NAMES)},
    "arcmin",
    "at the output, at the orders of cage and balls",
    prior=(0.0, 2.0),
    shown="`cage`, `odd_ball_half`, `odd_ball`, `outer_pass`, `inner_pass`, each `…_arcmin`, `…_phase_deg`",
)
UNEQUAL = Sines(
    {
        h: (f"unequal_{h}_um", f"unequal_{h}_phase_deg")
        for h in sorted({int(n) for n in BALLS} | {h for group in ZONE_HARMONICS for h in group})
    },
    "um",
    "of arc, balls unlike in place, in the meshing zones",
    prior=(0.0, 20.0),
    scale=UM,
    shown="`unequal_H_um`, `unequal_H_phase_deg`, H 1 to 28 and the number of `balls`",
)


def zone_orders(shape: Shape) -> tuple[int, ...]:
    """Harmonics of the balls' place under the lobes that the `shape` of a zone variant holds: its set, and n where n
    is counted.
    """
    members, balls = tuple(shape["zones"]), int(shape["balls"])
    return (*members, balls) if balls and balls not in members else members


def _waves_that_show(term: Term, estimate: FitEstimate) -> tuple[Array, Mask]:
    """The size of each wave of `term`, and whether it surely is there."""
    size = estimate.sizes(term.width // 2)
    variance = np.diag(estimate.covariance)[: 2 * len(size)]
    return size, size > LINE_SHOWS * np.sqrt(0.5 * (variance[0::2] + variance[1::2]))


@dataclass(frozen=True)
class _Spectrum:
    """Power (arcmin^2) of a residual on a grid of orders, of a drive of ratio N; `trials` are ratios times balls."""

    power: Array
    grid: Array
    ratio: float
    trials: float

    def at(self, orders: Array) -> Array:
        """Power at these orders."""
        return np.interp(orders, self.grid, self.power, left=0.0, right=0.0)

    def of_wave(self, harmonic: int, half: Array) -> Array:
        """Power at the orders of one wave of the balls' place: direct if even, through the change of zone if odd."""
        if harmonic % 2 == 0:
            return self.at(harmonic * half)
        return self.at(1 + harmonic * half) + self.at(np.abs(harmonic * half - 1))

    @property
    def usual(self) -> float:
        """Power of the noise, about."""
        seen = self.power[self.power > 0]
        return float(np.median(seen)) if len(seen) else 0.0

    def place(self, ball_ratio: Array | float) -> Array:
        """The order of the balls' place under the lobes."""
        return np.asarray((1 + np.asarray(ball_ratio)) * (1 + 1 / self.ratio) / 2)


class BearingPass(Effect):
    id = "bearing_pass"
    place = 110
    domain = "order"
    has_parts = True
    excites = True
    needs_strain_wave = True
    acts = "beside, or zones"
    separating = (
        "record ten output turns, or with the bearing turned by one ball pitch: its orders drift against the teeth"
    )
    declared = (
        Quantity("ball_to_pitch_ratio", "1", "ball over pitch diameter", "r", RATIO_RANGE, above=0.0, below=1.0),
        Quantity(
            "balls",
            "1",
            "of a pass, or of the wave of as many unequal balls",
            "n",
            (7, 40),
            None,
            at_least=3,
            at_most=200,
            whole=True,
        ),
        AT_THE_OUTPUT,
        UNEQUAL,
    )
    examples = (
        {
            "ball_to_pitch_ratio": 0.14,
            "balls": 31,
            "unequal_2_um": 0.5,
            "unequal_2_phase_deg": 25.0,
            "unequal_31_um": 0.3,
            "unequal_31_phase_deg": 35.0,
        },
        {
            "ball_to_pitch_ratio": 0.14,
            "balls": 18,
            "cage_arcmin": 0.05,
            "cage_phase_deg": 10.0,
            "outer_pass_arcmin": 0.04,
            "outer_pass_phase_deg": 80.0,
        },
        {"ball_to_pitch_ratio": 0.14, "unequal_2_um": 1.0, "unequal_2_phase_deg": 10.0},
    )

    def lacks(self, conditions: Conditions) -> str | None:
        return None if conditions.span_turns >= 10 else "at least 10 input turns"

    def search(self, probe: Probe) -> Sequence[Term]:
        samples = probe.samples
        highest = min(0.45 * samples.rows_per_turn, probe.order_range[1])
        resolution = 1 / samples.span_turns
        ratios = np.arange(*RATIO_RANGE, min(0.2 * resolution / 20, 0.001))
        grid = np.arange(0.25, highest, 0.25 * resolution)
        power = probe.spectrum(grid) ** 2
        # Orders that other effects own (multiples of 1/N close to whole ones) say nothing for a bearing.
        power[np.abs(grid - np.round(grid)) < max(3 / samples.ratio, 2 * resolution)] = 0.0
        spectrum = _Spectrum(power, grid, samples.ratio, float(len(ratios) * len(BALLS)))
        if not power.max(initial=0.0) > 0 or power.max() < STANDS_OUT * spectrum.usual:
            return []
        terms = self._of_lines(probe, ratios, spectrum)
        unequal = self._unequal_balls(probe, ratios, spectrum)
        return [*(self._closer(probe, term, spectrum.trials) for term in terms), *unequal]

    def _of_lines(self, probe: Probe, ratios: Array, spectrum: _Spectrum) -> list[Term]:
        """The best bearing of each set of lines, where every line shows."""
        slow = [spectrum.at(bearing_orders(ratios, 0, spectrum.ratio)[i]) for i in range(3)]
        best = []
        for balls in BALLS:
            orders = bearing_orders(ratios, int(balls), spectrum.ratio)
            lines = [*slow, *(spectrum.at(orders[i]) for i in PASSES)]
            for variant, members in enumerate(LINES):
                score = sum((lines[i] for i in members), np.zeros(len(ratios)))
                at = int(np.argmax(score))
                best.append((float(score[at]), float(ratios[at]), int(balls), variant))
        chosen: dict[int, tuple[float, float, int, int]] = {}
        for entry in sorted(best, reverse=True):
            chosen.setdefault(entry[3], entry)
        terms = [
            self.term(
                probe.samples,
                {"ball_to_pitch_ratio": r, "balls": balls, "lines": LINES[variant]},
                trials=spectrum.trials,
            )
            for variant, (_, r, balls, _) in chosen.items()
        ]
        return [term for term in best_terms(probe, terms, 4) if self.every_line_shows(probe, term)]

    def _closer(self, probe: Probe, term: Term, trials: float) -> Term:
        """The best of some bearings about `term`."""
        steps = np.linspace(-0.6, 0.6, 7) * (1 / probe.samples.span_turns)
        lever = term.shape["balls"] / 2 if max(term.shape["lines"]) > 2 else 1.0
        ratio = term.shape["ball_to_pitch_ratio"]
        near = [{**term.shape, "ball_to_pitch_ratio": ratio + d} for d in steps / lever]
        return best_terms(probe, [self.term(probe.samples, shape, trials=trials) for shape in near])[0]

    def _unequal_balls(self, probe: Probe, ratios: Array, spectrum: _Spectrum) -> list[Term]:
        """Terms of unequal balls, where the base's zones are there to meet them."""
        if not probe.has_base:
            return []
        trials, samples = spectrum.trials, probe.samples

        def closest(shape: Shape, steps: Sequence[float]) -> Term:
            paid = trials * (len(BALLS) if shape["balls"] else 1)
            ratios = [shape["ball_to_pitch_ratio"] + d / samples.span_turns for d in steps]
            near = [self.term(samples, {**shape, "ball_to_pitch_ratio": r}, trials=paid) for r in ratios]
            return best_terms(probe, near)[0]

        few, pair, many = ZONE_HARMONICS[0], ZONE_HARMONICS[2], ZONE_HARMONICS[5]
        each_alone = [(0, (wave,)) for wave in many if (wave,) != few]

        def first_look(ratio: float) -> list[tuple[float, Shape]]:
            balls = self._likely_balls(ratio, spectrum)[-1]
            return self._ranked_sets(probe, ratio, [(0, few), (0, pair), (0, many), (balls, pair), *each_alone])

        def over_one_wave(sets: list[tuple[float, Shape]]) -> float:
            of_one = next(score for score, shape in sets if len(zone_orders(shape)) == 1)
            return next(score for score, shape in sets if shape["zones"] == many) - of_one

        def from_here(shape: Shape) -> list[Term]:
            best = closest(shape, (-0.4, -0.2, 0.0, 0.2, 0.4)).shape
            likely = self._likely_balls(best["ball_to_pitch_ratio"], spectrum)
            counted = sorted({0, best["balls"], *likely})
            every = [(n, members) for n in counted for members in ZONE_HARMONICS if n not in members]
            sets = [shape for _, shape in self._ranked_sets(probe, best["ball_to_pitch_ratio"], every)]
            # Of many waves some may be missing, and the set is no name; of few that are all there it is one.
            of_few = next(shape for shape in sets if len(zone_orders(shape)) <= FEW_WAVES)
            chosen = sets[:1] if of_few is sets[0] else [sets[0], of_few]
            return [closest(shape, (-0.1, -0.05, 0.0, 0.05, 0.1)) for shape in chosen]

        looks = [first_look(ratio) for ratio in self._likely_ratios(samples.span_turns, ratios, spectrum)]
        sets_to_begin_with = (look for sets in looks for look in sets if look[1]["zones"] in (few, pair, many))
        best = max(sets_to_begin_with, key=itemgetter(0))[1]
        found = from_here(best)
        # One strong line is a wave of some bearing: where many waves stand out at another ratio, that is looked at too.
        of_many = max(looks, key=over_one_wave)
        shape = of_many[0][1]
        apart = abs(shape["ball_to_pitch_ratio"] - best["ball_to_pitch_ratio"]) * samples.span_turns > 1
        return found + from_here(shape) if apart and over_one_wave(of_many) > 0 else found

    def _ranked_sets(
        self, probe: Probe, ball_ratio: float, sets: Sequence[tuple[int, tuple[int, ...]]]
    ) -> list[tuple[float, Shape]]:
        """What each of the `sets` of waves, beside that of so many balls, is worth for the residual of `probe` at one
        `ball_ratio`, with its shape, the best first. All are parts of the columns of every wave among them."""
        shapes: list[Shape] = [{"ball_to_pitch_ratio": ball_ratio, "balls": n, "zones": waves} for n, waves in sets]
        every = sorted({h for shape in shapes for h in zone_orders(shape)})
        wide = self.term(probe.samples, {"ball_to_pitch_ratio": ball_ratio, "balls": 0, "zones": tuple(every)})
        at = {h: (2 * i, 2 * i + 1) for i, h in enumerate(every)}
        parts = [[column for h in zone_orders(shape) for column in at[h]] for shape in shapes]
        gains = probe.gains_of_parts(wide, parts)
        scores = [worth(probe, gain, len(part) + len(wide.steps)) for gain, part in zip(gains, parts, strict=True)]
        return sorted(zip(scores, shapes, strict=True), key=itemgetter(0), reverse=True)

    @staticmethod
    def _likely_ratios(span_turns: float, ratios: Array, spectrum: _Spectrum) -> list[float]:
        """Ratios of ball to pitch at which the waves of the balls' place show most, by three measures."""
        waves = [spectrum.of_wave(h, spectrum.place(ratios)) for h in ZONE_HARMONICS[-1]]
        none = np.zeros(len(ratios))
        # Any strong line is some wave of some bearing: over all waves it counts how many show, not how strongly.
        usual = STANDS_OUT * spectrum.usual
        tops = []
        for weight in (sum(waves[:4], none), waves[1], sum((np.log1p(wave / usual) for wave in waves), none)):
            left = weight.copy()
            for _ in range(2):
                at = int(np.argmax(left))
                tops.append(float(ratios[at]))
                left[np.abs(ratios - ratios[at]) < 1 / span_turns] = 0
        return tops

    @staticmethod
    def _likely_balls(ratio: float, spectrum: _Spectrum) -> list[int]:
        """Numbers of balls whose own wave shows most: all alike in load, unlike in place."""
        half = np.array([float(spectrum.place(ratio))])
        size = [float(spectrum.of_wave(int(n), half)[0]) for n in BALLS]
        return [int(BALLS[i]) for i in np.argsort(size)[-2:]]

    @staticmethod
    def every_line_shows(probe: Probe, term: Term) -> bool:
        """Some two orders fit any pair of peaks for some bearing: each must carry its part of the gain."""
        gain, coefficients = probe.solve(term)
        power = coefficients[0::2] ** 2 + coefficients[1::2] ** 2
        return bool(power.min() * gain / power.sum() > 20.0)

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        """Any line, and any line with its double, is an order of some bearing: named lines must all be there, as must a
        few waves of unequal balls, and of many waves a good part.
        """
        if not RATIO_RANGE[0] <= term.shape["ball_to_pitch_ratio"] <= RATIO_RANGE[1]:
            return False
        size, certain = _waves_that_show(term, estimate)
        if "zones" not in term.shape or len(term.shape["zones"]) <= FEW_WAVES:
            return bool(np.all(certain & (size > LEAST_LINE * size.max())))
        return bool(np.mean(certain) >= MANY_SHOW)

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None, trials: float = 1e4) -> Term:
        steps = {"ball_to_pitch_ratio": 1e-3 / conditions.span_turns}
        if "zones" in shape:
            phase = (1 + shape["ball_to_pitch_ratio"]) * (1 + 1 / conditions.ratio) / 2 * conditions.theta
            zones = zone_harmonics(phase, zone_orders(shape))
            variants = trials / len(BALLS) * len(ZONE_HARMONICS)
            return Term(self.id, dict(shape), zones=zones, steps=steps, trials=variants)
        waves = sine_columns(conditions.theta, self.orders(shape, conditions.ratio))
        return Term(self.id, dict(shape), columns=waves, steps=steps, trials=trials * len(LINES))

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        if "zones" in shape:
            half = (1 + shape["ball_to_pitch_ratio"]) * (1 + 1 / ratio) / 2
            return [h * half if h % 2 == 0 else 1 + h * half for h in zone_orders(shape)]
        orders = bearing_orders(shape["ball_to_pitch_ratio"], shape["balls"], ratio)
        return [float(orders[i]) for i in shape["lines"]]

    @staticmethod
    def _balls_that_show(term: Term, estimate: FitEstimate) -> int | None:
        """The number of balls, all alike in load, whose wave stands out: of a number that was looked for over the usual
        wave, of a wide set of waves the last that stands out over each from half its number on, as waves of unlike
        balls die away; None where none does.
        """
        waves = np.array(zone_orders(term.shape))
        size, certain = _waves_that_show(term, estimate)
        if balls := int(term.shape["balls"]):
            of_balls = waves == balls
            return balls if size[of_balls][0] > COUNTED * np.median(size[~of_balls]) else None
        for at in np.flatnonzero(certain & (waves >= BALLS[0]))[::-1]:
            others = (waves >= waves[at] / 2) & (waves != waves[at])
            if size[at] > COUNTED * size[others].max():
                return int(waves[at])
        return None

    def orders_of_columns(self, term: Term, ratio: float) -> list[float]:
        """In the zones, the orders at which these meet the balls: the zones' own turn is in `orders`."""
        if "zones" not in term.shape:
            return super().orders_of_columns(term, ratio)
        half = (1 + term.shape["ball_to_pitch_ratio"]) * (1 + 1 / ratio) / 2
        return [h * half for h in zone_orders(term.shape)]

    def remark(self, shape: Shape, both_ways: bool) -> str | None:
        return f"{self.id} never repeats: it is met in the relative turn that its phases describe, others differ"

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        lines, unequal = AT_THE_OUTPUT.given(self.id, keys), UNEQUAL.given(self.id, keys)
        AT_THE_OUTPUT.some(self.id, lines | unequal)
        count = number(keys, "balls")
        balls = int(count or 0)
        shape: dict[str, object] = {"ball_to_pitch_ratio": needed(keys, "ball_to_pitch_ratio"), "balls": balls}
        if not lines:
            widest = max(ZONE_HARMONICS, key=len)
            if missing := [h for h in unequal if h not in widest and h != balls]:
                raise HdoptError(
                    f"effects.{self.id}.unequal_{missing[0]}_um: harmonics go from 1 to {len(widest)}, and beyond only "
                    "to that of as many balls; give balls, or leave it out"
                )
            shape["zones"] = smallest_set(ZONE_HARMONICS, [h for h in unequal if h != balls])
            return shape, UNEQUAL.coefficients(unequal, zone_orders(shape))
        if unequal:
            raise HdoptError(
                f"effects.{self.id} has both sines at the output and unequal balls; give those in _arcmin or in _um"
            )
        if count is None and max(lines) in PASSES:
            raise MissingValue(f"effects.{self.id}.{LINE_NAMES[max(lines)]}_arcmin", f"effects.{self.id}.balls")
        shape["lines"] = smallest_set(LINES, lines)
        return shape, AT_THE_OUTPUT.coefficients(lines, smallest_set(LINES, lines))

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        ratio: dict[str, object] = {"ball_to_pitch_ratio": shape["ball_to_pitch_ratio"]}
        if "zones" in shape:
            balls = {"balls": int(shape["balls"])} if shape["balls"] else {}
            return ratio | balls | UNEQUAL.written(zone_orders(shape), coefficients)
        balls = {"balls": int(shape["balls"])} if max(shape["lines"]) in PASSES else {}
        return ratio | balls | AT_THE_OUTPUT.written(shape["lines"], coefficients)

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        found = {"ball_to_pitch_ratio": estimate.parameter(term.width, "1")}
        if "zones" in term.shape:
            found["unequal_um"] = estimate.amplitude(0, 1, "um", scale=1e3)
            if (balls := self._balls_that_show(term, estimate)) is not None:
                found["balls"] = counted(balls)
            return found
        if any(i in PASSES for i in term.shape["lines"]):
            found["balls"] = counted(term.shape["balls"])
        for i, line in enumerate(term.shape["lines"]):
            found[f"{LINE_NAMES[line]}_arcmin"] = estimate.amplitude(2 * i, 2 * i + 1)
        return found

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        balls = f"{parameters['balls'].value:.0f} balls, " if "balls" in parameters else ""
        return (
            f"The wave generator's bearing shows ({balls}ball to pitch diameter "
            f"{parameters['ball_to_pitch_ratio'].value:.4f}): {rms_arcmin:.2g} arcmin rms at cage and ball orders."
        )
