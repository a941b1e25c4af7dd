"""What another thread is in, seen from outside."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import FrameType


def frames_of(thread: int) -> Iterator[FrameType]:
    """The frames of `thread` (its identifier), innermost first; none where it has ended."""
    frame: FrameType | None = sys._current_frames().get(thread)
    while frame is not None:
        yield frame
        frame = frame.f_back
