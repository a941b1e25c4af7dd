"""Pre-sliding friction: after each reversal the error crosses over gradually, and not at all with speed.

Dahl's model (P. Dahl, "A solid friction model", Aerospace Corp. TOR-158, 1968) with exponent 1: the friction state z
obeys dz/ds = (d - z)/delta, with s the output travel and d the direction, so z = d - (d - z_rev) exp(-s/delta) after
a reversal at z_rev. Maxwell-slip elements whose break-away distances are evenly spread up to a length delta
(Lampaert, Al-Bender, Swevers, 2003) give z = z_rev + (d - z_rev)(2 u - u^2), u = min(s/delta, 1). Rate-independent.
The error takes half_loop times z. Units: half_loop arcmin, delta deg of output angle. Prior: 0 to 5 arcmin, delta from
a sample to a pass. Where the input is locked the loop is one of torque and windup: `_friction_torque`.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms, terms_at
from hdopt.diagnosis.effects._friction_torque import friction_columns, half_loop

SHARES = (0.02, 0.05, 0.1, 0.15, 0.25, 0.4)
"""Friction torques and knees that a search tries, as shares of the torque reached."""


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
        lengths = np.geomspace(shortest, 0.2 * longest, 14)
        kinds = {}
        for kind in (0.0, 1.0):
            shapes = [{"transition_deg": d * (1 + 2 * kind), "maxwell": kind} for d in lengths]
            kinds[kind] = best_terms(probe, terms_at(self, samples, shapes))[0]
        return list(kinds.values())

    def term(self, samples, shape, base_value=None):
        if samples.locked:
            reached = float(np.max(np.abs(samples.torque)))
            shape = {name: min(max(value, 0.005 * reached), 0.9 * reached) for name, value in shape.items()}
            columns = friction_columns(samples, shape["friction_nm"], shape["knee_nm"])
            steps = {name: 0.005 * reached for name in shape}
            return Term(self.id, shape, columns=columns, steps=steps, trials=float(len(SHARES) ** 2))
        # A crossing faster than a few rows cannot be told from play.
        longest, row = float(np.max(samples.travel)), float(np.median(np.abs(np.diff(samples.travel))))
        delta = min(max(shape["transition_deg"], 2 * row), 0.25 * longest)
        state = friction_state(samples, delta, bool(shape["maxwell"]))
        columns = [state]
        if samples.first.any():
            # The state at the start of a recording is unknown: it fades over the same length.
            columns.append(np.where(samples.first, np.exp(-samples.travel / delta), 0.0))
        return Term(
            self.id,
            {"transition_deg": delta, "maxwell": shape["maxwell"]},
            columns=np.column_stack(columns),
            steps={"transition_deg": 0.02 * delta},
            trials=10.0,
        )

    def unbounded(self, samples, shape, base_value=None):
        """The term of a drive that has run in: no limits by a record, no unknown start."""
        state = friction_state(samples, shape["transition_deg"], bool(shape["maxwell"]))
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


def friction_state(samples, delta, maxwell):
    """Friction state z in -1..1, row by row; each pass starts from where the one before it ended."""
    progress = 1 - np.exp(-samples.travel / delta)
    if maxwell:
        u = np.minimum(samples.travel / delta, 1)
        progress = 2 * u - u**2
    state = np.empty(len(samples))
    starts = np.r_[0, np.flatnonzero((np.diff(samples.direction) != 0) | (np.diff(samples.record) != 0)) + 1]
    ends = np.r_[starts[1:], len(samples)]
    last = 0.0
    for start, end in zip(starts, ends, strict=True):
        direction = samples.direction[start]
        if samples.first[start]:
            state[start:end] = direction
        else:
            state[start:end] = last + (direction - last) * progress[start:end]
        last = state[end - 1]
    return state
