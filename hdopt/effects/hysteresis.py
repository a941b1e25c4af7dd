"""Pre-sliding friction: after each reversal the error crosses over gradually, and not at all with speed.

The friction state z follows the output travel s alone, whatever the speed: from z_rev at a reversal towards the
direction d, by one of the laws of `_friction_law` (Dahl, Maxwell-slip, Bouc-Wen), each in units of its own length.
The error takes half_loop times z. Stated is the transition, the output angle after a full reversal at which 90 % of the
loop is crossed: 0.7 to 2.6 lengths. Units: half_loop arcmin, transition deg of output angle. Prior: 0 to 5 arcmin, a
length from a sample to 10 deg, far more than the windup by which a drive's friction is overcome. Where the input is
locked the loop is one of torque and windup: `_friction_torque`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array
from hdopt.effects._friction_law import LAWS, NAMES, Law
from hdopt.effects._friction_torque import friction_columns, half_loop, passes_of
from hdopt.effects._offset_laws import laws_of_offset
from hdopt.effects.base import Effect, terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import Category, Quantity
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Shape, Term

SHARES = (0.02, 0.05, 0.1, 0.15, 0.25, 0.4)
"""Friction torques and knees that a search tries, as shares of the torque reached."""
SHORTEST_ROWS = 2.0
"""Shortest length of a law, in rows: a crossing within fewer cannot be told from play."""
LONGEST_DEG = 10.0
"""Longest length of a law, deg of output: what takes longer to turn over would be a drift of something else."""
LONGEST_TRANSITION_DEG = LONGEST_DEG * max(law.transition for law in LAWS.values())


class Hysteresis(Effect):
    id = "hysteresis"
    place = 50
    domain = "reversal"
    sudden = True
    has_parts = True
    shifts_one_way = True
    separating = (
        "reverse after short and long travels and record the crossing: friction crosses gradually, play at once"
    )
    declared = (
        Quantity("half_loop_arcmin", "arcmin", "half the distance of the two directions", prior=(-5.0, 5.0), scale=1.0),
        Quantity(
            "transition_deg",
            "deg",
            "output angle after a reversal at which 90 % of the loop is crossed",
            "δ",
            (1e-3, LONGEST_TRANSITION_DEG),
            above=0.0,
        ),
        Category("model", Law, "the law of the crossing", default=Law.DAHL),
    )
    examples = (
        {"half_loop_arcmin": 0.2, "transition_deg": 1.5, "model": "dahl"},
        {"half_loop_arcmin": 0.2, "transition_deg": 1.5, "model": "maxwell_slip"},
        {"half_loop_arcmin": 0.2, "transition_deg": 1.5, "model": "bouc_wen_square"},
        {"half_loop_arcmin": 0.2, "transition_deg": 1.5, "model": "maxwell_slip_wide"},
    )

    def search(self, probe: Probe) -> Sequence[Term]:
        samples = probe.samples
        if samples.locked:
            reached = float(np.max(np.abs(samples.known_torque)))
            sizes = [{"friction_nm": f * reached, "knee_nm": k * reached} for f in SHARES for k in SHARES]
            return best_terms(probe, [self.term(samples, size) for size in sizes])
        longest = float(np.max(samples.travel))
        shortest = max(3 * _row(samples), 1e-4 * longest)
        lengths = np.geomspace(0.7 * shortest, max(0.14 * min(longest, 5 * LONGEST_DEG), shortest), 14)
        dahl, maxwell, *others = (
            best_terms(probe, terms_at(self, samples, [self._shape(law, half) for half in lengths]))[0] for law in NAMES
        )
        return [dahl, maxwell, *best_terms(probe, others)]

    @staticmethod
    def _shape(law: Law, half: float) -> Shape:
        """Shape by the name of the law, with full reversals half crossed after `half` (deg)."""
        return {"transition_deg": float(half / LAWS[law].half * LAWS[law].transition), "model": law}

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        if conditions.locked:
            reached = float(np.max(np.abs(conditions.known_torque)))
            kept = {name: min(max(value, 0.005 * reached), 0.9 * reached) for name, value in shape.items()}
            columns = friction_columns(conditions, kept["friction_nm"], kept["knee_nm"])
            steps = {name: 0.005 * reached for name in kept}
            return Term(self.id, kept, columns=columns, steps=steps, trials=float(len(SHARES) ** 2))
        longest, row = float(np.max(conditions.travel)), _row(conditions)
        of_length = LAWS[shape["model"]].transition
        shortest = SHORTEST_ROWS * row
        length = min(max(shape["transition_deg"] / of_length, shortest), 0.25 * longest, max(LONGEST_DEG, shortest))
        transition = length * of_length
        parts = [friction_state(conditions, transition, shape["model"])]
        if conditions.first.any():
            # The state at the start of a recording is unknown: it fades over the same length.
            parts.append(np.where(conditions.first, np.exp(-conditions.travel / length), 0.0))
        return Term(
            self.id,
            {"transition_deg": transition, "model": shape["model"]},
            columns=np.column_stack(parts),
            steps={"transition_deg": 0.02 * transition},
            trials=14.0 * len(LAWS),
        )

    def lasting(self, shape: Shape) -> int | None:
        return 1

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        """Whether it crosses over within the longest length: what is drawn to that end relaxes, in time or far
        travel, and is no friction."""
        if "transition_deg" not in term.shape:
            return True
        return float(term.shape["transition_deg"]) < (1 - 1e-9) * LONGEST_DEG * LAWS[term.shape["model"]].transition

    def other_forms(self, shape: Shape) -> Sequence[Shape]:
        """The other laws of the crossing."""
        if "transition_deg" not in shape:
            return ()
        return [{**shape, "model": law} for law in NAMES if law != shape["model"]]

    def other_laws(self, conditions: Conditions, term: Term, motion: Array) -> Mapping[str, Sequence[Array]]:
        return laws_of_offset(conditions, term, motion)

    def predict(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        """The term of a drive that has run in: no limits by a record, no unknown start."""
        state = friction_state(conditions, shape["transition_deg"], shape["model"])
        return Term(self.id, dict(shape), columns=state[:, None])

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        at = term.width
        if "friction_nm" in term.shape:
            return {
                "half_loop_arcmin": estimate.derived(lambda v: half_loop(v, v[at], v[at + 1]), "arcmin"),
                "friction_torque": estimate.parameter(at, "Nm"),
            }
        return {
            "half_loop_arcmin": estimate.derived(lambda v: abs(float(v[0])), "arcmin"),
            "transition_deg": estimate.parameter(at, "deg"),
        }

    def as_seen(
        self, parameters: dict[str, Parameter], term: Term, conditions: Conditions, contribution: Array
    ) -> dict[str, Parameter]:
        """A crossing that may last no longer than the rows resolve may be as short as it likes."""
        found = parameters.get("transition_deg")
        if found is None or found.low > SHORTEST_ROWS * _row(conditions) * LAWS[term.shape["model"]].transition:
            return parameters
        return {**parameters, "transition_deg": replace(found, low=0.0)}

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        if "friction_torque" in parameters:
            return (
                f"Friction of {parameters['friction_torque'].value:.2g} Nm at the output: loading and unloading lie "
                f"{2 * parameters['half_loop_arcmin'].value:.3g} arcmin apart at zero torque."
            )
        return (
            f"Friction: the two directions lie {2 * parameters['half_loop_arcmin'].value:.2g} arcmin apart; after a "
            f"reversal nine tenths of it are crossed within {parameters['transition_deg'].value:.2g} deg of output."
        )


def _row(conditions: Conditions) -> float:
    """Travel of the output from row to row of the `conditions`, deg."""
    return float(np.median(np.abs(np.diff(conditions.travel))))


def friction_state(conditions: Conditions, transition: float, law: Law) -> Array:
    """Friction state z in -1..1 along the `conditions`, (n,), by `law`, of which 90 % of a full reversal is crossed
    after `transition` (deg of output); each pass starts from where the one before it ended.
    """
    cross, length = LAWS[law].cross, transition / LAWS[law].transition
    state = np.empty(len(conditions))
    last = 0.0
    for rows in passes_of(conditions):
        direction = float(conditions.direction[rows.start])
        if conditions.first[rows.start]:
            state[rows] = direction
        else:
            state[rows] = direction * cross(direction * last, conditions.travel[rows] / length)
        last = float(state[rows.stop - 1])
    return state
