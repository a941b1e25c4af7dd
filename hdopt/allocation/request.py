"""What is asked of an allocation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdopt.parallel.engine import Engine


@dataclass(frozen=True)
class AllocationRequest:
    """What is asked of an allocation: the rule, whether the others stand beside it, the limits of the cost curve as
    multiples of the requirement, and how the one verification is made."""

    rule: str
    compare: bool
    curve: tuple[float, ...]
    verify_n: int
    seed: int
    engine: Engine | str | None = None

    @property
    def verification_seed(self) -> int:
        """The seed of the one verification: fixed by the run's seed, and none that the design has used."""
        return int(np.random.SeedSequence([self.seed, 0x7E5]).generate_state(1)[0])
