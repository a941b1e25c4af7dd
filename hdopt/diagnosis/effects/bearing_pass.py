"""Ball passes of the wave generator's bearing: orders that are no multiples of 1/N.

Kinematics of a ball bearing without slip (Harris, "Rolling Bearing Analysis", ch. on ball speeds), inner ring on the
wave generator, outer ring on the flexspline, which turns at -1/N; r = ball over pitch diameter, n balls: cage f_c =
(1 - r)/2 - (1 + r)/(2 N); one odd ball 1 - f_c relative to the load zone, (1 + r)(1 + 1/N)/2, and twice that (two
zones); outer-race pass (n/2)(1 - r)(1 + 1/N); inner-race pass (n/2)(1 + r)(1 + 1/N). Units: arcmin; prior r 0.04 to
0.35, n 7 to 40.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Parameter, Term, best_terms, sine_columns, widest_that_pays
from hdopt.diagnosis.effects._zone_harmonics import zone_harmonics

BALLS = np.arange(7, 41)
RATIO_RANGE = (0.04, 0.35)


def bearing_orders(ball_ratio, balls, gear_ratio):
    """Cage, odd ball once and twice, outer pass, inner pass: orders in cycles per input turn, shape (5, ...)."""
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


ZONE_HARMONICS = ((2,), (2, 4), (1, 2), *(tuple(range(1, k + 1)) for k in (4, 6, 10, 16, 28)))
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

LINES = ((0, 1, 2, 3, 4), (0, 3), (0, 2), (0, 1, 2), (3, 4), (0, 3, 4), (0, 2, 3), (1, 2), (2, 3), (1, 2, 3))
"""Which of the five orders a variant shows."""


def zone_orders(shape) -> tuple[int, ...]:
    """Harmonics of the balls' place under the lobes that a zone variant holds: its set, and n where n is counted."""
    members, balls = ZONE_HARMONICS[int(shape["zones"])], int(shape["balls"])
    return (*members, balls) if balls and balls not in members else members


class BearingPass:
    id = "bearing_pass"
    domain = "order"
    needs_base = False
    excites = True
    separating = (
        "record ten output turns, or with the bearing turned by one ball pitch: its orders drift against the teeth"
    )

    def lacks(self, samples):
        return None if samples.span_turns >= 10 else "at least 10 input turns"

    def search(self, probe):
        samples = probe.samples
        highest = min(0.45 * samples.rows_per_turn, probe.order_range[1])
        resolution = 1 / samples.span_turns
        ratios = np.arange(*RATIO_RANGE, min(0.2 * resolution / 20, 0.001))
        grid = np.arange(0.25, highest, 0.25 * resolution)
        power = probe.spectrum(grid) ** 2
        # Orders that other effects own (multiples of 1/N close to whole ones) say nothing for a bearing.
        power[np.abs(grid - np.round(grid)) < max(3 / samples.ratio, 2 * resolution)] = 0.0
        seen = power[power > 0]
        if not len(seen) or seen.max() < STANDS_OUT * np.median(seen):
            return []
        slow = [self._power(power, grid, bearing_orders(ratios, 0, samples.ratio)[i], samples) for i in range(3)]
        best = []
        for balls in BALLS:
            orders = bearing_orders(ratios, balls, samples.ratio)
            lines = [*slow, self._power(power, grid, orders[3], samples), self._power(power, grid, orders[4], samples)]
            for variant, members in enumerate(LINES):
                score = sum(lines[i] for i in members)
                at = int(np.argmax(score))
                best.append((score[at] / 1.0, float(ratios[at]), int(balls), variant))
        chosen = {}
        for entry in sorted(best, reverse=True):
            chosen.setdefault(entry[3], entry)
        trials = float(len(ratios) * len(BALLS))
        terms = best_terms(
            probe,
            [
                self.term(
                    samples, {"ball_to_pitch_ratio": r, "balls": float(balls), "lines": float(variant)}, trials=trials
                )
                for variant, (_, r, balls, _) in chosen.items()
            ],
            4,
        )
        terms = [term for term in terms if self.every_line_shows(probe, term)]
        unequal = self._unequal_balls(probe, ratios, power, grid, trials)
        steps = np.linspace(-0.6, 0.6, 7) * resolution
        found = [
            best_terms(
                probe,
                [
                    self.term(
                        samples,
                        {**term.shape, "ball_to_pitch_ratio": term.shape["ball_to_pitch_ratio"] + d},
                        trials=trials,
                    )
                    for d in steps / (term.shape["balls"] / 2 if max(LINES[int(term.shape["lines"])]) > 2 else 1.0)
                ],
            )[0]
            for term in terms
        ]
        return [*found, *unequal]

    def _unequal_balls(self, probe, ratios, power, grid, trials):
        """Terms of unequal balls, where the base's zones are there to meet them."""
        if probe.fit.problem.base is None:
            return []
        half = (1 + ratios) * (1 + 1 / probe.samples.ratio) / 2
        waves = [self._wave(power, grid, h, half) for h in ZONE_HARMONICS[-1]]
        tops = []
        # Any strong line is some wave of some bearing: over all waves it counts how many show, not how strongly.
        usual = STANDS_OUT * float(np.median(power[power > 0]))
        for weight in (sum(waves[:4]), waves[1], sum(np.log1p(wave / usual) for wave in waves)):
            weight = weight.copy()
            for _ in range(2):
                at = int(np.argmax(weight))
                tops.append(float(ratios[at]))
                weight[np.abs(ratios - ratios[at]) < 1 / probe.samples.span_turns] = 0

        def best_of(shapes):
            shapes = list(shapes)
            counts = [trials * (len(BALLS) if shape["balls"] else 1) for shape in shapes]
            terms = [self.term(probe.samples, s, trials=n) for s, n in zip(shapes, counts, strict=True)]
            return best_terms(probe, terms)[0].shape

        def likely_balls(ratio):
            """Numbers of balls whose own wave shows most: all alike in load, unlike in place."""
            half = (1 + ratio) * (1 + 1 / probe.samples.ratio) / 2
            size = [float(self._wave(power, grid, int(n), np.array([half]))[0]) for n in BALLS]
            return [float(BALLS[i]) for i in np.argsort(size)[-2:]]

        best = best_of(
            {"ball_to_pitch_ratio": r, "balls": n, "zones": v}
            for r in tops
            for n, v in ((0.0, 0.0), (0.0, 2.0), (0.0, 5.0), (likely_balls(r)[-1], 2.0))
        )
        best = best_of(
            {**best, "ball_to_pitch_ratio": best["ball_to_pitch_ratio"] + d / probe.samples.span_turns}
            for d in (-0.4, -0.2, 0.0, 0.2, 0.4)
        )
        sets = [{**best, "zones": float(v)} for v in range(len(ZONE_HARMONICS))]
        best = widest_that_pays(probe, [self.term(probe.samples, s, trials=trials) for s in sets])[0].shape
        best = best_of({**best, "balls": n} for n in {0.0, best["balls"], *likely_balls(best["ball_to_pitch_ratio"])})
        trials *= len(BALLS) if best["balls"] else 1
        fine = [
            {**best, "ball_to_pitch_ratio": best["ball_to_pitch_ratio"] + d / probe.samples.span_turns}
            for d in (-0.1, -0.05, 0.0, 0.05, 0.1)
        ]
        return best_terms(probe, [self.term(probe.samples, s, trials=trials) for s in fine])

    @staticmethod
    def every_line_shows(probe, term):
        """Some two orders fit any pair of peaks for some bearing: each must carry its part of the gain."""
        gain, coefficients = probe.solve(term)
        power = coefficients[0::2] ** 2 + coefficients[1::2] ** 2
        return bool(power.min() * gain / power.sum() > 20.0)

    @staticmethod
    def every_part_shows(term, estimate):
        """Any line, and any line with its double, is an order of some bearing: named lines must all be there, as must a
        few waves of unequal balls, and of many waves a good part.
        """
        if not RATIO_RANGE[0] <= term.shape["ball_to_pitch_ratio"] <= RATIO_RANGE[1]:
            return False
        sines = 2 * (term.width // 2)
        size = np.hypot(estimate.values[0:sines:2], estimate.values[1:sines:2])
        variance = np.diag(estimate.covariance)[:sines]
        certain = size > LINE_SHOWS * np.sqrt(0.5 * (variance[0::2] + variance[1::2]))
        if "zones" not in term.shape or len(ZONE_HARMONICS[int(term.shape["zones"])]) <= FEW_WAVES:
            return bool(np.all(certain & (size > LEAST_LINE * size.max())))
        return bool(np.mean(certain) >= MANY_SHOW)

    @staticmethod
    def _power(power, grid, orders, samples):
        return np.interp(orders, grid, power, left=0.0, right=0.0)

    def _wave(self, power, grid, harmonic, half):
        """Power at the orders of one wave of the balls' place: direct if even, through the change of zone if odd."""
        orders = [harmonic * half] if harmonic % 2 == 0 else [1 + harmonic * half, np.abs(harmonic * half - 1)]
        return sum(np.interp(order, grid, power, left=0.0, right=0.0) for order in orders)

    def term(self, samples, shape, base_value=None, trials=1e4):
        if "zones" in shape:
            phase = (1 + shape["ball_to_pitch_ratio"]) * (1 + 1 / samples.ratio) / 2 * samples.theta
            return Term(
                self.id,
                dict(shape),
                zones=zone_harmonics(phase, zone_orders(shape)),
                steps={"ball_to_pitch_ratio": 1e-3 / samples.span_turns},
                trials=trials / len(BALLS) * len(ZONE_HARMONICS),
            )
        orders = bearing_orders(shape["ball_to_pitch_ratio"], shape["balls"], samples.ratio)
        orders = orders[list(LINES[int(shape["lines"])])]
        return Term(
            self.id,
            dict(shape),
            columns=sine_columns(samples.theta, orders),
            steps={"ball_to_pitch_ratio": 1e-3 / samples.span_turns},
            trials=trials * len(LINES),
        )

    def orders(self, term, ratio):
        if "zones" in term.shape:
            half = (1 + term.shape["ball_to_pitch_ratio"]) * (1 + 1 / ratio) / 2
            return [o for h in zone_orders(term.shape) for o in ([h * half] if h % 2 == 0 else [1 + h * half])]
        orders = bearing_orders(term.shape["ball_to_pitch_ratio"], term.shape["balls"], ratio)
        return [float(orders[i]) for i in LINES[int(term.shape["lines"])]]

    def parameters(self, term, estimate):
        if "zones" in term.shape:
            found = {
                "ball_to_pitch_ratio": estimate.parameter(term.width, "1"),
                "unequal_um": estimate.amplitude(0, 1, "um", scale=1e3),
            }
            size = np.hypot(estimate.values[0 : term.width : 2], estimate.values[1 : term.width : 2])
            if term.shape["balls"] and size[-1] > COUNTED * np.median(size[:-1]):
                found["balls"] = Parameter(term.shape["balls"], term.shape["balls"], term.shape["balls"], "1")
            return found
        n = term.shape["balls"]
        found = {"ball_to_pitch_ratio": estimate.parameter(term.width, "1")}
        if any(i >= 3 for i in LINES[int(term.shape["lines"])]):
            found["balls"] = Parameter(n, n, n, "1")
        names = ("cage", "odd_ball_half", "odd_ball", "outer_pass", "inner_pass")
        for i, line in enumerate(LINES[int(term.shape["lines"])]):
            found[f"{names[line]}_arcmin"] = estimate.amplitude(2 * i, 2 * i + 1)
        return found

    def sentence(self, parameters, rms_arcmin):
        balls = f"{parameters['balls'].value:.0f} balls, " if "balls" in parameters else ""
        return (
            f"The wave generator's bearing shows ({balls}ball to pitch diameter "
            f"{parameters['ball_to_pitch_ratio'].value:.4f}): {rms_arcmin:.2g} arcmin rms at cage and ball orders."
        )
