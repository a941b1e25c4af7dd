"""From recordings to what carries a verdict: the stages in their order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from hdopt.diagnosis.checks.assessment import Evidence, assess
from hdopt.diagnosis.inference.encoder_steps import without_output_steps
from hdopt.diagnosis.inference.input_steps import without_input_steps
from hdopt.diagnosis.nested import Part, diagnosis_of_a_part
from hdopt.diagnosis.settings import DEFAULT, DiagnosisSettings
from hdopt.diagnosis.stages import STAGES, STAGES_OF_A_PART, begin, smooth_model
from hdopt.diagnosis.state import State
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
    thresholds. Steps of coarse encoders are taken out first. All else is done once more on a part of the turns,
    and looked at on the others; what was found there is tried on all of them, and what was found on all of them there.
    """

    def run(
        some: Sequence[Recording], stages: Sequence[Callable[[State], State]], told_by: Part | None = None
    ) -> State:
        state = begin(some, base, seed, settings, nuisance)
        if told_by is not None:
            state = replace(state, guesses=told_by.guesses, guessed_ripple=told_by.ripple)
        for stage in stages:
            state = stage(state)
        return state

    recordings = without_output_steps(
        without_input_steps(recordings, settings.encoder_steps),
        lambda some: smooth_model(some, base, seed, settings, nuisance),
        settings.encoder_steps,
    )
    # First, so that what it worked with is gone before the diagnosis itself is in memory.
    part = diagnosis_of_a_part(recordings, lambda some: run(some, STAGES_OF_A_PART), seed, settings)
    if part is None:
        return assess(run(recordings, STAGES))
    state = run(recordings, STAGES, part)
    return replace(assess(state), nested=part.held_out, proposed=part.of_proposal(state))
