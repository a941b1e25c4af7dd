"""Pre-sliding friction: after each reversal the error crosses over gradually, and not at all with speed.

The friction state z follows the output travel s alone, whatever the speed: from z_rev at a reversal towards the
direction d, within a length delta, by one of the laws of `_friction_law` (Dahl, Maxwell-slip, Bouc-Wen).
The error takes half_loop times z. Units: half_loop arcmin, delta deg of output angle. Prior: 0 to 5 arcmin, delta from
a sample to 10 deg, far more than the windup by which a drive's friction is overcome. Where the input is locked the loop
is one of torque and windup: `_friction_torque`.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms, terms_at
from hdopt.diagnosis.effects._friction_law import LAWS, NAMES
from hdopt.diagnosis.effects._friction_torque import friction_columns, half_loop

SHARES = (0.02, 0.05, 0.1, 0.15, 0.25, 0.4)
"""Friction torques and knees that a search tries, as shares of the torque reached."""
LONGEST_DEG = 10.0
"""Longest crossing, deg of output: friction that takes longer to turn over would be a drift of something else."""


class Hysteresis:
    id = "hysteresis"
    domain = "reversal"
    needs_base = False
    separating = (
        "reverse after short and long travels and record the crossing: friction crosses gradually, play at once"
    )

    def lacks(self, samples):
        return None if samples.reverses else "a reversal"

    def search(self, probe):
        samples = probe.samples
        if samples.locked:
            reached = float(np.max(np.abs(samples.torque)))
            sizes = [{"friction_nm": f * reached, "knee_nm": k * reached} for f in SHARES for k in SHARES]
            return best_terms(probe, [self.term(samples, size) for size in sizes])
        longest = float(np.max(samples.travel))
        shortest = max(3 * float(np.median(np.abs(np.diff(samples.travel)))), 1e-4 * longest)
        lengths = np.geomspace(0.7 * shortest, max(0.14 * min(longest, 5 * LONGEST_DEG), shortest), 14)
        dahl, maxwell, *others = (
            best_terms(probe, terms_at(self, samples, [self._shape(law, half) for half in lengths]))[0]
            for law in NAMES
        )
        return [dahl, maxwell, *best_terms(probe, others)]

    @staticmethod
    def _shape(law, half):
        """Shape by the name of the law, with full reversals half crossed after `half` (deg)."""
        return {"transition_deg": float(half / LAWS[law].half), "law": float(NAMES.index(law))}

    def term(self, samples, shape, base_value=None):
        if samples.locked:
            reached = float(np.max(np.abs(samples.torque)))
            shape = {name: min(max(value, 0.005 * reached), 0.9 * reached) for name, value in shape.items()}
            columns = friction_columns(samples, shape["friction_nm"], shape["knee_nm"])
            steps = {name: 0.005 * reached for name in shape}
            return Term(self.id, shape, columns=columns, steps=steps, trials=float(len(SHARES) ** 2))
        # A crossing faster than a few rows cannot be told from play.
        longest, row = float(np.max(samples.travel)), float(np.median(np.abs(np.diff(samples.travel))))
        delta = min(max(shape["transition_deg"], 2 * row), 0.25 * longest, max(LONGEST_DEG, 2 * row))
        columns = [friction_state(samples, delta, int(shape["law"]))]
        if samples.first.any():
            # The state at the start of a recording is unknown: it fades over the same length.
            columns.append(np.where(samples.first, np.exp(-samples.travel / delta), 0.0))
        return Term(
            self.id,
            {"transition_deg": delta, "law": shape["law"]},
            columns=np.column_stack(columns),
            steps={"transition_deg": 0.02 * delta},
            trials=14.0 * len(LAWS),
        )

    def unbounded(self, samples, shape, base_value=None):
        """The term of a drive that has run in: no limits by a record, no unknown start."""
        state = friction_state(samples, shape["transition_deg"], int(shape["law"]))
        return Term(self.id, dict(shape), columns=state[:, None])

    def parameters(self, term, estimate):
        if "friction_nm" in term.shape:
            at = term.width
            return {
                "half_loop_arcmin": estimate.derived(lambda v: half_loop(v, v[at], v[at + 1]), "arcmin"),
                "friction_torque": estimate.parameter(at, "Nm"),
            }
        return {
            "half_loop_arcmin": estimate.derived(lambda v: abs(v[0]), "arcmin"),
            "transition_deg": estimate.parameter(term.width, "deg"),
        }

    def sentence(self, parameters, rms_arcmin):
        if "friction_torque" in parameters:
            return (
                f"Friction of {parameters['friction_torque'].value:.2g} Nm at the output: loading and unloading lie "
                f"{2 * parameters['half_loop_arcmin'].value:.3g} arcmin apart at zero torque."
            )
        return (
            f"Friction: the two directions lie {2 * parameters['half_loop_arcmin'].value:.2g} arcmin apart; after a "
            f"reversal the error crosses over within about {parameters['transition_deg'].value:.2g} deg of output."
        )


def friction_state(samples, delta, law):
    """Friction state z in -1..1, row by row, by the `law` of that number; each pass starts from where the one before it
    ended.
    """
    cross = LAWS[NAMES[law]].cross
    state = np.empty(len(samples))
    starts = np.r_[0, np.flatnonzero((np.diff(samples.direction) != 0) | (np.diff(samples.record) != 0)) + 1]
    ends = np.r_[starts[1:], len(samples)]
    last = 0.0
    for start, end in zip(starts, ends, strict=True):
        direction = samples.direction[start]
        if samples.first[start]:
            state[start:end] = direction
        else:
            state[start:end] = direction * cross(direction * last, samples.travel[start:end] / delta)
        last = state[end - 1]
    return state
