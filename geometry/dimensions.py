"""The key dimensions of a wave generator: nominal values from its parts, tolerances from the study or an allocation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from hdopt.deviations import AMPLITUDE_NAMES, STUDY_KEYS
from hdopt.drive import Structure
from hdopt.errors import HdoptError
from hdopt.geometry.contour import Circle
from hdopt.geometry.features import DBore, KeywayBore
from hdopt.geometry.part import Part, Prism, Tongue

ECCENTRICITY, TILTS = "wg_eccentricity_mm", ("wg_tilt_major_deg", "wg_tilt_minor_deg")
"""The errors that a wave generator's own parts make; all others come from housing, shaft and splines."""

OF_THE_WAVE_GENERATOR = ("wg_eccentricity", "wg_tilt")
"""How the vector errors that a wave generator makes begin, in [contributors]."""


@dataclass(frozen=True)
class Dimension:
    """One line of the table: nominal in mm (None for a callout alone), tolerance as it stands on a drawing."""

    part: str
    name: str
    nominal: float | None
    tolerance: str
    source: str

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def tolerance_bounds(data: Mapping[str, Any]) -> dict[str, float]:
    """The tolerance of each error in a study file's [tolerances]: `upper`, or half the range of one with two signs."""
    bounds = {}
    for key, spec in data.get("tolerances", {}).items():
        if not isinstance(spec, Mapping) or "upper" not in spec:
            continue
        magnitude = STUDY_KEYS.get(key) in AMPLITUDE_NAMES
        bounds[key] = spec["upper"] if magnitude else (spec["upper"] - spec.get("lower", 0.0)) / 2
    return bounds


def allocated_bounds(result: Mapping[str, Any]) -> dict[str, float]:
    """The tolerances in the JSON of `hdopt allocate`: every named entry that has a `tolerance`."""
    found: dict[str, float] = {}

    def visit(name: str, value: Any) -> None:
        if isinstance(value, Mapping):
            if isinstance(value.get("tolerance"), int | float):
                found[name] = float(value["tolerance"])
            for key, item in value.items():
                visit(str(key), item)

    visit("", result)
    if not found:
        raise HdoptError("the allocation holds no tolerances; give the JSON that `hdopt allocate --json FILE` wrote")
    return found


def key_dimensions(
    structure: Structure,
    parts: tuple[Part, ...],
    width: float,
    profile_zone: float,
    bounds: Mapping[str, float],
    contributors: Mapping[str, Mapping[str, Any]] | None = None,
) -> tuple[Dimension, ...]:
    """The table for a wave generator's `parts`; `width` is the profile's and `profile_zone` its tolerance zone's, mm.

    `bounds` are tolerances by study key (mm or deg) or by contributor; `contributors` the study's callouts, which
    replace the errors they feed. A value of `bounds` under a contributor's name replaces the callout's own.
    """
    rows = [row for part in parts if not part.context for row in _sizes(part, profile_zone)]
    return (*rows, *_slides(parts), *_location(structure, width, bounds, contributors or {}))


def _sizes(part: Part, zone: float) -> list[Dimension]:
    rows = []

    def add(name: str, nominal: float, tolerance: str, source: str) -> None:
        row = Dimension(part.name, name, nominal, tolerance, source)
        if row not in rows:
            rows.append(row)

    if isinstance(part.contour, Circle):
        add("disc diameter", 2 * part.contour.radius, "h6", "export")
        add("offset of the disc's axis", abs(part.contour.offset), f"±{zone / 2:g}", "export")
    elif part.contour is not None:
        box = part.contour.box
        add("major axis", box[3] - box[1], f"profile {zone:g}", "export")
        add("minor axis", box[2] - box[0], f"profile {zone:g}", "export")
    first = part.body[0]
    if isinstance(first, Prism):
        heights = sum(piece.height for piece in part.body if isinstance(piece, Prism))
        add("width", heights, "ISO 2768-m", "general")
        if isinstance(first.inner, Circle):
            add("hole for the journal", 2 * first.inner.radius, "H7", "fit")
    for piece in part.body[1:]:
        if isinstance(piece, Prism) and isinstance(piece.outline, Circle):
            add("seat" if not piece.outline.offset else "journals", 2 * piece.outline.radius, "h6", "fit")
    if part.clearance_hole:
        add("clearance hole", 2 * part.bore.radius, "H13", "fit")
    elif part.bore:
        add("bore", 2 * part.bore.radius, "H7", "fit")
    if isinstance(part.bore, KeywayBore):
        key = part.bore.key
        add("keyway, width", key.width, "JS9", "DIN 6885-1")
        add("keyway, d + t2", 2 * part.bore.radius + key.hub_depth, f"+{key.hub_depth_tolerance:g}/0", "DIN 6885-1")
    if isinstance(part.bore, DBore):
        add("flat to the far side of the bore", part.bore.radius + part.bore.flat, "+0.05/0", "fit")
    if part.bolts:
        add(f"circle of {part.bolts.count} holes of {part.bolts.hole:g}", 2 * part.bolts.radius, "position 0.1", "fit")
    return rows


def _slides(parts: tuple[Part, ...]) -> list[Dimension]:
    """Each slot with the block that runs in it; their difference is the cross-slide's clearance."""
    rows = []
    for below, above in itertools.pairwise(parts):
        block = below.body[-1]
        if isinstance(block, Tongue) and above.slot:
            clearance = above.slot.width - block.width
            share = f"clearance {clearance:g} in all"
            rows.append(Dimension(above.name, "slot", above.slot.width, share, "clearances"))
            rows.append(Dimension(below.name, "block", block.width, share, "clearances"))
    return rows


def _location(
    structure: Structure, width: float, bounds: Mapping[str, float], contributors: Mapping[str, Mapping[str, Any]]
) -> list[Dimension]:
    """What keeps the profile central and upright: the study's callouts, or what its errors allow."""
    rows, fed = [], set()
    for name, spec in contributors.items():
        feeds = str(spec.get("feeds", ""))
        if not feeds.startswith(OF_THE_WAVE_GENERATOR):
            continue
        fed.add(next(start for start in OF_THE_WAVE_GENERATOR if feeds.startswith(start)))
        value = bounds.get(name, spec.get("value_mm", spec.get("value")))
        text = f"{str(spec.get('callout', '')).replace('_', ' ')} {value:.4g}"
        if spec.get("length_mm"):
            text += f" over {spec['length_mm']:g}"
        rows.append(Dimension("assembly", name.replace("_", " "), None, text, f"contributor {name}"))
    if "wg_eccentricity" not in fed and ECCENTRICITY in bounds:
        zone = f"coaxiality diameter {2 * bounds[ECCENTRICITY]:.4g}"
        if not (structure.passes_major or structure.passes_minor):
            zone = "free: the slides take it up"
        rows.append(Dimension("assembly", "profile to input axis", None, zone, ECCENTRICITY))
    if "wg_tilt" not in fed:
        for key, axis in zip(TILTS, ("major", "minor"), strict=True):
            if key in bounds:
                lean = width * math.tan(math.radians(bounds[key]))
                text = f"parallelism {lean:.4g} over {width:g}"
                rows.append(Dimension("assembly", f"profile to input axis, along {axis}", None, text, key))
    return rows
