"""One damaged tooth: a pulse each time a meshing zone passes it.

A tooth of the circular spline stands still: zone 1 passes it at one input angle, zone 2 half a turn later. A tooth of
the flexspline turns with the output, against the wave generator: it is passed at one value of theta (1 + 1/N), the FS
advance of Jia 2021, Eqs. (31a), (31b). The pulse adds to the deviation of the zone that meets it; seen at the output
it may also appear once an output turn (a defect of what turns with the output). Where so many teeth share the load that
the pulse reaches the output whichever zone drives, it adds once or twice a turn. Its shape is taken as a Gaussian over
the angle of contact. Units: um of arc (or arcmin), angle deg, width deg of wave-generator travel (standard deviation).
Prior: width 0.5 to 14 deg; seen once an output turn also up to 6 deg of output, three teeth.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.diagnosis.effect import Parameter, Term, best_terms
from hdopt.recording import TURN

WIDTHS_DEG = (1.2, 2.5, 5.0, 10.0)
NARROWEST_DEG, WIDEST_DEG = 0.5, 14.0
WIDEST_OUTPUT_DEG = 6.0
COORDINATES = ("cs", "fs", "cs_once", "fs_once", "output", "cs_twice", "fs_twice")
"""CS or FS tooth met by the driving zone; seen once a turn whichever zone drives; fixed output angle; seen by both
zones, each with its own height.
"""


class LocalToothDefect:
    id = "local_tooth_defect"
    domain = "angle"
    needs_base = False
    excites = True
    separating = (
        "turn the circular spline by some teeth, and the flexspline against the output: the pulse moves with its part"
    )

    def lacks(self, samples):
        if samples.rows_per_turn < 40:
            return "at least 40 samples an input turn"
        return None if samples.span_turns >= 3 else "at least 3 input turns"

    def search(self, probe):
        samples = probe.samples
        found = []
        for index, name in enumerate(COORDINATES):
            if name in ("cs", "fs") and probe.fit.problem.base is None:
                continue
            if name == "output" and samples.span_turns < 0.1 * samples.ratio:
                continue
            coordinate, period = self.coordinate(samples, name)
            centres = self._candidates(probe, coordinate, period, name)
            terms = [
                self.term(samples, {"centre": c, "width_deg": w, "on": float(index)})
                for c, w in centres
                if self.meetings(coordinate, period, c) > 1
            ]
            if terms:
                found += best_terms(probe, terms)
        return best_terms(probe, found, 2)

    @staticmethod
    def coordinate(samples, name):
        """The angle at which the pulse is fixed, in rad of wave-generator travel, and its period."""
        if name.startswith("fs"):
            return samples.theta * (1 + 1 / samples.ratio), TURN
        if name == "output":
            return samples.theta, TURN * samples.ratio
        return samples.theta, TURN

    @staticmethod
    def meetings(coordinate, period, centre):
        """How often the recording comes past `centre`: a pulse seen once is an event, not a tooth."""
        side = np.floor((coordinate - centre) / period)
        return int(np.count_nonzero(np.diff(side)))

    def _candidates(self, probe, coordinate, period, name):
        """Centres and widths where the folded residual has the strongest pulses."""
        widths = WIDTHS_DEG
        if name == "output":
            widths = (*WIDTHS_DEG, *(WIDEST_OUTPUT_DEG * probe.samples.ratio * np.array([0.05, 0.1, 0.2, 0.4, 0.8])))
        if name.endswith("twice"):
            period = period / 2
        bins = round(128 * period / TURN)
        cell = (np.mod(coordinate, period) / period * bins).astype(int) % bins
        count = np.bincount(cell, minlength=bins).astype(float)
        folded = np.bincount(cell, probe.residual, bins)
        best = []
        for width in widths:
            sigma = math.radians(width) / period * bins
            reach = int(4 * sigma) + 2
            kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
            if 2 * reach + 1 > bins:
                continue
            wrapped = np.r_[folded[-reach:], folded, folded[:reach]]
            weight = np.r_[count[-reach:], count, count[:reach]]
            score = np.convolve(wrapped, kernel, "valid")
            norm = np.sqrt(np.convolve(weight, kernel**2, "valid")) + 1e-9
            score = np.abs(score / norm)
            for at in np.argsort(score)[-2:]:
                best.append(((at + 0.5) * period / bins, width))
        return best

    def term(self, samples, shape, base_value=None):
        name = COORDINATES[int(shape["on"])]
        coordinate, period = self.coordinate(samples, name)
        widest = WIDEST_OUTPUT_DEG * samples.ratio if name == "output" else WIDEST_DEG
        shape = {**shape, "width_deg": min(max(shape["width_deg"], NARROWEST_DEG), widest)}
        sigma = math.radians(shape["width_deg"])

        def pulse(shift):
            off = np.mod(coordinate - shape["centre"] - shift + period / 2, period) - period / 2
            return np.exp(-0.5 * (off / sigma) ** 2)

        steps = {"centre": 0.05 * sigma, "width_deg": 0.05 * shape["width_deg"]}
        trials = 60.0 * period / TURN
        if name in ("cs", "fs"):
            zones = np.stack([pulse(0.0), pulse(math.pi)])[:, :, None]
            return Term(self.id, dict(shape), zones=zones, steps=steps, trials=trials)
        pulses = [pulse(0.0), pulse(math.pi)] if name.endswith("twice") else [pulse(0.0)]
        return Term(self.id, dict(shape), columns=np.column_stack(pulses), steps=steps, trials=trials)

    def parameters(self, term, estimate):
        name = COORDINATES[int(term.shape["on"])]
        found = {
            "angle_deg": estimate.parameter(term.width, "deg", scale=math.degrees(1)),
            "width_deg": estimate.parameter(term.width + 1, "deg"),
        }
        in_zone = name in ("cs", "fs")
        found["height_um" if in_zone else "height_arcmin"] = (
            estimate.parameter(0, "um", scale=1e3) if in_zone else estimate.parameter(0, "arcmin")
        )
        if name.endswith("twice"):
            found["height_half_a_turn_on_arcmin"] = estimate.parameter(1, "arcmin")
        code = {"c": 1.0, "f": 2.0, "o": 3.0}[name[0]]
        found["spline_code"] = Parameter(code, code, code, "1")
        return found

    def sentence(self, parameters, rms_arcmin):
        spline = {1.0: "circular spline", 2.0: "flexspline", 3.0: "flexspline (output side)"}
        part = spline[parameters["spline_code"].value]
        return (
            f"A local defect on the {part} at {parameters['angle_deg'].value % 360:.1f} deg makes a pulse "
            f"{parameters['width_deg'].value:.2g} deg wide each time it is met."
        )
