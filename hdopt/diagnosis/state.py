"""What the stages of a diagnosis hand on: recordings, fits, noise and what was found so far."""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.fit import Fit, FitProblem
from hdopt.diagnosis.inference.nuisance import Nuisances
from hdopt.diagnosis.orientation import AS_COUNTED, Orientation
from hdopt.diagnosis.search.guess import Guess, guess_of
from hdopt.diagnosis.search.search_state import SearchState
from hdopt.diagnosis.search.subset_search import Selection
from hdopt.diagnosis.settings import DiagnosisSettings
from hdopt.recordings.read import Recording


@dataclass(frozen=True)
class State:
    """Where a diagnosis stands.

    `recordings` with their errors about one zero; the `nuisances` beside every model and the effects `ruled_out`; the
    best `base` fit; `clean`, one less bent towards what is missing (None for a gear without a base), and `wavy`, one
    beside smooth columns and waves of the teeth (None where those are not needed); the
    `selection` of explanations (the base alone, before any was looked for) and what they leave: the selection of
    `high` orders on the rows as recorded (None where none can be held) and what its best adds to these rows,
    (n,) arcmin (`ripple`, None for nothing). `inflation` says how much rougher the noise is than its model. `rng` is
    the stream of random drives: a stage draws from a copy (`draws`) and hands that on, so that it can be run again.
    `orientation` says which way the angles were counted: `recordings` and everything after stand as counted there.
    `searched`: whether the `selection` is that of a search in the noise that stands here; `looked` is where one stands
    after its first look about this base in this noise (None: not begun). `guesses` are what was found elsewhere and is
    tried here too, and so is the `guessed_ripple`.
    """

    recordings: tuple[Recording, ...]
    nuisances: Nuisances
    ruled_out: tuple[str, ...]
    base: Fit
    clean: Fit | None
    selection: Selection
    high: Selection | None
    ripple: Array | None
    inflation: float
    rng: np.random.Generator
    orientation: Orientation = AS_COUNTED
    searched: bool = False
    looked: SearchState | None = None
    guesses: tuple[Guess, ...] = ()
    guessed_ripple: Guess | None = None
    wavy: Fit | None = None

    @property
    def problem(self) -> FitProblem:
        """Rows, model and noise as they stand."""
        return self.base.problem

    @property
    def settings(self) -> DiagnosisSettings:
        """Thresholds of this diagnosis."""
        return self.problem.settings

    def draws(self) -> np.random.Generator:
        """A copy of the random stream."""
        return copy.deepcopy(self.rng)

    def as_guesses(self) -> tuple[Guess, ...]:
        """What the search found, the best first, to be tried on other rows of these recordings."""
        return tuple(guess_of(fit, self.orientation.turned) for fit in self.selection.leaders)

    def ripple_as_guess(self) -> Guess | None:
        """The ripple that was found, inside the zones or beside them, to be tried on other rows of these recordings;
        None without one.
        """
        return None if self.high is None else guess_of(self.high.best.fit, self.orientation.turned)

    def found(self, selection: Selection) -> State:
        """The state with the `selection` of a search, whose base may be a better one."""
        return replace(self, selection=selection, base=selection.base)
