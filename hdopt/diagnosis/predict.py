"""What a diagnosis says of passes it never saw: its model on another recording, or on hidden rows of the same one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis
    from hdopt.recordings.read import Recording


def predict(diagnosis: Diagnosis, recording: Recording, extended: bool = True) -> tuple[Array, Array]:
    """KE as recorded in `recording` and as the model of `diagnosis` predicts it, both (n,) in arcmin and free of their
    means.

    `extended` False leaves the effects found out. Nothing is fitted to `recording` but its zero. A ratio or gain that
    was found to be off is taken out of both. Of a slow sweep with a locked input many rows make one. Raises
    `HdoptError` where a drift or a time warp was fitted: they belong to one recording and say nothing of another.
    """
    from dataclasses import replace

    from hdopt.diagnosis.inference.fit import evaluate
    from hdopt.diagnosis.inference.noise import Noise
    from hdopt.diagnosis.inference.nuisance import coefficients
    from hdopt.diagnosis.orientation import turn_round
    from hdopt.recordings.rows import gather

    nuisances, selection = diagnosis.evidence.nuisances, diagnosis.evidence.selection
    if nuisances.drift or nuisances.slope is not None:
        raise HdoptError(
            "a drift or time warp was fitted, which no other recording shares; diagnose without --nuisance"
        )
    fit = selection.best.fit if extended and diagnosis.effects else selection.base
    turned = diagnosis.evidence.orientation.turned
    taken = nuisances.taken
    if taken is not None:
        (recording,) = (taken.turned if turned else taken).take_out([recording])
    rows = gather(turn_round([recording]) if turned else [recording])
    blocks, known = nuisances.blocks(rows), coefficients(fit, nuisances)
    shared = [kind for kind in ("angle", "scale") if kind in blocks]
    bent = np.column_stack([np.empty((len(rows), 0)), *(blocks[kind] for kind in shared)])
    problem = replace(fit.problem, rows=rows, nuisance=bent, noise=Noise.white(rows))
    bare = evaluate(problem, fit.errors, np.zeros(bent.shape[1]), (), ())
    terms = [problem.explanations[t.effect].term(rows, t.shape, bare.base_value) for t in fit.terms]
    free = np.concatenate([np.empty(0), *(known[kind] for kind in shared)])
    expected = evaluate(problem, fit.errors, free, terms, fit.coefficients).prediction
    sign = -1 if turned else 1
    return sign * (rows.error - rows.error.mean()), sign * (expected - expected.mean())
