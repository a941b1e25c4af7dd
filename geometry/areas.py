"""Areas of plane figures in closed form, mm^2: what the volumes of the parts are made of."""

from __future__ import annotations

import math

from hdopt.errors import HdoptError


def strip_of_disc(width: float, radius: float) -> float:
    """Area of the part of a disc of `radius` that lies in a strip of `width` through its centre."""
    half = min(width / 2, radius)
    return 2 * (half * math.sqrt(radius**2 - half**2) + radius**2 * math.asin(half / radius))


def segment_of_disc(radius: float, distance: float) -> float:
    """Area of the part of a disc of `radius` beyond a chord at `distance` from its centre."""
    if distance >= radius:
        return 0.0
    return radius**2 * math.acos(distance / radius) - distance * math.sqrt(radius**2 - distance**2)


def slot_outside_disc(width: float, reach: float, radius: float) -> float:
    """Area outside a disc of `radius` of a slot of `width` that runs from the disc's centre to `reach`."""
    half = width / 2
    if math.hypot(half, reach) <= radius:
        return 0.0
    if reach < radius:
        # Only the slot's two corners stick out; no keyway or pocket is made so.
        raise HdoptError(f"a slot that reaches {reach:.4g} mm ends inside a bore of radius {radius:.4g} mm")
    return width * reach - strip_of_disc(width, radius) / 2


def obround(length: float, width: float) -> float:
    """Area of a slot with round ends: straight over `length`, `width` across."""
    return length * width + math.pi * width**2 / 4


def round_corner(radius: float, depth: float) -> float:
    """Area between a square corner and the arc of `radius` that rounds it, over the first `depth` of its side counted
    from where the arc begins."""
    s = min(depth, radius)
    return radius * s - (s * math.sqrt(radius**2 - s**2) + radius**2 * math.asin(s / radius)) / 2
