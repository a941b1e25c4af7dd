"""Which way the angles count: as recorded, or both turned round.

With both angles counted the other way the larger of the two zones becomes the smaller one: KE'(theta') =
min(-tau_1, -tau_2) at theta = -theta'. Turning the input angle alone stays inside the model, which has other errors
then; the sign of the error does not. So it is one bit, which the data decide where the zones switch: the same model on
the recording turned round. Torque changes its sign with the output.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.settings import OrientationSettings
from hdopt.effects import EFFECTS
from hdopt.effects.estimate import Parameter
from hdopt.effects.term import Term
from hdopt.recordings.recording import Recording

RIGHT_ANGLES_DEG = 180.0


@dataclass(frozen=True)
class Orientation:
    """The sign by which the recorded `input` and `output` angles were counted (-1: turned round), and what that was
    `decided_by`: "data", "convention" (the data leave it open), or "no model" (the gear has none to decide by).
    """

    input: int = 1
    output: int = 1
    decided_by: str = "no model"

    @property
    def turned(self) -> bool:
        """Whether the recordings were turned round."""
        return self.input < 0

    def to_dict(self) -> dict[str, object]:
        """As in the JSON."""
        return {"input": self.input, "output": self.output, "decided_by": self.decided_by}


AS_COUNTED = Orientation()
"""Before anything was asked of the data."""


def turn_round(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """`recordings` with both angles counted the other way: angle, error and torque change their sign."""
    return tuple(
        replace(
            one,
            input_angle=-one.input_angle,
            error_arcmin=-one.error_arcmin,
            torque=None if one.torque is None else -one.torque,
            scatter_arcmin=None if one.scatter_arcmin is None else -one.scatter_arcmin,
            output_zero_arcmin=-one.output_zero_arcmin,
        )
        for one in recordings
    )


def preference(as_counted: Fit, turned: Fit) -> float:
    """How much better the base explains the recording `as_counted` than `turned` round, of two fits made alike: log
    (power left turned / power left as counted). Negative where turned round is better.
    """
    return math.log(turned.objective / as_counted.objective)


def is_decisive(preferred: Sequence[float], settings: OrientationSettings) -> bool:
    """Whether the base decides by its preferences (`preferred`), alone and where asked beside smooth columns: each is
    large enough by the `settings`, and they agree. Waves of the teeth, lobes or an encoder's eccentricity that are as
    large as the base's own bend it towards either way, and beside smooth columns, which do not hold them, too.
    """
    large = all(abs(one) > settings.decisive for one in preferred)
    return large and all(one * preferred[0] > 0 for one in preferred)


def as_counted(parameters: dict[str, Parameter], term: Term) -> dict[str, Parameter]:
    """`parameters` of a `term` that was fitted turned round, in the counting of the recording: phases and angles at the
    input angle of the recording as given; a drift's sign with the error's. A wave in the zones is one of the tooth
    itself, whose height keeps its sign.
    """
    turned = {}
    for name, one in parameters.items():
        if name.startswith("phase") and one.unit == "deg":
            offset = RIGHT_ANGLES_DEG if term.in_zones else 0.0
            value = (offset - one.value + RIGHT_ANGLES_DEG) % (2 * RIGHT_ANGLES_DEG) - RIGHT_ANGLES_DEG
            one = Parameter(value, value - (one.high - one.value), value + (one.value - one.low), one.unit)
        elif name == "angle_deg":
            one = Parameter(-one.value, -one.high, -one.low, one.unit)
        elif name in EFFECTS[term.effect].signed_by_error:
            one = Parameter(-one.value, -one.high, -one.low, one.unit)
        turned[name] = one
    return turned
