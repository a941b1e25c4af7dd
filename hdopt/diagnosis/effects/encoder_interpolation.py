"""Sub-divisional error of an encoder: a ripple at its lines.

Offsets of the sine and cosine signals make an error of one cycle a line, unequal amplitudes and a wrong phase two
cycles (Heydemann, Applied Optics 20 (1981) 3382). With L lines a turn the orders are L and 2 L of the input (divided
by N), or L/N and 2 L/N of the output encoder, whose phase follows the angle that it reads itself: with thousands of
lines an arcmin of kinematic error or drift moves it by a radian. Units: arcmin at the output; lines a whole number.
Prior: 8 to 20000 lines; fewer than 17 are rare (two to eight poles of a resolver).
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Parameter, Term, best_terms, sine_columns
from hdopt.diagnosis.effects.tooth_mesh import mesh_order

LOWEST_ORDER = 8.0
LOWEST_PAIR = 3.0
"""Lowest order of an output encoder's lines where both L and 2 L show: one line alone could be anything."""
MODULATION_PER_OUTPUT_TURN, SIDEBAND_REACH = 3.5, 12.0
"""Orders that the teeth own: within so many 1/N of a whole sideband, up to so far from the mesh order."""
HARMONICS = {1.0: (1,), 2.0: (1, 2), 3.0: (2,), 4.0: (1, 2, 3, 4)}
"""Cycles a line of each variant; distorted signals (no pure sines) add the third and fourth."""
SEARCHED = (1.0, 2.0, 4.0)
"""Two cycles a line without the first cannot be told from one cycle of twice as many lines."""
SHOWS = 0.01
"""Power over that of its double or triple from which a line is taken for the encoder's own."""
HARMONICS_OF_TEETH = 40
"""Waves round the splines, h and h (1 + 1/N) up to so many, and the mesh order are the teeth's."""
FEW_LINES, FEW_LINES_ODDS = 17, -8.0
"""Below so many lines a turn bolts and teeth are likelier than an encoder; log odds."""


def beside_the_mesh(orders, ratio):
    """Where an order is the tooth mesh or a sideband of it, drawn aside by a few output turns' worth of modulation."""
    near = np.abs(orders - np.round(orders)) < MODULATION_PER_OUTPUT_TURN / ratio
    return near & (np.abs(orders - mesh_order(ratio)) < SIDEBAND_REACH)


def is_of_teeth(order, multiples, ratio, output):
    """Whether an output encoder's line is where a wave round one of the splines shows, or any of its `multiples` at the
    mesh of the teeth.
    """
    waves = (order, order / (1 + 1 / ratio)) if output else ()
    round_a_spline = any(abs(wave - round(wave)) < 1e-6 and round(wave) <= HARMONICS_OF_TEETH for wave in waves)
    return round_a_spline or any(abs(m * order - mesh_order(ratio)) < 1e-6 for m in multiples)


class EncoderInterpolation:
    id = "encoder_interpolation"
    domain = "order"
    needs_base = False
    high_order = True
    leaves_nothing = True
    separating = (
        "record at two thirds of the speed and twice the sampling rate: the ripple stays at the encoder's lines"
    )

    def lacks(self, samples):
        if samples.rows_per_turn < 3 * LOWEST_ORDER:
            return f"more than {3 * LOWEST_ORDER:.0f} samples an input turn"
        if samples.span_turns < 2:
            return f"at least 2 input turns to count lines (there are {samples.span_turns:.1f})"
        return None

    def search(self, probe):
        samples = probe.samples
        highest = min(probe.order_range[1], 0.49 * samples.rows_per_turn)
        # Rows that are no averages hold every cycle up to half their number.
        finest = highest if samples.are_averages else 0.5 * samples.rows_per_turn * (1 + 1e-6)
        found = []
        for output in (0.0, 1.0):
            per = samples.ratio if output else 1.0
            lowest = max(probe.order_range[0], LOWEST_PAIR if output else LOWEST_ORDER)
            lines = np.arange(np.ceil(lowest * per), np.floor(highest * per) + 1)
            if output:
                if samples.span_turns < 0.5 * samples.ratio:
                    continue
                lines = lines[~beside_the_mesh(lines / per, samples.ratio)]
            if not len(lines):
                continue
            power = probe.spectrum(lines / per, bool(output)) ** 2
            second = probe.spectrum(np.minimum(2 * lines / per, highest), bool(output)) ** 2
            double = np.where(2 * lines / per < highest, second, 0.0)
            strongest = {float(lines[i]) for score in (power, power + double) for i in np.argsort(score)[-2:]}
            # The strongest line may be the second or third cycle of the encoder's own, which then shows too.
            seen = dict(zip(lines, power, strict=True))
            strongest |= {
                line // k for line in strongest for k in (2, 3) if seen.get(line / k, 0.0) > SHOWS * seen[line]
            }
            found += [
                self.term(
                    samples, {"lines": line, "output": output, "harmonics": harmonics}, trials=float(len(lines))
                )
                for line in sorted(strongest)
                for harmonics in SEARCHED
                if HARMONICS[harmonics][-1] * line <= finest * per
                and (line >= LOWEST_ORDER * per or HARMONICS[harmonics][:2] == (1, 2))
            ]
        return best_terms(probe, found, 2) if found else []

    def term(self, samples, shape, base_value=None, trials=1000.0):
        angle = samples.output if shape["output"] else samples.theta
        multiples = HARMONICS[shape["harmonics"]]
        columns = sine_columns(angle, [m * shape["lines"] for m in multiples])
        odds = FEW_LINES_ODDS if shape["lines"] < FEW_LINES else 0.0
        order = shape["lines"] / (samples.ratio if shape["output"] else 1.0)
        doubtful = is_of_teeth(order, multiples, samples.ratio, bool(shape["output"]))
        return Term(self.id, dict(shape), columns=columns, trials=trials, odds=odds, doubtful=doubtful)

    def orders(self, term, ratio):
        order = term.shape["lines"] / (ratio if term.shape["output"] else 1.0)
        return [m * order for m in HARMONICS[term.shape["harmonics"]]]

    def parameters(self, term, estimate):
        lines = term.shape["lines"]
        return {
            "lines": Parameter(lines, lines, lines, "1"),
            "amplitude_arcmin": estimate.amplitude(0, 1),
            "phase_deg": estimate.phase_deg(0, 1),
            "on_output_shaft": Parameter(term.shape["output"], term.shape["output"], term.shape["output"], "1"),
        }

    def sentence(self, parameters, rms_arcmin):
        shaft = "output" if parameters["on_output_shaft"].value else "input"
        return (
            f"The {shaft} encoder interpolates unevenly between its {parameters['lines'].value:.0f} lines: "
            f"{parameters['amplitude_arcmin'].value:.2g} arcmin at the output."
        )
