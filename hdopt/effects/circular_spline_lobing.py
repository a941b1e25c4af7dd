"""Circular spline out of round, as by clamping with n bolts.

A radial deviation w cos(n theta + phi) of the circular spline changes the meshing depth in each zone by as much, and
so the arc by w tan(alpha) (Jia 2021, Eqs. (24)-(26)); each zone meets it at its deepest point, zone 2 half a turn on.
Clamping by n bolts makes n lobes; bolts that press in a narrow place make their overtone, 2 n waves, besides. Units: um
of radius; prior 0 to 50 um, n 2 to 16.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects.base import Effect, Keys, terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import UM, Quantity, Sines, needed, smallest_set
from hdopt.effects.estimate import FitEstimate, Parameter, counted
from hdopt.effects.met import Spline, Waves
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Shape, Term

LOBES = range(2, 17)
JAWS, FEW_LOBES_ODDS = 3, -2.0
"""Two lobes are also what a cumulative pitch error makes first; clamping begins with three jaws or bolts. Log odds."""
ALONE, WITH_OVERTONE = (1,), (1, 2)
"""Waves over the number of lobes."""
OVERTONE_ODDS = -10.0
"""Two waves, one of twice the other, are first what the teeth of a circular spline make. Log odds."""
SINES = Sines(
    {1: ("radial_amplitude_um", "phase_deg"), 2: ("radial_amplitude_2_um", "phase_2_deg")},
    "um",
    "of radius, sin(lobes θ + phase); _2: its overtone, sin(2 lobes θ + phase)",
    prior=(0.0, 50.0),
)


def arc_of_a_micrometre(gear: DriveGeometry) -> float:
    """Arc (mm) that 1 um of radius makes by the pressure angle of `gear`."""
    return UM * math.tan(gear.pressure_angle)


class CircularSplineLobing(Effect):
    id = "circular_spline_lobing"
    place = 120
    domain = "order"
    needs_base = True
    acts = "zones"
    radial = True
    has_parts = True
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
        SINES,
    )
    examples = (
        {"lobes": 6, "radial_amplitude_um": 5.0, "phase_deg": 17.0},
        {
            "lobes": 4,
            "radial_amplitude_um": 5.0,
            "phase_deg": 17.0,
            "radial_amplitude_2_um": 1.0,
            "phase_2_deg": 40.0,
        },
    )

    def search(self, probe: Probe) -> Sequence[Term]:
        limit = 0.4 * probe.samples.rows_per_turn
        found: list[Term] = []
        for waves, keep in ((ALONE, 2), (WITH_OVERTONE, 1)):
            shapes = [{"lobes": n, "waves": waves} for n in LOBES if n * waves[-1] < limit]
            found += best_terms(probe, terms_at(self, probe.samples, shapes), keep)
        return found

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        """An overtone is at most as large as its wave: of n lobes a larger one is 2 n lobes."""
        size = estimate.sizes(term.width // 2)
        return bool(size[0] >= size.max())

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        n, waves = int(shape["lobes"]), shape.get("waves", ALONE)
        return Term(
            self.id,
            {"lobes": n, "waves": waves},
            met=Waves(Spline.CIRCULAR, tuple(n * m for m in waves)),
            trials=float(len(LOBES)) * (1 if waves == ALONE else 2),
            odds=(FEW_LOBES_ODDS if n < JAWS else 0.0) + (OVERTONE_ODDS if waves == WITH_OVERTONE else 0.0),
        )

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        return [float(m * shape["lobes"]) for m in shape.get("waves", ALONE)]

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        arc = arc_of_a_micrometre(gear)
        given = SINES.given(self.id, keys)
        SINES.some(self.id, given)
        waves = smallest_set((ALONE, WITH_OVERTONE), given)
        shape = {"lobes": int(needed(keys, "lobes")), "waves": waves}
        return shape, tuple(arc * c for c in SINES.coefficients(given, waves))

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        radial = [c / arc_of_a_micrometre(gear) for c in coefficients]
        return {"lobes": int(shape["lobes"]), **SINES.written(shape.get("waves", ALONE), radial)}

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        found = {"lobes": counted(term.shape["lobes"])}
        for i, m in enumerate(term.shape["waves"]):
            name = "" if m == 1 else f"_{m}"
            found[f"arc_amplitude{name}_um"] = estimate.amplitude(2 * i, 2 * i + 1, "um", scale=1e3)
            found[f"phase{name}_deg"] = estimate.phase_deg(2 * i, 2 * i + 1)
        return found

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        return (
            f"The circular spline is out of round with {parameters['lobes'].value:.0f} lobes, as bolts make "
            f"it: {rms_arcmin:.2g} arcmin rms."
        )
