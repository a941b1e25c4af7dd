"""Sub-divisional error of an encoder: a ripple at its lines.

Offsets of the sine and cosine signals make an error of one cycle a line, unequal amplitudes and a wrong phase two
cycles (Heydemann, Applied Optics 20 (1981) 3382). With L lines a turn the orders are L and 2 L of the input (divided
by N), or L/N and 2 L/N of the output encoder. Units: arcmin at the output; lines a whole number. Prior: 8 to 20000
lines.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Parameter, Term, best_terms, sine_columns

LOWEST_ORDER = 8.0


class EncoderInterpolation:
    id = "encoder_interpolation"
    domain = "order"
    needs_base = False
    high_order = True
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
        lowest, highest = probe.order_range
        lowest, highest = max(lowest, LOWEST_ORDER), min(highest, 0.49 * samples.rows_per_turn)
        found = []
        for output in (0.0, 1.0):
            per = samples.ratio if output else 1.0
            lines = np.arange(np.ceil(lowest * per), np.floor(highest * per) + 1)
            if output:
                if samples.span_turns < 0.5 * samples.ratio:
                    continue
                # Orders that whole input turns share belong to the input side.
                lines = lines[np.abs(lines / per - np.round(lines / per)) > 1e-9]
            if not len(lines):
                continue
            power = probe.spectrum(lines / per) ** 2
            double = np.where(2 * lines / per < highest, probe.spectrum(np.minimum(2 * lines / per, highest)) ** 2, 0.0)
            for score in (power, power + double):
                for best in np.argsort(score)[-2:]:
                    for harmonics in (1.0, 2.0, 3.0):
                        found.append(
                            self.term(
                                samples,
                                {"lines": float(lines[best]), "output": output, "harmonics": harmonics},
                                trials=float(len(lines)),
                            )
                        )
        return best_terms(probe, found, 2) if found else []

    def term(self, samples, shape, base_value=None, trials=1000.0):
        order = shape["lines"] / (samples.ratio if shape["output"] else 1.0)
        multiples = {1.0: (1,), 2.0: (1, 2), 3.0: (2,)}[shape["harmonics"]]
        columns = sine_columns(samples.theta, [m * order for m in multiples])
        return Term(self.id, dict(shape), columns=columns, trials=trials)

    def orders(self, term, ratio):
        order = term.shape["lines"] / (ratio if term.shape["output"] else 1.0)
        return [m * order for m in {1.0: (1,), 2.0: (1, 2), 3.0: (2,)}[term.shape["harmonics"]]]

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
