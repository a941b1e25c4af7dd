"""Lost motion: play between input and output, a step of the error at each reversal.

Jia 2021, Eqs. (33)-(35): the output lags by the play of the gear flanks, 2 pi (e_t - tau)/l_FS, and of the
cross-slide's two slots, the sum of e_b/(N r_i), whose lever arms vary over the input turn. While the play is crossed
the output stands still, so the error changes by the full step over as much input travel as makes the same output
angle. With the input locked the play is crossed where the torque that the flanks feel changes its sign: at the recorded
torque's zero, or beyond it by the friction that holds the output. A recording may begin within the play, and crosses
what is left of it first. Units: lost_motion arcmin, full step between the two directions. Prior: 0 to 10 arcmin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects._offset_laws import laws_of_offset
from hdopt.effects.base import Effect, Keys
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import Quantity, needed, number, polar, sine_and_cosine
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Shape, Term
from hdopt.errors import HdoptError, MissingValue

ORDERS = (1, 2, 4)
"""Waves a turn by which the play may vary: the lever arms of a cross-slide's slots, and the driving zone."""
FRICTION_SHARES = (0.0, 0.05, 0.1, 0.15, 0.25, 0.4)
"""Friction torques that a search tries with a locked input, as shares of the torque reached."""
START = "start"
"""Of a shape: recordings begin within the play, each with a part of its own to cross."""
MOST_LEFT = 1.2
"""Largest part of the play that may be left to cross, and as far below nothing, as a first step of a fit has it."""
LEAST_CROSSING, MOST_CROSSING = 0.05, 60.0
"""Shortest and longest crossing of a search, arcmin of output."""


class LostMotion(Effect):
    id = "lost_motion"
    place = 60
    domain = "reversal"
    sudden = True
    shifts_one_way = True
    separating = "reverse slowly at several input angles and speeds: play steps at once, and alike at every speed"
    declared = (
        Quantity("lost_motion_arcmin", "arcmin", "full step at a reversal", prior=(-10.0, 10.0)),
        Quantity("crossing_arcmin", "arcmin", "output travel over which it is crossed", at_least=0.0),
        Quantity("variation_order", "1", "1, 2 or 4: waves a turn by which it varies", "k", (1, 4), None, whole=True),
        Quantity("variation_arcmin", "arcmin", "size of that", prior=(0.0, 10.0), default=None, at_least=0.0),
        Quantity("variation_phase_deg", "deg", "its phase", "φ", default=None),
    )
    examples = (
        {"lost_motion_arcmin": 0.3, "crossing_arcmin": 0.3},
        {
            "lost_motion_arcmin": 0.3,
            "crossing_arcmin": 0.3,
            "variation_order": 2,
            "variation_arcmin": 0.05,
            "variation_phase_deg": 40.0,
        },
    )

    def lacks(self, conditions: Conditions) -> str | None:
        if conditions.locked:
            torque = conditions.torque
            crossed = torque is not None and np.min(torque) < 0 < np.max(torque)
            return None if crossed else "torque of both signs"
        return None if conditions.reverses else "a reversal"

    def search(self, probe: Probe) -> Sequence[Term]:
        samples = probe.samples
        if samples.locked:
            reached = float(np.max(np.abs(samples.known_torque)))
            return best_terms(probe, [self.term(samples, {"friction_nm": f * reached}) for f in FRICTION_SHARES])
        # The crossing is as long as the play itself, which a first estimate gives.
        _, size = probe.solve(self.term(samples, {"ramp_arcmin": 0.5}))
        ramp = min(max(abs(float(size[0])), LEAST_CROSSING), MOST_CROSSING)
        plain = [self.term(samples, {"ramp_arcmin": ramp})]
        varying = [self.term(samples, {"ramp_arcmin": ramp, "order": k}) for k in ORDERS]
        variants = ([*terms, *self._begun(probe, terms)] for terms in (plain, varying))
        return [best for terms in variants for best in best_terms(probe, terms)]

    def _begun(self, probe: Probe, terms: Sequence[Term]) -> list[Term]:
        """The `terms` with recordings that begin within the play: those in which by `probe` each has between nothing
        and all of it to cross first; none where no row shows that."""
        found: list[Term] = []
        if not _left_to_cross(probe.samples, terms[0].shape["ramp_arcmin"]).any():
            return found
        for term in (self.term(probe.samples, {**one.shape, START: True}) for one in terms):
            solved = probe.solve(term)[1]
            left = -solved[self.lasting(term.shape) :] / solved[0]
            if np.all((1 - MOST_LEFT <= left) & (left <= MOST_LEFT)):
                found.append(term)
        return found

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        if conditions.locked:
            side = np.sign(conditions.known_torque - shape["friction_nm"] * conditions.direction)
            return Term(self.id, dict(shape), columns=0.5 * side[:, None], trials=6.0)
        # In crossing the play the travel in arcmin equals the play itself.
        crossing = np.clip(conditions.travel * 60 / max(shape["ramp_arcmin"], 1e-3), 0, 1)
        step = conditions.direction * (np.where(conditions.first, 1.0, crossing) - 0.5)
        parts = [step]
        if "order" in shape:
            angle = shape["order"] * conditions.theta
            parts += [step * np.sin(angle), step * np.cos(angle)]
        if START in shape:
            left = conditions.direction * _left_to_cross(conditions, shape["ramp_arcmin"])
            parts += [left * (conditions.record == record) for record in range(conditions.records)]
        return Term(self.id, dict(shape), columns=np.column_stack(parts), trials=3.0 if "order" in shape else 1.0)

    def lasting(self, shape: Shape) -> int:
        return 3 if "order" in shape else 1

    def predict(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        """The term of a drive that has reversed before."""
        return self.term(conditions, {name: value for name, value in shape.items() if name != START})

    def other_laws(self, conditions: Conditions, term: Term, motion: Array) -> Mapping[str, Sequence[Array]]:
        return laws_of_offset(conditions, term, motion)

    def highest_order(self, shape: Shape, ratio: float) -> float:
        return float(shape.get("order", 0))

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        order = number(keys, "variation_order")
        if order is not None and order not in ORDERS:
            raise HdoptError(f"effects.{self.id}.variation_order is {order:g}; it must be 1, 2 or 4")
        variation = sine_and_cosine(self.id, keys, "variation_arcmin", "variation_phase_deg")
        if (variation is None) != (order is None):
            wanted, by = ("variation_arcmin", "variation_order")[:: 1 if variation is None else -1]
            raise MissingValue(f"effects.{self.id}.{by}", f"effects.{self.id}.{wanted}")
        shape: dict[str, object] = {"ramp_arcmin": needed(keys, "crossing_arcmin")}
        size = needed(keys, "lost_motion_arcmin")
        if variation is None or order is None:
            return shape, (size,)
        return {**shape, "order": int(order)}, (size, *variation)

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        found: dict[str, object] = {
            "lost_motion_arcmin": coefficients[0],
            "crossing_arcmin": shape["ramp_arcmin"],
        }
        if "order" in shape:
            size, phase = polar(coefficients[1], coefficients[2])
            found |= {"variation_order": shape["order"], "variation_arcmin": size, "variation_phase_deg": phase}
        return found

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        found = {"lost_motion_arcmin": estimate.derived(lambda v: abs(float(v[0])), "arcmin")}
        if "order" in term.shape:
            found["variation_arcmin"] = estimate.amplitude(1, 2)
        return found

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        varies = " and varies over the input turn" if "variation_arcmin" in parameters else ""
        return f"Play: at each reversal the output lags by {parameters['lost_motion_arcmin'].value:.2g} arcmin{varies}."


def _left_to_cross(conditions: Conditions, ramp: float) -> Array:
    """Part of the play, crossed over `ramp` arcmin of output, that is left in each row of the `conditions`, (n,),
    before the first reversal of a recording that begins at its far side; 0 in all others."""
    left = 1 - conditions.travel * 60 / max(ramp, 1e-3)
    return np.asarray(np.where(conditions.first, np.maximum(left, 0.0), 0.0))
