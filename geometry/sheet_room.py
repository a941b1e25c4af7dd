"""Where a text can stand on a sheet: no line runs through it, and no other text lies there."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hdopt.geometry.sheet import Label, Line, Point, Ring, Sheet, label_box

GAP = 0.3
"""What is left free round a text, mm."""

Box = tuple[float, float, float, float]
"""Left, top, right, bottom, mm."""


def is_free(sheet: Sheet, label: Label) -> bool:
    """Whether a `label` would stand on the `sheet` clear of all that is drawn so far, hatches apart."""
    left, top, right, low = label_box(label)
    return is_clear(sheet, (left - GAP, top - GAP, right + GAP, low + GAP))


def is_clear(sheet: Sheet, box: Box) -> bool:
    """Whether nothing is drawn on the `sheet` so far within a `box` (left, top, right, bottom, mm), hatches apart."""
    for mark in sheet.marks:
        if isinstance(mark, Label):
            left, top, right, low = label_box(mark)
            if left < box[2] and box[0] < right and top < box[3] and box[1] < low:
                return False
        elif isinstance(mark, Line):
            points = mark.points.tolist()
            if any(meets(start, end, box) for start, end in pairwise([*points, *points[: mark.closed]])):
                return False
        elif isinstance(mark, Ring) and _ring_meets(mark, box):
            return False
    return True


def meets(start: Point, end: Point, box: Box) -> bool:
    """Whether the straight line from `start` to `end` runs through a `box` (by its slabs along x and y)."""
    first, last = 0.0, 1.0
    for axis in (0, 1):
        low, high, step = box[axis], box[axis + 2], end[axis] - start[axis]
        if step == 0.0:
            if not low < start[axis] < high:
                return False
            continue
        one, other = sorted(((low - start[axis]) / step, (high - start[axis]) / step))
        first, last = max(first, one), min(last, other)
    return first < last


def _ring_meets(ring: Ring, box: Box) -> bool:
    x, y = ring.centre
    nearest = np.hypot(max(box[0] - x, 0.0, x - box[2]), max(box[1] - y, 0.0, y - box[3]))
    farthest = np.hypot(max(abs(box[0] - x), abs(box[2] - x)), max(abs(box[1] - y), abs(box[3] - y)))
    return bool(nearest < ring.radius < farthest)
