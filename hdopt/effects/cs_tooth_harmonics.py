"""Circular-spline tooth deviation that is not one sine round the rim.

Jia 2021, Eqs. (31a), (31b) take the long-wave tangential composite deviation as a_CS sin(theta + phi); cumulative pitch
deviation of a real gear (ISO 1328-1, F_p) has further harmonics a_h sin(h theta + phi_h), h = 2, 3, ... Each zone meets
them at its own deepest point; even ones act directly, odd ones through the change of the driving zone. Jia 2021,
Sec. 5, names this as a cause of the mismatch with its own rig. Units: amplitude um of arc at the pitch line, prior 0 to
10 um.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects._zone_harmonics import strongest_few
from hdopt.effects.base import Effect, Keys, terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import UM, Sines
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.met import Spline, Waves
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Shape, Term

RUNS: tuple[tuple[int, ...], ...] = ((2,), (3,), *(tuple(range(2, k + 1)) for k in (3, 4, 5, 8, 14, 24, 40, 70)))
"""Sets of harmonics without a gap, as of a pitch deviation of any shape, the first alone among them. One more reaches
as far as the rows do: each tooth's own error makes waves of every length."""
FEW, MOST_OF_FEW = tuple(range(2, 13)), 3
"""Harmonics of which also a few may stand out alone, as of cutter, chuck and machine table, and how many."""

LEAST_OF_FEW = 0.15
"""Size of the smallest of a few harmonics over the largest: less is what another shape leaves."""
MOST_OF_TEETH = 0.75
"""Waves over the flexspline's teeth, 2 N: places of z teeth have z/2 waves at most, which a load that passes from tooth
to tooth repeats above that; z waves are the mesh."""
SAID = 4
"""Waves that the sentence lists."""
SHORT_RUN, SHOWN_OF_A_RUN = 4, 0.5
"""Harmonics of a short run, and the part of them that must be of such a size."""
SINES = Sines(
    {h: (f"amplitude_{h}_um", f"phase_{h}_deg") for h in RUNS[-1]},
    "um",
    "of arc, waves round the rim beyond the first",
    prior=(0.0, 10.0),
    scale=UM,
    shown="`amplitude_H_um`, `phase_H_deg`, H 2 to 70",
)


def members_of(shape: Shape) -> tuple[int, ...]:
    """The harmonics that a shape holds, in rising order."""
    return tuple(shape["members"])


def has_no_gap(members: tuple[int, ...]) -> bool:
    """Whether these harmonics, `members`, are a run, not a few that stand out alone."""
    return members in RUNS or members == tuple(range(2, members[-1] + 1))


def shape_of(members: Iterable[int]) -> Shape:
    """The shape of these harmonics, `members`."""
    return {"members": tuple(sorted(set(members)))}


class CircularSplineToothHarmonics(Effect):
    id = "cs_tooth_harmonics"
    place = 10
    title = "CS tooth harmonics"
    domain = "order"
    has_parts = True
    needs_base = True
    acts = "zones"
    separating = (
        "turn the circular spline in its housing by a quarter turn and record again: its tooth errors turn with it, "
        "the housing's clamping does not"
    )
    part: ClassVar[str] = "circular spline"
    spline: ClassVar[Spline] = Spline.CIRCULAR
    declared = (SINES,)
    examples: ClassVar[tuple[Keys, ...]] = (
        {"amplitude_2_um": 1.5, "phase_2_deg": 30.0, "amplitude_3_um": 0.5, "phase_3_deg": -60.0},
    )

    def search(self, probe: Probe) -> Sequence[Term]:
        samples = probe.samples
        fewest_teeth = 2 * samples.ratio
        limit = min(0.5 * samples.rows_per_turn, 1.5 * samples.highest_order, MOST_OF_TEETH * fewest_teeth)
        runs = [run for run in RUNS if run[-1] <= limit]
        if runs and runs[-1][-1] < int(limit) < RUNS[-1][-1]:
            runs.append(tuple(range(2, int(limit) + 1)))
        terms = best_terms(probe, terms_at(self, samples, [shape_of(run) for run in runs]), 2)
        few = [members for members in self._strongest_few(probe, limit) if self.stands_alone(members)]
        return [*terms, *terms_at(self, samples, [shape_of(members) for members in few if not has_no_gap(members)])]

    def beyond_search(self, probe: Probe) -> Sequence[Term]:
        """Each wave of the circular spline alone: what lobes of its ring make too, and the search leaves to them."""
        lone = [shape_of((h,)) for h in FEW if h <= 0.4 * probe.samples.rows_per_turn]
        return terms_at(self, probe.samples, lone) if self.spline is Spline.CIRCULAR else ()

    def _strongest_few(self, probe: Probe, limit: float) -> list[tuple[int, ...]]:
        members = tuple(h for h in FEW if h <= limit)
        if len(members) < 2:
            return []
        (wide,) = terms_at(self, probe.samples, [shape_of(members)])
        return strongest_few(*probe.table(wide), members, MOST_OF_FEW)

    @staticmethod
    def stands_alone(members: tuple[int, ...]) -> bool:
        """One wave alone beyond the first two would be a lobe of the clamping."""
        return len(members) > 1

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        """A few harmonics that stand out are all there, and more than one where one alone is another's; of a short run
        without a gap some may be missing, and of a long one, as of segments, the high ones are small.
        """
        members = members_of(term.shape)
        if not self.stands_alone(members):
            return False
        size = estimate.sizes(term.width // 2)
        shown = size > LEAST_OF_FEW * size.max()
        if not has_no_gap(members):
            return bool(np.all(shown))
        return len(members) > SHORT_RUN or bool(np.mean(shown) >= SHOWN_OF_A_RUN)

    def trimmed(self, term: Term, coefficients: Array) -> Shape | None:
        """The shape without the harmonics that do not show, or None where that leaves too few."""
        members = members_of(term.shape)
        size = np.hypot(coefficients[0::2], coefficients[1::2])
        left = tuple(h for h, s in zip(members, size, strict=True) if s > LEAST_OF_FEW * size.max())
        return shape_of(left) if not has_no_gap(members) and self.stands_alone(left) and left != members else None

    def shortened(self, term: Term) -> Sequence[Shape]:
        """Shapes of shorter runs than the term's own, the longest first."""
        members = members_of(term.shape)
        if not has_no_gap(members):
            return []
        return [shape_of(run) for run in reversed(RUNS) if len(run) > 1 and run[-1] < members[-1]]

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        members = members_of(shape)
        trials = float(len(RUNS))
        if not has_no_gap(members):
            trials *= math.comb(len(FEW), len(members))
        return Term(self.id, dict(shape), met=Waves(self.spline, members), trials=trials)

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        return [float(h) for h in members_of(shape)]

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        given = SINES.given(self.id, keys)
        SINES.some(self.id, given)
        members = sorted(given)
        return shape_of(members), SINES.coefficients(given, members)

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        return dict(SINES.written(members_of(shape), coefficients))

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        found = {}
        for i, h in enumerate(members_of(term.shape)):
            found[f"amplitude_{h}_um"] = estimate.amplitude(2 * i, 2 * i + 1, "um", scale=1e3)
            found[f"phase_{h}_deg"] = estimate.phase_deg(2 * i, 2 * i + 1)
        return found

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        sizes = {int(n.split("_")[1]): p.value for n, p in parameters.items() if n.startswith("amplitude")}
        largest = sorted(sizes, key=lambda h: sizes[h], reverse=True)[:SAID]
        parts = [f"{sizes[h]:.2g} um at {h} waves a turn" for h in sorted(largest)]
        if len(sizes) > SAID:
            parts.append(f"less at {len(sizes) - SAID} others")
        return (
            f"The {self.part}'s teeth deviate from their place by more than one wave round the rim: "
            f"{', '.join(parts)} ({rms_arcmin:.2g} arcmin rms at the output)."
        )
