"""Ball passes of the wave generator's bearing: orders that are no multiples of 1/N.

Kinematics of a ball bearing without slip (Harris, "Rolling Bearing Analysis", ch. on ball speeds), inner ring on the
wave generator, outer ring on the flexspline, which turns at -1/N; r = ball over pitch diameter, n balls: cage f_c =
(1 - r)/2 - (1 + r)/(2 N); one odd ball 1 - f_c relative to the load zone, (1 + r)(1 + 1/N)/2, and twice that (two
zones); outer-race pass (n/2)(1 - r)(1 + 1/N); inner-race pass (n/2)(1 + r)(1 + 1/N). Units: arcmin; prior r 0.04 to
0.35, n 7 to 40.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms, sine_columns

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


LINES = ((0, 1, 2, 3, 4), (0, 3), (0, 2), (0, 1, 2), (3, 4), (0, 3, 4), (0, 2, 3), (1, 2), (2, 3), (1, 2, 3))
"""Which of the five orders a variant shows."""


class BearingPass:
    id = "bearing_pass"
    domain = "order"
    needs_base = False
    separating = (
        "record ten output turns, or with the bearing turned by one ball pitch: its orders drift against the teeth"
    )

    def lacks(self, samples):
        return None if samples.span_turns >= 10 else "at least 10 input turns"

    def search(self, probe):
        samples = probe.samples
        highest = 0.45 * min(samples.rows_per_turn, 128.0)
        resolution = 1 / samples.span_turns
        ratios = np.arange(*RATIO_RANGE, min(0.2 * resolution / 20, 0.001))
        grid = np.arange(0.25, highest, 0.25 * resolution)
        power = probe.spectrum(grid) ** 2
        # Orders that other effects own (multiples of 1/N close to whole ones) say nothing for a bearing.
        power[np.abs(grid - np.round(grid)) < max(3 / samples.ratio, 2 * resolution)] = 0.0
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
        steps = np.linspace(-0.6, 0.6, 7) * resolution
        return [
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

    @staticmethod
    def every_line_shows(probe, term):
        """Some two orders fit any pair of peaks for some bearing: each must carry its part of the gain."""
        gain, coefficients = probe.solve(term)
        power = coefficients[0::2] ** 2 + coefficients[1::2] ** 2
        return bool(power.min() * gain / power.sum() > 20.0)

    @staticmethod
    def _power(power, grid, orders, samples):
        return np.interp(orders, grid, power, left=0.0, right=0.0)

    def term(self, samples, shape, base_value=None, trials=1e4):
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
        orders = bearing_orders(term.shape["ball_to_pitch_ratio"], term.shape["balls"], ratio)
        return [float(orders[i]) for i in LINES[int(term.shape["lines"])]]

    def parameters(self, term, estimate):
        from hdopt.diagnosis.effect import Parameter

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
