"""Circular spline out of round, as by clamping with n bolts.

A radial deviation w cos(n theta + phi) of the circular spline changes the meshing depth in each zone by as much, and
so the arc by w tan(alpha) (Jia 2021, Eqs. (24)-(26)); each zone meets it at its deepest point, zone 2 half a turn on.
Clamping by n bolts makes n lobes. Units: um of radius; prior 0 to 50 um, n 2 to 16.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects.base import Effect, Keys, terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import UM, Quantity, Sines, needed, polar
from hdopt.effects.estimate import FitEstimate, Parameter, counted
from hdopt.effects.met import Spline, Waves
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Shape, Term

LOBES = range(2, 17)
JAWS, FEW_LOBES_ODDS = 3, -2.0
"""Two lobes are also what a cumulative pitch error makes first; clamping begins with three jaws or bolts. Log odds."""
SINE = Sines({1: ("radial_amplitude_um", "phase_deg")}, "um", "of radius, sin(lobes θ + phase)", prior=(0.0, 50.0))


class CircularSplineLobing(Effect):
    id = "circular_spline_lobing"
    place = 120
    domain = "order"
    needs_base = True
    acts = "zones"
    radial = True
    special_case_of = "cs_tooth_harmonics"
    separating = (
        "loosen the clamping bolts and tighten them again evenly, or turn the circular spline: lobes made by "
        "clamping stay with the bolts, tooth errors turn with the spline"
    )
    declared = (
        Quantity(
            "lobes",
            "1",
            "waves round the ring",
            "n",
            (LOBES.start, LOBES.stop - 1),
            at_least=LOBES.start,
            below=LOBES.stop,
            whole=True,
        ),
        SINE,
    )
    examples = ({"lobes": 6, "radial_amplitude_um": 5.0, "phase_deg": 17.0},)

    def search(self, probe: Probe) -> Sequence[Term]:
        limit = 0.4 * probe.samples.rows_per_turn
        return best_terms(probe, terms_at(self, probe.samples, [{"lobes": n} for n in LOBES if n < limit]), 2)

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        n = int(shape["lobes"])
        return Term(
            self.id,
            {"lobes": n},
            met=Waves(Spline.CIRCULAR, (n,)),
            trials=float(len(LOBES)),
            odds=FEW_LOBES_ODDS if n < JAWS else 0.0,
        )

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        return [float(shape["lobes"])]

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        arc = UM * math.tan(gear.pressure_angle)
        given = SINE.given(self.id, keys)
        return {"lobes": int(needed(keys, "lobes"))}, tuple(arc * c for c in SINE.coefficients(given, (1,)))

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        arc, phase = polar(coefficients[0], coefficients[1])
        radial = arc / math.tan(gear.pressure_angle) / UM
        return {"lobes": int(shape["lobes"]), "radial_amplitude_um": radial, "phase_deg": phase}

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        return {
            "lobes": counted(term.shape["lobes"]),
            "arc_amplitude_um": estimate.amplitude(0, 1, "um", scale=1e3),
            "phase_deg": estimate.phase_deg(0, 1),
        }

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        return (
            f"The circular spline is out of round with {parameters['lobes'].value:.0f} lobes, as bolts make "
            f"it: {rms_arcmin:.2g} arcmin rms."
        )
