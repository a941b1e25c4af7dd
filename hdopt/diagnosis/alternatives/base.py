"""What every explanation without physics has in common."""

from __future__ import annotations

from hdopt.diagnosis.settings import DEFAULT, AlternativeSettings
from hdopt.effects.base import Explanation


class Alternative(Explanation):
    """A description without physics, searched as its `settings` say."""

    def __init__(self, settings: AlternativeSettings = DEFAULT.alternatives):
        self.settings = settings
