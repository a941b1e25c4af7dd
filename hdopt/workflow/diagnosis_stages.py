"""What a diagnosis that runs in another thread is doing, seen from outside: its stage, and how long still."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import cache
from types import CodeType

from hdopt.workflow.frames import frames_of

SECOND_OVER_FIRST = (0.5, 3.0)
"""Time of the work on all turns, with its checks, over that on a part of them: from where much is found, and the second
search goes on from it, to where nothing is, whose sign flips take most of it."""


@cache
def _stages() -> dict[CodeType, str]:
    """What each stage does, by its code, in the order of work."""
    from hdopt.diagnosis import stages
    from hdopt.diagnosis.checks import assessment
    from hdopt.diagnosis.inference import encoder_steps

    says = {
        encoder_steps.without_output_steps: "steps of the output encoder",
        stages.begin: "first fit of the drive",
        stages.set_strong_ripple_aside: "strong ripple",
        stages.fit_time_warp: "time warp",
        stages.fit_base_in_noise: "noise, and the drive in it",
        stages.choose_orientation: "which way the angles count",
        stages.choose_orientation_at_first_look: "which way the angles count",
        stages.search_effects: "search of effects",
        stages.measure_noise_again: "noise without what was found",
        stages.search_high_orders: "tooth mesh and encoder lines",
        stages.search_without_ripple: "search without the ripple",
        stages.settle_shapes: "shapes and their intervals",
        stages.bring_drive_home: "the drive within its tolerances",
        assessment.assess: "sign flips, unseen turns and rivals",
    }
    return {work.__code__: words for work, words in says.items()}


def _part() -> CodeType:
    """The code of the diagnosis of a part of the turns."""
    from hdopt.diagnosis.nested import diagnosis_of_a_part

    return diagnosis_of_a_part.__code__


@dataclass
class DiagnosisWatch:
    """Looks at the diagnosis that the `thread` runs, which knows nothing of it."""

    thread: int
    begun: float = field(default_factory=time.monotonic)
    part_ended: float | None = None
    in_part: bool = False

    def words(self) -> str:
        """'second pass, on all turns: search of effects, 10 to 40 s more'; "" where no stage is under way."""
        stage, part = self._stage()
        now = time.monotonic()
        if part:
            self.in_part = True
            return f"first of two passes, on a part of the turns: {stage or 'the turns left out'}"
        if not stage or not self.in_part:
            return stage
        if self.part_ended is None:
            self.part_ended = now
        return f"second pass, on all turns: {stage}{self._still(now)}"

    def _still(self, now: float) -> str:
        if self.part_ended is None:
            return ""
        first, since = self.part_ended - self.begun, now - self.part_ended
        low, high = (ratio * first - since for ratio in SECOND_OVER_FIRST)
        if high < 1:
            return ""
        return f", {low:.0f} to {high:.0f} s more" if low >= 1 else f", up to {high:.0f} s more"

    def _stage(self) -> tuple[str, bool]:
        """The outermost stage under way, and whether it is on a part of the turns."""
        known, part = _stages(), _part()
        found, in_part = "", False
        for frame in frames_of(self.thread):
            found = known.get(frame.f_code, found)
            if frame.f_code is part:
                in_part = True
                break
        return found, in_part
