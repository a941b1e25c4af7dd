"""Sub-divisional error of an encoder: a ripple at its lines.

Offsets of the sine and cosine signals make an error of one cycle a line, unequal amplitudes and a wrong phase two
cycles (Heydemann, Applied Optics 20 (1981) 3382). With L lines a turn the orders are L and 2 L of the input (divided
by N), or L/N and 2 L/N of the output encoder, whose phase follows the angle that it reads itself: with thousands of
lines an arcmin of kinematic error or drift moves it by a radian. Of a whole ratio N, L lines of the input and N L of
the output stand at the same orders. Units: arcmin at the output; lines a whole number.
Prior: 3 to 20000 lines; fewer than 17 are rare (pole pairs of a resolver, of which two and one stand at the drive's own
orders), and fewer than 8 are looked for with their double alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects._time_laws import columns_growing
from hdopt.effects.base import Effect, Keys
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import Category, Quantity, Shaft, Sines, needed, smallest_set
from hdopt.effects.estimate import FitEstimate, Parameter, counted
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Shape, Term
from hdopt.effects.tooth_mesh import ToothMesh, mesh_order
from hdopt.words import listed

LOWEST_ORDER = 8.0
LOWEST_PAIR = 3.0
"""Lowest order of lines of which both L and 2 L are there: one line alone could be anything."""
MODULATION_PER_OUTPUT_TURN, SIDEBAND_REACH = 3.5, 12.0
"""Orders that the teeth own: within so many 1/N of a whole sideband, up to so far from the mesh order."""
MESH_MULTIPLES = (1, 2, 3)
"""Cycles a tooth about which a mesh may have lines."""
CYCLES: tuple[tuple[int, ...], ...] = ((1,), (1, 2), (2,), (1, 2, 3, 4))
"""Cycles a line of each variant; distorted signals (no pure sines) add the third and fourth."""
SEARCHED = ((1,), (1, 2), (1, 2, 3, 4))
"""Two cycles a line without the first cannot be told from one cycle of twice as many lines."""
LEAST_OUTPUT_TURNS = 0.1
"""Part of an output turn from which its lines are counted: by their phase, which follows the output and so the drive's
own error, and well above the noise far finer than neighbours in a spectrum are told apart."""
MESH_CYCLES = (1, 2)
"""Cycles a line by which lines at the tooth mesh could stand for it."""
SHOWS = 0.01
"""Power over that of its double or triple from which a line is taken for the encoder's own."""
WHOLE = 1e-9
"""Relative rounding within which lines are a whole number."""
HARMONICS_OF_TEETH = 40
"""Waves round the splines, h and h (1 + 1/N) up to so many, and the mesh order are the teeth's."""
OTHER = "lines_of_the_other"
"""Key of a term's shape: the lines of the other shaft's encoder at the same orders, 0 where it has none."""
DOUBTFUL = "may_be_of_teeth"
"""Key of the shape of lines that took the place of the other shaft's: whether those might have been the teeth's."""
LOW = "of_low_order"
"""Key of the shape of lines below the lowest order at which one alone is taken for an encoder's."""
FEW_LINES, FEW_LINES_ODDS = 17, -8.0
"""Below so many lines a turn bolts and teeth are likelier than an encoder; log odds."""
SINES = Sines(
    {1: ("amplitude_arcmin", "phase_deg")} | {k: (f"amplitude_{k}_arcmin", f"phase_{k}_deg") for k in (2, 3, 4)},
    "arcmin",
    "once a line, at the output; K cycles a line",
    prior=(0.0, 2.0),
    shown="`amplitude_arcmin`, `phase_deg`; `amplitude_K_arcmin`, `phase_K_deg`, K 2 to 4",
)


def beside_the_mesh(orders: Array, ratio: float) -> Mask:
    """Where one of `orders` (n,) is the tooth mesh of a drive of `ratio` N or a sideband of it, drawn aside by a few
    output turns' worth of modulation.
    """
    near = np.abs(orders - np.round(orders)) < MODULATION_PER_OUTPUT_TURN / ratio
    return np.asarray(near & (np.abs(orders - mesh_order(ratio)) < SIDEBAND_REACH))


def are_of_the_mesh(orders: Array, ratio: float) -> Mask:
    """Which `orders` (n,) of an encoder's lines are that of the tooth mesh of a drive of `ratio` N, or half of it: a
    mesh is there in every drive, and no encoder is made with just as many lines.
    """
    return np.asarray(np.any([np.abs(m * orders - mesh_order(ratio)) < WHOLE * orders for m in MESH_CYCLES], axis=0))


def may_be_told(orders: Array, samples: Conditions, output: bool) -> Mask:
    """Which `orders` (n,) a turn of the input may be told as lines of the `output` encoder or the input's: none of
    the teeth's, and of the output's none where `samples` span too little of its turn.
    """
    told = ~are_of_the_mesh(orders, samples.ratio)
    if not output:
        return told
    enough = samples.span_turns >= LEAST_OUTPUT_TURNS * samples.ratio
    return np.asarray(told & ~beside_the_mesh(orders, samples.ratio) & enough)


def is_of_teeth(order: float, multiples: Sequence[int], ratio: float, output: bool) -> bool:
    """Whether an encoder's line, at an `order` a turn of the input of a drive of `ratio` N, is where a wave round one
    of the splines shows (asked of the `output` encoder only), or any of its `multiples` at the mesh of the teeth.
    """
    waves = (order, order / (1 + 1 / ratio)) if output else ()
    round_a_spline = any(abs(wave - round(wave)) < 1e-6 and round(wave) <= HARMONICS_OF_TEETH for wave in waves)
    return round_a_spline or any(abs(m * order - mesh_order(ratio)) < 1e-6 for m in multiples)


def is_where_the_mesh_reaches(order: float, multiples: Sequence[int], ratio: float) -> bool:
    """Whether any of the `multiples` of an encoder's line, at an `order` a turn of the input of a drive of `ratio` N,
    is as near to the order of the tooth mesh, its double or its triple as the sidebands of a mesh that varies over the
    turn: a form that is no sine, and a driving zone that changes with the teeth, make such lines too.
    """
    mesh = mesh_order(ratio)
    return any(abs(m * order - k * mesh) < SIDEBAND_REACH for m in multiples for k in MESH_MULTIPLES)


def lines_of_the_other(lines: int, ratio: float, output: bool) -> int:
    """Lines a turn of the other shaft's encoder that stand at the same orders as these `lines` of the `output` encoder
    or the input's, of a drive of `ratio` N; 0 where there is no whole number of them, or too few for an encoder.
    """
    other = lines / ratio if output else lines * ratio
    whole = round(other)
    return whole if whole >= LOWEST_PAIR and abs(other - whole) < WHOLE * other else 0


class EncoderInterpolation(Effect):
    id = "encoder_interpolation"
    place = 90
    domain = "order"
    high_order = True
    leaves_nothing = True
    has_parts = True
    separating = (
        "record at two thirds of the speed and twice the sampling rate: the ripple stays at the encoder's lines"
    )
    bench_part = "an encoder"
    declared = (
        Category("shaft", Shaft, "the shaft whose encoder it is"),
        Quantity("lines", "1", "lines a turn", "L", (3, 20_000), at_least=1, at_most=1_000_000, whole=True),
        SINES,
    )
    examples = (
        {"shaft": "input", "lines": 25, "amplitude_arcmin": 0.05, "phase_deg": 5.0},
        {"shaft": "output", "lines": 4001, "amplitude_2_arcmin": 0.05, "phase_2_deg": 5.0},
        {
            "shaft": "output",
            "lines": 500,
            "amplitude_arcmin": 0.05,
            "phase_deg": 5.0,
            "amplitude_4_arcmin": 0.01,
            "phase_4_deg": 15.0,
        },
    )

    def lacks(self, conditions: Conditions) -> str | None:
        if conditions.rows_per_turn < 3 * LOWEST_ORDER:
            return f"more than {3 * LOWEST_ORDER:.0f} samples an input turn"
        if conditions.span_turns < 2:
            return f"at least 2 input turns to count lines (there are {conditions.span_turns:.1f})"
        return None

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        """Whether the line itself is there beside its multiples: two cycles a line without the first are any other
        line's, and of a low one any wave's. Of a line of low order its double must be there too.
        """
        power = estimate.values[0 : term.width : 2] ** 2 + estimate.values[1 : term.width : 2] ** 2
        both = power[1] if term.shape.get(LOW) else power[0]
        return bool(min(power[0], both) >= SHOWS * power.max())

    def search(self, probe: Probe) -> Sequence[Term]:
        found = [term for shaft in Shaft for term in self._of_shaft(probe, shaft)]
        return best_terms(probe, found, 2) if found else []

    def _of_shaft(self, probe: Probe, shaft: Shaft) -> list[Term]:
        """Terms of the encoder of one shaft, at its strongest lines."""
        samples, output = probe.samples, shaft == Shaft.OUTPUT
        highest = min(probe.order_range[1], 0.49 * samples.rows_per_turn)
        # Rows that are no averages hold every cycle up to half their number.
        finest = highest if samples.are_averages else 0.5 * samples.rows_per_turn * (1 + 1e-6)
        per = samples.ratio if output else 1.0
        lowest = max(probe.order_range[0], LOWEST_PAIR)
        lines = np.arange(np.ceil(lowest * per), np.floor(highest * per) + 1)
        lines = lines[may_be_told(lines / per, samples, output)]
        if not len(lines):
            return []
        return [
            self.term(samples, {"lines": int(line), "shaft": shaft, "cycles": cycles}, trials=float(len(lines)))
            for line in _with_neighbours(_strongest_lines(probe, lines, per, highest, output), lines, per, samples)
            for cycles in SEARCHED
            if cycles[-1] * line <= finest * per and (line >= LOWEST_ORDER * per or cycles[:2] == (1, 2))
        ]

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None, trials: float = 1000.0) -> Term:
        output = shape["shaft"] == Shaft.OUTPUT
        angle = conditions.output if output else conditions.input_as_read
        columns = sine_columns(angle, [float(m * shape["lines"]) for m in shape["cycles"]])
        odds = FEW_LINES_ODDS if shape["lines"] < FEW_LINES else 0.0
        order = shape["lines"] / (conditions.ratio if output else 1.0)
        doubtful = shape.get(DOUBTFUL, is_of_teeth(order, shape["cycles"], conditions.ratio, output))
        beside = (ToothMesh.id,) if is_where_the_mesh_reaches(order, shape["cycles"], conditions.ratio) else ()
        known = {OTHER: lines_of_the_other(int(shape["lines"]), conditions.ratio, output)}
        if order < LOWEST_ORDER and len(shape["cycles"]) > 1:
            known[LOW] = True
        return Term(
            self.id,
            dict(shape) | known,
            columns=columns,
            trials=trials,
            odds=odds,
            doubtful=doubtful,
            doubtful_beside=beside,
        )

    def is_part_of(self, shape: Shape, other: Shape) -> bool:
        """Whether `shape` has the lines of an encoder of which `other` holds a multiple."""
        return bool(shape["shaft"] == other["shaft"] and other["lines"] % shape["lines"] == 0)

    def at_the_same_orders(self, conditions: Conditions, term: Term) -> Sequence[Term]:
        """The lines of the other shaft's encoder, where they are looked for at all: as many more or fewer numbers of
        them were there to choose from as there are lines. The teeth may stand for both or for neither.
        """
        lines, other = term.shape["lines"], term.shape[OTHER]
        shaft = Shaft.INPUT if term.shape["shaft"] == Shaft.OUTPUT else Shaft.OUTPUT
        order = np.array(self.orders(term.shape, conditions.ratio)[:1])
        if not other or not may_be_told(order / term.shape["cycles"][0], conditions, shaft == Shaft.OUTPUT).all():
            return ()
        shape = {"lines": other, "shaft": shaft, "cycles": term.shape["cycles"], DOUBTFUL: term.doubtful}
        return [self.term(conditions, shape, trials=term.trials * other / lines)]

    def reads_input(self, shape: Shape) -> bool:
        return bool(shape.get("shaft") == Shaft.INPUT)

    def other_laws(self, conditions: Conditions, term: Term, motion: Array) -> Mapping[str, Sequence[Array]]:
        return {"time": columns_growing(conditions, term)}

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        order = shape["lines"] / (ratio if shape["shaft"] == Shaft.OUTPUT else 1.0)
        return [m * order for m in shape["cycles"]]

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        given = SINES.given(self.id, keys)
        SINES.some(self.id, given)
        cycles = smallest_set(CYCLES, given)
        shape = {"lines": int(needed(keys, "lines")), "shaft": Shaft(str(keys["shaft"])), "cycles": cycles}
        return shape, SINES.coefficients(given, cycles)

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        sines = SINES.written(shape["cycles"], coefficients)
        return {"shaft": str(shape["shaft"]), "lines": int(shape["lines"])} | sines

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        lines, other = term.shape["lines"], term.shape[OTHER]
        both = [float(number) for number in (lines, other or lines)]
        found = {"lines": replace(counted(lines), low=min(both), high=max(both))}
        for i, cycle in enumerate(term.shape["cycles"]):
            amplitude, phase = SINES.members[cycle]
            found |= {amplitude: estimate.amplitude(2 * i, 2 * i + 1), phase: estimate.phase_deg(2 * i, 2 * i + 1)}
        return found

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        lines, other = f"{parameters['lines'].value:.0f}", shape.get(OTHER)
        shaft = Shaft.INPUT if shape["shaft"] == Shaft.OUTPUT else Shaft.OUTPUT
        instead = f" (or the {shaft} encoder between its {other:.0f}, at the same orders)" if other else ""
        cycles = [str(cycle) for cycle in shape["cycles"]]
        sizes = [f"{parameters[SINES.members[cycle][0]].value:.2g}" for cycle in shape["cycles"]]
        said = f"{listed(sizes)} arcmin at the output"
        if cycles != ["1"]:
            said += f" in {listed(cycles)} cycles a line"
        return f"The {shape['shaft']} encoder interpolates unevenly between its {lines} lines{instead}: {said}."


def _with_neighbours(strongest: set[float], lines: Array, per: float, samples: Conditions) -> list[float]:
    """The `strongest` numbers of `lines`, `per` input turn each, and those beside them as far as a spectrum of the
    `samples` does not tell them apart; in rising order."""
    reach = int(0.5 * per / samples.span_turns)
    beside = {line + d for line in strongest for d in range(-reach, reach + 1)}
    return sorted(beside & set(lines.tolist()))


def _strongest_lines(probe: Probe, lines: Array, per: float, highest: float, output: bool) -> set[float]:
    """The strongest numbers of `lines`, `per` input turn each, alone and with their double; and a half or a third of
    these where that shows too: the strongest line may be the second or third cycle of the encoder's own.
    """
    power = probe.spectrum(lines / per, output) ** 2
    second = probe.spectrum(np.minimum(2 * lines / per, highest), output) ** 2
    double = np.where(2 * lines / per < highest, second, 0.0)
    strongest = {float(lines[i]) for score in (power, power + double) for i in np.argsort(score)[-2:]}
    seen = dict(zip(lines.tolist(), power.tolist(), strict=True))
    return strongest | {line // k for line in strongest for k in (2, 3) if seen.get(line / k, 0.0) > SHOWS * seen[line]}
