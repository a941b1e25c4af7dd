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
from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects.base import Effect, Keys
from hdopt.effects.conditions import TURN, Conditions
from hdopt.effects.declared import UM, Category, Quantity, needed, number
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.met import Pulse, Spline, gaussian, off_centre
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Shape, Term
from hdopt.errors import HdoptError

WIDTHS_DEG = (1.2, 2.5, 5.0, 10.0)
NARROWEST_DEG, WIDEST_DEG = 0.5, 14.0
WIDEST_OUTPUT_DEG = 6.0
WIDEST_PRIOR_DEG = 160 * WIDEST_OUTPUT_DEG
"""That of the output at the largest usual ratio, as wave-generator travel."""


class Seat(StrEnum):
    """Where the damaged tooth sits: met by the zone that drives; seen once a turn whichever drives; at one output
    angle; or seen by both zones, each with its own height.
    """

    CIRCULAR_SPLINE = "circular_spline"
    FLEXSPLINE = "flexspline"
    CIRCULAR_SPLINE_ONCE = "circular_spline_once"
    FLEXSPLINE_ONCE = "flexspline_once"
    OUTPUT = "output"
    CIRCULAR_SPLINE_TWICE = "circular_spline_twice"
    FLEXSPLINE_TWICE = "flexspline_twice"

    @property
    def in_zones(self) -> bool:
        """Whether the driving zone meets it."""
        return self in (Seat.CIRCULAR_SPLINE, Seat.FLEXSPLINE)

    @property
    def spline(self) -> Spline:
        """The spline of a tooth that the driving zone meets."""
        return Spline.FLEX if self.value.startswith("flexspline") else Spline.CIRCULAR

    @property
    def twice(self) -> bool:
        """Whether it is seen twice a turn."""
        return self in (Seat.CIRCULAR_SPLINE_TWICE, Seat.FLEXSPLINE_TWICE)

    @property
    def part(self) -> str:
        """The part that has the tooth."""
        if self is Seat.OUTPUT:
            return "flexspline (output side)"
        return "flexspline" if self.value.startswith("flexspline") else "circular spline"


class LocalToothDefect(Effect):
    id = "local_tooth_defect"
    place = 150
    domain = "angle"
    sudden = True
    excites = True
    same_each_time = True
    needs_strain_wave = True
    acts = "zones, or beside"
    separating = (
        "turn the circular spline by some teeth, and the flexspline against the output: the pulse moves with its part"
    )
    declared = (
        Category("on", Seat, "where the tooth sits; `_once`, `_twice` a turn whichever zone drives"),
        Quantity("angle_deg", "deg", "centre of the pulse, of wave-generator travel", "θ_0"),
        Quantity(
            "width_deg",
            "deg",
            "its standard deviation",
            "σ",
            (NARROWEST_DEG, WIDEST_PRIOR_DEG),
            at_least=NARROWEST_DEG,
        ),
        Quantity("height_um", "um", "of arc, on a tooth that the driving zone meets", "h", (-30.0, 30.0), None),
        Quantity("height_arcmin", "arcmin", "at the output, of the others", "h", (-5.0, 5.0), None),
        Quantity("height_2_arcmin", "arcmin", "half a turn on, of one seen twice", "h_2", (-5.0, 5.0), None),
    )
    examples = (
        {"on": "flexspline", "angle_deg": 115.0, "width_deg": 5.0, "height_um": 4.0},
        {"on": "output", "angle_deg": 2000.0, "width_deg": 5.0, "height_arcmin": 0.3},
        {
            "on": "circular_spline_twice",
            "angle_deg": 100.0,
            "width_deg": 3.0,
            "height_arcmin": 0.2,
            "height_2_arcmin": 0.1,
        },
    )

    def lacks(self, conditions: Conditions) -> str | None:
        if conditions.rows_per_turn < 40:
            return "at least 40 samples an input turn"
        return None if conditions.span_turns >= 3 else "at least 3 input turns"

    def search(self, probe: Probe) -> Sequence[Term]:
        samples = probe.samples
        found = []
        for seat in Seat:
            if seat.in_zones and not probe.has_base:
                continue
            if seat is Seat.OUTPUT and samples.span_turns < 0.1 * samples.ratio:
                continue
            coordinate, period = self.coordinate(samples, seat)
            terms = [
                self.term(samples, {"centre": c, "width_deg": w, "on": seat})
                for c, w in self._candidates(probe, coordinate, period, seat)
                if self.meetings(coordinate, period, c) > 1
            ]
            if terms:
                found += best_terms(probe, terms)
        return best_terms(probe, found, 2)

    @staticmethod
    def coordinate(conditions: Conditions, seat: Seat) -> tuple[Array, float]:
        """The angle at which the pulse is fixed, in rad of wave-generator travel, (n,), and its period."""
        if seat.value.startswith("flexspline"):
            return conditions.theta * (1 + 1 / conditions.ratio), TURN
        if seat is Seat.OUTPUT:
            return conditions.theta, TURN * conditions.ratio
        return conditions.theta, TURN

    @staticmethod
    def meetings(coordinate: Array, period: float, centre: float) -> int:
        """How often the recording comes past `centre`: a pulse seen once is an event, not a tooth."""
        side = np.floor((coordinate - centre) / period)
        return int(np.count_nonzero(np.diff(side)))

    def _candidates(self, probe: Probe, coordinate: Array, period: float, seat: Seat) -> list[tuple[float, float]]:
        """Centres and widths where the folded residual has the strongest pulses."""
        widths: tuple[float, ...] = WIDTHS_DEG
        if seat is Seat.OUTPUT:
            widths = (*WIDTHS_DEG, *(WIDEST_OUTPUT_DEG * probe.samples.ratio * np.array([0.05, 0.1, 0.2, 0.4, 0.8])))
        if seat.twice:
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
            best += [((at + 0.5) * period / bins, width) for at in np.argsort(score)[-2:]]
        return best

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        seat: Seat = shape["on"]
        coordinate, period = self.coordinate(conditions, seat)
        widest = WIDEST_OUTPUT_DEG * conditions.ratio if seat is Seat.OUTPUT else WIDEST_DEG
        kept = {**shape, "width_deg": min(max(shape["width_deg"], NARROWEST_DEG), widest)}
        sigma = math.radians(kept["width_deg"])

        row = TURN / conditions.rows_per_turn if conditions.are_averages else 0.0

        def pulse(shift: float) -> Array:
            return gaussian(off_centre(coordinate, kept["centre"] + shift, period), sigma, row)

        steps = {"centre": 0.05 * sigma, "width_deg": 0.05 * kept["width_deg"]}
        trials = 60.0 * period / TURN
        if seat.in_zones:
            return Term(self.id, kept, met=Pulse(seat.spline, kept["centre"], sigma, row), steps=steps, trials=trials)
        pulses = [pulse(0.0), pulse(math.pi)] if seat.twice else [pulse(0.0)]
        return Term(self.id, kept, columns=np.column_stack(pulses), steps=steps, trials=trials)

    def in_zones(self, shape: Shape) -> Sequence[Shape]:
        seat: Seat = shape["on"]
        if seat.in_zones or seat is Seat.OUTPUT:
            return ()
        on = Seat.FLEXSPLINE if seat.spline is Spline.FLEX else Seat.CIRCULAR_SPLINE
        return ({**shape, "on": on},)

    def highest_order(self, shape: Shape, ratio: float) -> float:
        """A Gaussian of this standard deviation rises within a quarter of a period."""
        return float(360 / shape["width_deg"] / 4)

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        seat, width = Seat(str(keys["on"])), needed(keys, "width_deg")
        widest = WIDEST_OUTPUT_DEG * gear.ratio if seat is Seat.OUTPUT else WIDEST_DEG
        if width > widest:
            raise HdoptError(
                f"effects.{self.id}.width_deg is {width:g}; a defect on {seat.value!r} is at most {widest:g} deg "
                "of wave-generator travel wide"
            )
        second = number(keys, "height_2_arcmin")
        if seat.twice != (second is not None):
            wants = "needs height_2_arcmin, half a turn on" if seat.twice else "has no height_2_arcmin"
            raise HdoptError(f"effects.{self.id}: a defect on {seat.value!r} {wants}")
        key, other = ("height_um", "height_arcmin") if seat.in_zones else ("height_arcmin", "height_um")
        height = number(keys, key)
        if height is None or number(keys, other) is not None:
            raise HdoptError(f"effects.{self.id}: a defect on {seat.value!r} has {key}, not {other}; give {key} alone")
        shape = {"centre": math.radians(needed(keys, "angle_deg")), "width_deg": width, "on": seat}
        if seat.in_zones:
            return shape, (UM * height,)
        return shape, (height,) if second is None else (height, second)

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        seat: Seat = shape["on"]
        height = coefficients[0]
        size = {"height_um": height / UM} if seat.in_zones else {"height_arcmin": height}
        if seat.twice:
            size["height_2_arcmin"] = coefficients[1]
        angle = math.degrees(shape["centre"])
        return {"on": seat.value, "angle_deg": angle, "width_deg": shape["width_deg"], **size}

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        seat: Seat = term.shape["on"]
        found = {
            "angle_deg": estimate.parameter(term.width, "deg", scale=math.degrees(1)),
            "width_deg": estimate.parameter(term.width + 1, "deg"),
        }
        if seat.in_zones:
            found["height_um"] = estimate.parameter(0, "um", scale=1e3)
        else:
            found["height_arcmin"] = estimate.parameter(0, "arcmin")
        if seat.twice:
            found["height_half_a_turn_on_arcmin"] = estimate.parameter(1, "arcmin")
        return found

    def as_seen(
        self, parameters: dict[str, Parameter], term: Term, conditions: Conditions, contribution: Array
    ) -> dict[str, Parameter]:
        """Of a tooth that the driving zone meets the angle at which more of its pulse shows: in the fit zone 1 meets it
        at its angle, and zone 2 half a turn on."""
        if not term.shape["on"].in_zones:
            return parameters
        coordinate, period = self.coordinate(conditions, term.shape["on"])
        off = off_centre(coordinate, term.shape["centre"], period)
        near = np.abs(off) < period / 4
        if np.sum(contribution[near] ** 2) >= np.sum(contribution[~near] ** 2):
            return parameters
        one = parameters["angle_deg"]
        way = 180.0 if one.value < 180 else -180.0
        there = replace(one, value=one.value + way, low=one.low + way, high=one.high + way)
        return {**parameters, "angle_deg": there}

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        angle = parameters["angle_deg"].value
        if shape["on"] is Seat.OUTPUT:  # met once in N turns of the wave generator, at one of their angles
            where = f"{angle:.1f} deg of wave-generator travel"
        else:
            angle %= 360
            where = f"{angle:.1f} deg"
        if shape["on"].in_zones:  # the ends of the wave generator are alike, and so are drives half a turn apart
            where = f"{angle % 180:.1f} or {angle % 180 + 180:.1f} deg"
        return (
            f"A local defect on the {shape['on'].part} at {where} makes a pulse "
            f"{parameters['width_deg'].value:.2g} deg wide each time it is met."
        )
