"""What an allocation that runs in another thread is doing, seen from outside: rule, model, and how long still."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from types import CodeType, FrameType

from hdopt.workflow.frames import frames_of

FIRST = 2
"""The first convex model that is timed: the one before it may compile."""


@cache
def _stages() -> dict[CodeType, str]:
    """What each part of the work does, by its code."""
    from hdopt.allocation import rules
    from hdopt.workflow.stack import words_on_model

    says = {
        rules.allocate_by_equal_scaling: "equal scaling",
        rules.allocate_by_worst_case: "worst-case rule",
        rules.allocate_by_rss: "rss rule",
        rules.allocate_by_yield: "yield rule",
        rules.verify: "verification on a fresh sample",
        rules.yield_cost_curve: "cost over the limit",
        words_on_model: "check of the closed form",
    }
    return {work.__code__: words for work, words in says.items()}


def models_left(step: int, change: float) -> tuple[float, float]:
    """How many more convex models of an allocation there will be, from and to, where the one of number `step` changed a
    tolerance by `change`, a logarithm: each reach shrinks at best by the same factor from one model to the next, and
    there is a last one."""
    from hdopt.allocation.rules import ARRIVED, MAX_STEPS, SHRINK

    most = max(MAX_STEPS - step + 1.0, 1.0)
    return min(max(math.log(max(change, ARRIVED) / ARRIVED) / math.log(1 / SHRINK), 1.0), most), most


@dataclass
class AllocationWatch:
    """Looks at the allocation that the `thread` runs, which knows nothing of it but for the rules it tells `rules`."""

    thread: int
    begun: float = field(default_factory=time.monotonic)
    names: Sequence[str] = ()
    done: int = 0
    models: tuple[int, int, float] = (0, 0, 0.0)
    """Whose convex models are under way (the `id` of a frame), the first that was seen at work, and when: not the very
    first, which compiles."""

    def rules(self, names: Sequence[str]) -> Iterable[str]:
        """The `progress` of `hdopt.allocate`."""
        self.names = names
        for name in names:
            yield name
            self.done += 1

    def words(self) -> str:
        """'rss rule (2 of 4): model 5, 6 to 40 s more; about 40 s more for all rules'."""
        stage, models = self._looked()
        if not stage:
            return ""
        now = time.monotonic()
        of = f" ({self.done + 1} of {len(self.names)})" if self.done < len(self.names) > 1 else ""
        others = ""
        if of and self.done:
            left = (now - self.begun) * (len(self.names) - self.done) / self.done
            others = f"; about {left:.0f} s more for all rules"
        return f"{stage}{of}{self._model(models, now)}{others}"

    def _model(self, frame: FrameType | None, now: float) -> str:
        """': model 5, 6 to 40 s more' of the work of `frame`, which renews its convex model until it stays."""
        if frame is None:
            return ""
        held = frame.f_locals
        step, change = max(held.get("step", 0), 1), held.get("change")
        if self.models[0] != id(frame) or self.models[1] < FIRST:
            self.models = id(frame), step, now
        begun, since = self.models[1:]
        if step <= begun or change is None:
            return f": model {step}"
        each = (now - since) / (step - begun)
        low, high = models_left(step, change)
        return f": model {step}, {each * low:.0f} to {each * high:.0f} s more"

    def _looked(self) -> tuple[str, FrameType | None]:
        """The outermost part of the work under way, and the frame of its convex models if there is one."""
        from hdopt.allocation.rules import _successive

        known, found, models = _stages(), "", None
        for frame in frames_of(self.thread):
            found = known.get(frame.f_code, found)
            if frame.f_code is _successive.__code__:
                models = frame
        return found, models
