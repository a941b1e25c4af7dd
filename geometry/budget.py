"""One budget for what makes a wave generator eccentric or tilted: fits and position tolerances that keep its bound.

The allocation (or the study) bounds the wave generator's eccentricity e2 and its tilts alpha2 and alpha3. Here the
bound is shared out, in the worst case: a fit with the largest clearance c lets its parts lie c/2 apart and lean by c
over its length, a position zone of diameter t lets them lie t/2 apart, a perpendicularity of t over l leans by t/l.
Half of a bound goes to the fits, in equal parts: each is the loosest of `iso286.LADDER` that keeps its part. What the
fits
leave goes in equal parts to the tolerances of position or orientation. The sums never exceed the bound, unless a
clearance that the study itself gives does so; the budget then says that it is not met.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any  # Any: what a study file holds, of TOML's several kinds

from hdopt.drive.geometry import Clearances, Structure
from hdopt.errors import HdoptError
from hdopt.files import JsonReady
from hdopt.geometry.iso286 import Fit, fit_of, loosest_fit
from hdopt.geometry.part import Part, Prism
from hdopt.tolerance.contributors import CALLOUTS, ECCENTRICITY, VECTORS

CalloutTables = Mapping[str, Mapping[str, Any]]
"""A study's [contributors] as its file has them, by name: Any, for a table holds text and numbers."""
FIT_SHARE = 0.5
"""Part of a bound that the fits may use."""

STEP = 1e-4
"""Tolerances are rounded down to this, mm."""

FINEST_ZONE = 5e-4
"""A position zone below this, mm, cannot be ground or measured."""

USUAL_FIT = "H7/h6"
"""Where no tolerance bounds the eccentricity or the tilt."""


@dataclass(frozen=True)
class Joint:
    """Two parts that fit into each other: their nominal diameter and length, mm, and the option that sets the fit.

    `leans` says whether the fit's clearance lets the parts lean (a flange that is screwed on does not).
    """

    name: str
    outer: str
    inner: str
    diameter: float
    length: float
    leans: bool = True
    given: str | None = None
    play: float = 0.0
    """Clearance on diameter that the nominal sizes already have, mm."""


@dataclass(frozen=True)
class Share:
    """One line of a budget: what a fit or a tolerance may take of the bound (mm, or rad of a tilt)."""

    part: str
    feature: str
    callout: str
    takes: float
    zone: float | None = None
    """Width or diameter of the tolerance zone, mm; None for a fit."""


@dataclass(frozen=True)
class Budget:
    """A bound (mm or rad) and what it is spent on."""

    of: str
    unit: str
    allowed: float
    shares: tuple[Share, ...]

    @property
    def spent(self) -> float:
        """The worst case of all shares together."""
        return sum(share.takes for share in self.shares)

    @property
    def met(self) -> bool:
        return self.spent <= self.allowed * (1 + 1e-9)

    @property
    def verdict(self) -> str:
        """Whether it is kept; if not, what takes most, and how much of the bound is left for that."""
        factor = math.degrees(1.0) if self.unit == "deg" else 1.0
        sums = f"{self.spent * factor:.4g} of {self.allowed * factor:.4g} {self.unit}"
        if self.met:
            return f"the budget of {self.of} is kept: {sums}"
        most = max((share for share in self.shares if share.zone is None), key=lambda share: share.takes)
        others = (s.takes if s.zone is None else FINEST_ZONE * s.takes / s.zone for s in self.shares if s is not most)
        left = max(0.0, self.allowed - sum(others))
        return (
            f"the budget of {self.of} is NOT KEPT: {sums}; {most.feature} ({most.callout}) takes "
            f"{most.takes * factor:.4g} {self.unit}, {left * factor:.4g} {self.unit} are left for it at most"
        )

    def to_dict(self) -> JsonReady:
        """The budget with its unit at the names: mm, or degrees for tilts."""
        factor = math.degrees(1.0) if self.unit == "deg" else 1.0
        return {
            "of": self.of,
            "unit": self.unit,
            "allowed": self.allowed * factor,
            "spent": self.spent * factor,
            "met": self.met,
            "shares": [
                {"part": s.part, "feature": s.feature, "callout": s.callout, "takes": s.takes * factor}
                for s in self.shares
            ],
        }


@dataclass(frozen=True)
class Bounds:
    """What may be used up: eccentricity in mm and tilt in rad of the wave generator; None where nothing bounds it.

    `fit_clearance` is the play (mm on diameter) that the study's contributors give to fits; None without contributors.
    """

    eccentricity: float | None = None
    tilt: float | None = None
    fit_clearance: float | None = None


@dataclass(frozen=True)
class Plan:
    """The fits of a wave generator by joint, and the budgets that they and the position tolerances keep."""

    joints: tuple[Joint, ...]
    fits: tuple[Fit, ...]
    budgets: tuple[Budget, ...]

    def hole_of(self, part: str) -> Fit | None:
        """The fit in which a part is the hole."""
        return next((fit for joint, fit in zip(self.joints, self.fits, strict=True) if joint.outer == part), None)

    def shaft_of(self, part: str) -> Fit | None:
        """The fit in which a part is the shaft."""
        return next((fit for joint, fit in zip(self.joints, self.fits, strict=True) if joint.inner == part), None)

    def zone(self, part: str, of: str) -> float | None:
        """Smallest tolerance zone that a budget (`wg_eccentricity` or `wg_tilt`) gives to a part, mm."""
        zones = [s.zone for b in self.budgets if b.of == of for s in b.shares if s.part == part and s.zone is not None]
        return min(zones, default=None)


def bounds_from(values: Mapping[str, float], contributors: CalloutTables) -> Bounds:
    """Bounds of eccentricity and tilt from tolerances by study key (mm or deg) and from contributors.

    A contributor's own value is replaced by one under its name in `values`. Contributors that feed the wave
    generator's eccentricity or tilt take the place of that error's tolerance.
    """
    fed = {"wg_eccentricity": 0.0, "wg_tilt": 0.0}
    clearance = 0.0
    for name, spec in contributors.items():
        feeds = str(spec.get("feeds", ""))
        if feeds not in fed:
            continue
        value = float(values.get(name, spec.get("value_mm", 0.0)))
        fed[feeds] += value * CALLOUTS[spec["callout"]].factor(float(spec.get("length_mm") or 1.0))
        if spec["callout"] == "fit_clearance" and VECTORS[feeds][0] == ECCENTRICITY:
            clearance += value
    tilts = [values[key] for key in ("wg_tilt_major_deg", "wg_tilt_minor_deg") if key in values]
    return Bounds(
        fed["wg_eccentricity"] or values.get("wg_eccentricity_mm"),
        fed["wg_tilt"] or (math.radians(min(tilts)) if tilts else None),
        clearance if fed["wg_eccentricity"] else None,
    )


def joints_of(parts: Sequence[Part], given: Mapping[str, str | None]) -> tuple[Joint, ...]:
    """The joints of a wave generator's parts; `given` has the fits that the options set, by option."""
    by_name = {part.name: part for part in parts}
    holder = next(part for part in parts if part.bore and not part.clearance_hole and not part.context)
    if "hub" in by_name:
        holder = by_name["hub"]
    assert holder.bore is not None
    length = holder.top - holder.bottom
    found = [
        Joint("shaft", holder.name, "shaft", 2 * holder.bore.radius, length, True, given.get("shaft_fit")),
    ]
    if "hub" in by_name:
        cam = by_name["cam"]
        assert cam.bore is not None
        found.append(
            Joint("seat", "cam", "hub", 2 * cam.bore.radius, cam.top - cam.bottom, False, given.get("seat_fit"))
        )
    for name in ("disc_1", "disc_2"):
        if name in by_name:
            disc, journal = by_name[name].body[0], by_name["eccentric_hub"].body[1]
            assert isinstance(disc, Prism) and isinstance(journal, Prism) and disc.inner is not None
            play = disc.inner.box[2] - disc.inner.box[0] - (journal.outline.box[2] - journal.outline.box[0])
            diameter = journal.outline.box[2] - journal.outline.box[0]
            found.append(
                Joint("journal", name, "eccentric_hub", diameter, disc.height, True, given.get("seat_fit"), play)
            )
    return tuple(found)


def plan(
    structure: Structure,
    parts: Sequence[Part],
    bounds: Bounds,
    clearances: Clearances,
    given: Mapping[str, str | None],
    gap: float = 0.0,
) -> Plan:
    """The fits and position tolerances of a wave generator of this `structure`, whose `parts` are given lowest first.

    `bounds` limit its eccentricity (mm) and tilt (rad); a slide's play comes from the `clearances` of the drive.
    `given` has the fits that the options set, `gap` is the axial play of each slide, mm.
    """
    joints = joints_of(parts, given)
    carrier = next((part.name for part in reversed(parts) if part.slot is not None), "cam")
    centred = structure.passes_major or structure.passes_minor
    eccentricity = bounds.eccentricity if centred else None
    leans = sum(joint.leans for joint in joints) + len(structure.slots)
    fits = tuple(_fit(joint, len(joints), leans, eccentricity, bounds) for joint in joints)
    budgets = []
    if eccentricity is not None:
        shares = [_eccentricity_of(joint, fit) for joint, fit in zip(joints, fits, strict=True)]
        if structure.slots and clearances.cross_slide:
            text = f"clearance {clearances.cross_slide:g} across the slot"
            shares.append(Share(carrier, "slot and block", text, clearances.cross_slide / 2))
        zones = [(part.name, text) for part in parts for text in _located(part)]
        budgets.append(_filled("wg_eccentricity", "mm", eccentricity, shares, [(*zone, 0.5) for zone in zones]))
    if bounds.tilt is not None:
        leaning = [(joint, fit) for joint, fit in zip(joints, fits, strict=True) if joint.leans]
        shares = [_tilt_of(joint, fit) for joint, fit in leaning]
        if structure.slots and clearances.disc_radius:
            lean = math.atan(gap / (2 * clearances.disc_radius))
            shares += [Share(carrier, f"slide {n}", f"axial play {gap:g}", lean) for n in structure.slots]
        zones_over = [zone for part in parts for zone in _oriented(part)]
        budgets.append(_filled("wg_tilt", "deg", bounds.tilt, shares, zones_over))
    return Plan(joints, fits, tuple(budgets))


def _fit(joint: Joint, joints: int, leans: int, eccentricity: float | None, bounds: Bounds) -> Fit:
    """The fit that is given, or the loosest one that keeps its part of both bounds.

    The eccentricity is shared by `joints` fits, the tilt by `leans` fits and slides.
    """
    if joint.given is not None:
        return fit_of(joint.given, joint.diameter)
    caps = []
    if eccentricity is not None:
        caps.append(2 * FIT_SHARE * eccentricity / joints)
        if bounds.fit_clearance is not None:
            caps.append(bounds.fit_clearance / joints)
    if bounds.tilt is not None and joint.leans:
        caps.append(FIT_SHARE * bounds.tilt * joint.length / leans)
    if not caps:
        return fit_of(USUAL_FIT, joint.diameter)
    return loosest_fit(joint.diameter, min(caps) - joint.play)


def _eccentricity_of(joint: Joint, fit: Fit) -> Share:
    play = fit.largest_play + joint.play
    return Share(joint.outer, f"{joint.name} in {joint.outer}", _fit_text(fit, play), play / 2)


def _tilt_of(joint: Joint, fit: Fit) -> Share:
    play = fit.largest_play + joint.play
    text = f"{_fit_text(fit, play)} over {joint.length:.4g}"
    return Share(joint.outer, f"{joint.name} in {joint.outer}", text, math.atan(play / joint.length))


def _fit_text(fit: Fit, play: float) -> str:
    return f"{fit.nominal:g} {fit.name}, play up to {play:.4g}"


def _located(part: Part) -> list[str]:
    """The features of a part whose place about its bore makes the profile eccentric."""
    return {
        "hub": ["position of the seat about the bore"],
        "cam": ["profile of the cam about its bore or slot"],
        "eccentric_hub": ["position of the journals about the bore"],
        "disc_1": ["position of the rim about the hole"],
        "disc_2": ["position of the rim about the hole"],
        "input_disc": ["position of the block about the bore"],
    }.get(part.name, [])


def _oriented(part: Part) -> list[tuple[str, str, float]]:
    """The features of a part whose lean tilts the profile, each with the tilt in rad that 1 mm of its zone allows."""
    span = max(part.size[0], part.size[1])
    name = {
        "hub": "perpendicularity of the flange's face",
        "cam": "perpendicularity of the profile to the back",
        "eccentric_hub": "perpendicularity of the shoulder",
        "disc_1": "perpendicularity of the faces to the hole",
        "disc_2": "perpendicularity of the faces to the hole",
        "input_disc": "perpendicularity of the front face",
        "floating_disc": "parallelism of the faces",
    }.get(part.name)
    if name is None:
        return []
    if part.name == "cam" and part.bolts is None and part.bore is not None and not part.clearance_hole:
        name = "parallelism of the profile to the bore"
    length = part.top - part.bottom if part.name == "cam" else span
    return [(part.name, name, 1 / length)]


def _filled(
    of: str, unit: str, allowed: float, fits: Sequence[Share], zones: Sequence[tuple[str, str, float]]
) -> Budget:
    """The budget with what the fits leave shared out among the zones: part, name, error that 1 mm of one allows."""
    left = allowed - sum(share.takes for share in fits)
    if left <= 0:
        # The study's own clearance is beyond the bound: the zones keep their usual part, and the budget is not met.
        left = (1 - FIT_SHARE) * allowed
    left /= max(1, len(zones))
    shares = list(fits)
    for part, name, factor in zones:
        zone = round(math.floor(left / factor / STEP + 1e-9) * STEP, 6)
        shares.append(Share(part, name, f"{zone:.4g}", zone * factor, zone))
    if any(share.zone is not None and share.zone < FINEST_ZONE for share in shares):
        raise HdoptError(
            f"{of} may be {allowed * (math.degrees(1) if unit == 'deg' else 1):.4g} {unit}; shared out among "
            f"{len(shares)} features that leaves a zone below {FINEST_ZONE * 1e3:g} um, which no shop holds; "
            "give a wider tolerance or fewer joints (export.hub = false)"
        )
    return Budget(of, unit, allowed, tuple(shares))
