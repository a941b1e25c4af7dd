"""What a diagnosis says of passes it never saw: its model on another recording, or on hidden rows of the same one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdopt.errors import HdoptError

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict import Diagnosis
    from hdopt.recording import Recording

Array = NDArray[np.float64]


def predict(diagnosis: Diagnosis, recording: Recording, extended: bool = True) -> tuple[Array, Array]:
    """KE as recorded and as the diagnosis's model predicts it, both (n,) in arcmin and free of their means.

    `extended` False leaves the effects found out. Nothing is fitted to `recording` but its zero. Of a slow sweep with a
    locked input many rows make one. Raises `HdoptError` where a drift or a time warp was fitted: they belong to one
    recording and say nothing of another.
    """
    from hdopt.diagnosis.catalogue import EXPLANATIONS
    from hdopt.diagnosis.fit import Problem, evaluate
    from hdopt.diagnosis.noise import Noise
    from hdopt.diagnosis.samples import gather

    nuisances, selection = diagnosis.evidence.nuisances, diagnosis.evidence.selection
    if nuisances.drift or nuisances.slope is not None:
        raise HdoptError(
            "a drift or time warp was fitted, which no other recording shares; diagnose without --nuisance"
        )
    fit = selection.best.fit if extended and diagnosis.effects else selection.base
    samples = gather([recording])
    bent = nuisances.blocks(samples).get("angle", np.empty((len(samples), 0)))
    problem = Problem(samples, fit.problem.base, bent, Noise.white(samples), fit.problem.prior_scale)
    bare = evaluate(problem, fit.errors, np.zeros(bent.shape[1]), (), ())
    terms = [EXPLANATIONS[t.effect].term(samples, t.shape, bare.base_value) for t in fit.terms]
    free = fit.offsets[len(fit.offsets) - bent.shape[1] :]
    expected = evaluate(problem, fit.errors, free, terms, fit.coefficients).prediction
    return samples.error - samples.error.mean(), expected - expected.mean()
