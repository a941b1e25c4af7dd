"""Everything that may enter a fit: the catalogue's effects and the descriptions that compete with them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from hdopt.diagnosis.alternatives import alternatives
from hdopt.diagnosis.settings import DEFAULT, AlternativeSettings
from hdopt.effects import EFFECTS
from hdopt.effects.base import Explanation

STRAIN_WAVE_ONLY = tuple(effect.id for effect in EFFECTS.values() if effect.needs_strain_wave)
"""Effects at the orders of a strain wave gear's teeth and bearing: of another gear their numbers mean nothing."""


@lru_cache(maxsize=8)
def explanations(settings: AlternativeSettings = DEFAULT.alternatives) -> Mapping[str, Explanation]:
    """The catalogue and what competes with it, by id, the latter searched as `settings` say."""
    return {**EFFECTS, **{one.id: one for one in alternatives(settings)}}


SCALE = "_scale"
"""The instruments' own explanation: a ratio or an encoder's gain that is off."""
SKEW = "_skew"
"""The instruments' own too: two clocks that run apart."""
NEW_ZERO = "_zero"
"""The instruments' too: recordings that begin with a zero of their own."""
VARYING_CONTACT = "_varying_contact"
"""The drive's own as it was built: a k_e that varies round the input's turn."""
TOLD = frozenset({SCALE, SKEW, NEW_ZERO, VARYING_CONTACT})
"""Ids of what instruments do, and a drive as built, without a finding: told, never named."""
EXACT_TOLD = TOLD - {VARYING_CONTACT}
"""Ids of those whose shape is known to the last digit."""
OUTSIDE = frozenset(explanations()) - frozenset(EFFECTS) - TOLD
"""Ids of the descriptions without physics."""


def properties_of(name: str) -> Explanation:
    """The explanation called `name`, for what it says of itself: that depends on no threshold."""
    return explanations()[name]


def is_outside(name: str) -> bool:
    """Whether `name` is a description without physics."""
    return name in OUTSIDE


def is_effect(name: str) -> bool:
    """Whether `name` is an effect of the catalogue, which may be said."""
    return name in EFFECTS
