"""From recordings to what carries a verdict: the stages in their order."""

from __future__ import annotations

from collections.abc import Sequence

from hdopt.diagnosis.checks.assessment import Evidence, assess
from hdopt.diagnosis.settings import DEFAULT, DiagnosisSettings
from hdopt.diagnosis.stages import STAGES, begin
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.recordings.read import Recording


def gather_evidence(
    recordings: Sequence[Recording],
    base: CartesianModel | None,
    seed: int,
    nuisance: Sequence[str] = (),
    settings: DiagnosisSettings = DEFAULT,
) -> Evidence:
    """Run all stages on `recordings` with the `base` model (None for a gear without one); random drives are drawn
    with `seed`, and `nuisance` names what is free beside the model (`inference.nuisance`). `settings` are the
    thresholds.
    """
    state = begin(recordings, base, seed, settings, nuisance)
    for stage in STAGES:
        state = stage(state)
    return assess(state)
