"""The least driving deviation near a given input angle, in lanes.

First the place moves to where second order puts it. There every branch is a parabola over the angle. Up to two changes
of the deepest rim (one a zone) part its surroundings into three stretches; on each the driving deviation is the mean of
both zones plus the size of half their gap. Of the FS phases four a stretch can win: those next to the two at which the
gap vanishes. On each the least is where the gap vanishes, where the one zone that drives is flat, or at an end.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Singles
from hdopt.kinematics.branches import TIE_MM
from hdopt.kinematics.closed_form import RigidMotion
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.candidates import TANGENT, VERTEX
from hdopt.kinematics.lanes.motion import (
    COS,
    KIND,
    MOVED,
    SIN,
    VALUE,
    Branch,
    Design,
    Place,
    Teeth,
    branch_at,
    motion_of,
    place_at,
    rim_gap,
    teeth_of,
)
from hdopt.kinematics.lanes.single import (
    HALF,
    HUGE,
    ONE,
    PI,
    TINY,
    ZERO,
    angle_of,
    clipped,
    rotated,
    sine_cosine,
    single,
)

PER_TURN = single(1 / (2 * math.pi))
"""Turns in a radian."""
GROUP = 16
"""Lanes of a group: lists are padded to whole ones."""
LONG = single(0.009)
"""A stretch that long, rad, always counts: half a place of the exact search."""
MOVE = single(0.35)
"""How far, rad, second order may move a place."""
TIE = single(TIE_MM)
"""Rims whose depths differ by less, mm, lie equally deep."""
SLIVER = single(0.1)
"""The shortest stretch between two changes of the deepest rim that is believed, as a share of its distance squared."""
REACH = single(0.12)
"""How far, rad, the parabolas are followed."""


class Stretch(NamedTuple):
    """Angles from `low` to `high` on which each zone has one deepest rim, seen from the angle 0.

    The driving deviation is mean + |half the gap|; each without FS terms with slope and curvature, mm of arc. `h` and
    `d` are half the sum and half the difference of the FS offsets o' of both zones, with their slopes.
    """

    low: float
    high: float
    mean: float
    mean1: float
    mean2: float
    gap: float
    gap1: float
    gap2: float
    h: float
    h1: float
    d: float
    d1: float


class Look(NamedTuple):
    """How far, rad, parabolas are followed, and whether the place that is looked at counts itself: where effects bend
    the zones, a parabola may lead away from it to what is no lower."""

    reach: float
    stays: bool


class Zone(NamedTuple):
    """A zone around a place: where its deepest rim changes (rad from there) and how steeply the two cross (mm/rad), the
    branches of the rim that is deepest before and after."""

    change: float
    rate: float
    before: Branch
    after: Branch


class FsTeeth(NamedTuple):
    """Amplitude of the FS teeth, mm of arc, Z_CS/Z_FS, and `stays` of `Look`."""

    size: float
    advance: float
    stays: bool


class Least(NamedTuple):
    """The least driving deviation found, mm of arc, and at which angle, rad."""

    value: float
    x: float


@compiled
def _stretch(low: float, high: float, one: Branch, two: Branch) -> Stretch:
    return Stretch(
        low,
        high,
        HALF * (one.value + two.value),
        HALF * (one.slope + two.slope),
        HALF * (one.bend + two.bend),
        HALF * (one.value - two.value),
        HALF * (one.slope - two.slope),
        HALF * (one.bend - two.bend),
        HALF * (one.offset + two.offset),
        HALF * (one.offset_slope + two.offset_slope),
        HALF * (one.offset - two.offset),
        HALF * (one.offset_slope - two.offset_slope),
    )


@compiled
def _seen_from(part: Stretch, x: float) -> Stretch:
    """The stretch as it looks from the angle x."""
    return Stretch(
        part.low - x,
        part.high - x,
        part.mean + x * (part.mean1 + HALF * x * part.mean2),
        part.mean1 + x * part.mean2,
        part.mean2,
        part.gap + x * (part.gap1 + HALF * x * part.gap2),
        part.gap1 + x * part.gap2,
        part.gap2,
        part.h + x * part.h1,
        part.h1,
        part.d + x * part.d1,
        part.d1,
    )


@compiled
def _lowest_of_phase(part: Stretch, teeth: FsTeeth, cos: float, sin: float, best: Least) -> Least:
    """The lower of `best` and the least driving deviation on a stretch for one FS phase, (cos, sin) at the angle 0."""
    fs, advance = teeth.size, teeth.advance
    rate = advance + part.d1
    mean = part.mean + fs * part.h * cos
    mean1 = part.mean1 + fs * (part.h1 * cos - part.h * rate * sin)
    gap = part.gap + fs * sin
    gap1 = part.gap1 + fs * rate * cos
    gap2 = part.gap2 - fs * rate * rate * sin
    at_low, at_high = gap + gap1 * part.low, gap + gap1 * part.high
    # A line plus the size of another is least where the steeper one vanishes, or else at the end downhill.
    vanishes = abs(gap1) > abs(mean1) and at_low * at_high < ZERO
    downhill = at_low if mean1 > ZERO else at_high
    side = ONE if downhill > ZERO else -ONE
    bend = max(part.mean2 + side * gap2, TINY)
    per = ONE / (gap1 if vanishes else bend)
    x = -(gap if vanishes else mean1 + side * gap1) * per
    x = clipped(x, part.low, part.high)
    here = mean + abs(gap)
    mean += x * (mean1 + HALF * x * part.mean2)
    gap += x * (gap1 + HALF * x * gap2)
    # What the curvature leaves of the gap moves its zero a little.
    value = mean + (-mean1 * per * gap if vanishes else abs(gap))
    if teeth.stays:
        stays = here < value
        value, x = here if stays else value, ZERO if stays else x
    less = value < best.value
    return Least(value if less else best.value, x if less else best.x)


@compiled
def _lowest_of_stretch(
    part: Stretch, fs: float, phase: float, design: Design, shortest: float, look: Look, best: Least
) -> Least:
    """The lower of `best` and the least driving deviation on a stretch, if it is longer than the shortest that counts.

    `phase` is that of one of the FS phases at the angle 0.
    """
    x = clipped(ZERO, part.low, part.high)
    part = _seen_from(part, x)
    flat = fs * (ONE - HALF * part.h * part.h)
    wanted = clipped(-part.gap / max(flat, TINY), -ONE, ONE)
    other = math.sqrt(max(ZERO, ONE - wanted * wanted))
    target = angle_of(wanted, other)
    here = phase + design.advance * x + part.d
    teeth = FsTeeth(flat, design.advance, look.stays)
    off = (here - target) * design.per_spacing
    off = (off - np.floor(off)) * design.spacing
    c, s = rotated(other, wanted, off)
    least = _lowest_of_phase(part, teeth, c, s, Least(HUGE, ZERO))
    c, s = rotated(other, wanted, off - design.spacing)
    least = _lowest_of_phase(part, teeth, c, s, least)
    off = (here - PI + target) * design.per_spacing
    off = (off - np.floor(off)) * design.spacing
    c, s = rotated(-other, wanted, off)
    least = _lowest_of_phase(part, teeth, c, s, least)
    c, s = rotated(-other, wanted, off - design.spacing)
    least = _lowest_of_phase(part, teeth, c, s, least)
    less = least.value < best.value and part.high - part.low > shortest
    return Least(least.value if less else best.value, least.x + x if less else best.x)


@compiled
def _moved(
    motion: RigidMotion[float], teeth: Teeth, design: Design, cos: float, sin: float, kind: float
) -> tuple[float, float]:
    """Where second order puts a candidate of a `kind` that lies at (cos, sin) to first order."""
    place = place_at(motion, cos, sin)
    upper, _ = rim_gap(place, design, ONE)
    lower, _ = rim_gap(place, design, -ONE)
    one = branch_at(place, motion, teeth, design, ONE, ONE if upper >= ZERO else -ONE)
    two = branch_at(place, motion, teeth, design, -ONE, ONE if lower >= ZERO else -ONE)
    gap, gap1, gap2 = one.value - two.value, one.slope - two.slope, one.bend - two.bend
    reach = teeth.fs + teeth.fs
    sign = ONE if gap > ZERO else -ONE
    side = sign if abs(gap) > reach else ZERO
    slope = one.slope + two.slope + side * gap1
    bend = one.bend + two.bend + side * gap2
    tangent = kind == TANGENT
    above = gap - sign * reach
    below = gap1 if abs(gap1) > TINY else TINY
    x = -(above if tangent else slope) / (below if tangent else max(bend, TINY))
    x = clipped(x, -MOVE, MOVE)
    x = x if tangent or kind == VERTEX else ZERO
    return rotated(cos, sin, x)


@compiled
def rim_change(place: Place, design: Design, s: float, reach: float) -> tuple[float, float, float]:
    """Where, seen from a `place` under a `design`, the deepest rim of zone `s` changes (rad, within `reach`), which is
    the deepest one before, and how steeply they cross, mm/rad."""
    gap, rate = rim_gap(place, design, s)
    changes = abs(rate) > TINY
    x = -gap / (rate if changes else ONE)
    rising = rate > ZERO if changes else gap < ZERO
    before = -ONE if rising else ONE
    return clipped(x if changes else -reach - reach, -reach, reach), (before if changes else -before), abs(rate)


@compiled
def lowest_of_branches(one: Zone, two: Zone, fs: float, phase: float, design: Design, look: Look) -> Least:
    """The least driving deviation (mm of arc) around a place, and how far from it (rad), of the branches of zones `one`
    and `two` there, under a `design`; `fs` is the FS amplitude, mm of arc, `phase` that of one of the FS phases, rad;
    `look` says how far they are followed."""
    reach = look.reach
    earlier, later = min(one.change, two.change), max(one.change, two.change)
    ahead = one.change < two.change
    of_one = _chosen(ahead, one.after, one.before)
    of_two = _chosen(ahead, two.before, two.after)
    before, after = _stretch(-reach, earlier, one.before, two.before), _stretch(later, reach, one.after, two.after)
    # Seen from afar, a stretch that short may be on the wrong side of nothing.
    shortest = min(SLIVER * abs(earlier * later) + TIE / max(min(one.rate, two.rate), TINY), LONG)
    least = _lowest_of_stretch(before, fs, phase, design, ZERO, look, Least(HUGE, ZERO))
    least = _lowest_of_stretch(_stretch(earlier, later, of_one, of_two), fs, phase, design, shortest, look, least)
    return _lowest_of_stretch(after, fs, phase, design, ZERO, look, least)


@compiled
def _lowest_at_phase(part: Stretch, fs: float, phase: float, advance: float, shortest: float, best: Least) -> Least:
    """The lower of `best` and the least driving deviation on a stretch that is longer than the shortest that counts,
    for the one FS phase that is `phase` at the angle 0."""
    x = clipped(ZERO, part.low, part.high)
    part = _seen_from(part, x)
    turns = (phase + advance * x + part.d) * PER_TURN
    sin, cos = sine_cosine(turns - np.floor(turns + HALF))
    teeth = FsTeeth(fs * (ONE - HALF * part.h * part.h), advance, True)
    least = _lowest_of_phase(part, teeth, cos, sin, Least(HUGE, ZERO))
    less = least.value < best.value and part.high - part.low > shortest
    return Least(least.value if less else best.value, least.x + x if less else best.x)


@compiled
def lowest_of_turn(one: Zone, two: Zone, fs: float, phase: float, advance: float, low: float, high: float) -> Least:
    """The same as `lowest_of_branches` of zones `one` and `two` where the FS phase is known: `phase` (rad) at the
    place; `fs` is the FS amplitude, mm of arc, `advance` Z_CS/Z_FS; branches are followed from `low` to `high`, rad."""
    earlier, later = clipped(min(one.change, two.change), low, high), clipped(max(one.change, two.change), low, high)
    ahead = one.change < two.change
    of_one = _chosen(ahead, one.after, one.before)
    of_two = _chosen(ahead, two.before, two.after)
    before, after = _stretch(low, earlier, one.before, two.before), _stretch(later, high, one.after, two.after)
    shortest = min(SLIVER * abs(earlier * later) + TIE / max(min(one.rate, two.rate), TINY), LONG)
    least = _lowest_at_phase(before, fs, phase, advance, ZERO, Least(HUGE, ZERO))
    least = _lowest_at_phase(_stretch(earlier, later, of_one, of_two), fs, phase, advance, shortest, least)
    return _lowest_at_phase(after, fs, phase, advance, ZERO, least)


@compiled
def _lowest(
    motion: RigidMotion[float], teeth: Teeth, design: Design, cos: float, sin: float, kind: float
) -> tuple[Least, float, float]:
    cos, sin = _moved(motion, teeth, design, cos, sin, kind)
    place = place_at(motion, cos, sin)
    first, k_one, rate_one = rim_change(place, design, ONE, REACH)
    second, k_two, rate_two = rim_change(place, design, -ONE, REACH)
    one_before = branch_at(place, motion, teeth, design, ONE, k_one)
    one_after = branch_at(place, motion, teeth, design, ONE, -k_one)
    two_before = branch_at(place, motion, teeth, design, -ONE, k_two)
    two_after = branch_at(place, motion, teeth, design, -ONE, -k_two)
    one, two = Zone(first, rate_one, one_before, one_after), Zone(second, rate_two, two_before, two_after)
    phase = teeth.fs_phase + design.advance * angle_of(sin, cos)
    least = lowest_of_branches(one, two, teeth.fs, phase, design, Look(REACH, False))
    cos, sin = rotated(cos, sin, least.x)
    return least, cos, sin


@compiled
def _chosen(first: bool, one: Branch, two: Branch) -> Branch:
    """The first of two branches, or else the second."""
    return Branch(
        one.value if first else two.value,
        one.slope if first else two.slope,
        one.bend if first else two.bend,
        one.offset if first else two.offset,
        one.offset_slope if first else two.offset_slope,
    )


@compiled
def fill_lowest(work: Singles, area: int, groups: int, design: Design) -> None:
    """Fill VALUE of the first `groups` groups of lanes of the `area` of `work`: the least driving deviation, mm of arc,
    near the places that it names, under a `design`."""
    for group in range(groups):
        start = area + group * GROUP
        for lane in range(GROUP):
            i = start + lane
            motion, teeth = motion_of(work, i, design), teeth_of(work, i)
            least, cos, sin = _lowest(motion, teeth, design, work[i + COS], work[i + SIN], work[i + KIND])
            work[i + VALUE], work[i + MOVED], work[i + COS], work[i + SIN] = least.value, abs(least.x), cos, sin
