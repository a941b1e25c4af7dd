"""Screw threads: the holes that they need, and which one suits a cam."""

from __future__ import annotations

import math

THREADS = {"M2": (2.4, 1.6), "M3": (3.4, 2.5), "M4": (4.5, 3.3), "M5": (5.5, 4.2), "M6": (6.6, 5.0), "M8": (9.0, 6.8)}
"""Coarse thread -> clearance hole (ISO 273, medium) and tap drill (ISO 2306), mm."""

THREAD_FOR_RADIUS = ((15.0, "M2"), (35.0, "M3"), (50.0, "M4"), (70.0, "M5"), (100.0, "M6"), (math.inf, "M8"))
"""Thread taken for a cam up to this radius, mm, where none is given."""
