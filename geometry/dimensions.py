"""The key dimensions of a wave generator: nominal values from its parts, tolerances from the study or an allocation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any  # Any: the tables of a study file

from hdopt.drive.errors import AMPLITUDE_NAMES, STUDY_KEYS
from hdopt.drive.geometry import Structure
from hdopt.files import JsonReady
from hdopt.geometry.budget import CalloutTables
from hdopt.geometry.callouts import FLAT_ZONE, keyway_symmetry
from hdopt.geometry.contour import Circle
from hdopt.geometry.digits import general_limits, rounded
from hdopt.geometry.din471 import ring_of
from hdopt.geometry.features import DBore, KeywayBore
from hdopt.geometry.iso286 import deviations
from hdopt.geometry.model import WaveGeneratorModel
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.slides import slides_of

ECCENTRICITY, TILTS = "wg_eccentricity_mm", ("wg_tilt_major_deg", "wg_tilt_minor_deg")
"""The errors that a wave generator's own parts make; all others come from housing, shaft and splines."""

OF_THE_WAVE_GENERATOR = ("wg_eccentricity", "wg_tilt")
"""How the vector errors that a wave generator makes begin, in [contributors]."""

WIDTH, SLOT_DEPTH, BLOCK_HEIGHT = "width", "slot, depth", "block, height"
FLANGE_TO_GROOVE = "flange to ring groove"
"""Names of the lengths along the axis in the table."""


@dataclass(frozen=True)
class Dimension:
    """One line of the table: nominal in mm (None for a callout alone), tolerance as it stands on a drawing."""

    part: str
    name: str
    nominal: float | None
    tolerance: str
    source: str
    lower: float | None = None
    upper: float | None = None
    """Deviations from the nominal size, mm; None where the tolerance is a zone."""

    def to_dict(self) -> JsonReady:
        return asdict(self)


def tolerance_bounds(data: Mapping[str, Any]) -> dict[str, float]:
    """The tolerance (mm or deg) of each error in [tolerances] of a study file's `data`: `upper`, or half the range of
    one with two signs."""
    bounds = {}
    for key, spec in data.get("tolerances", {}).items():
        if not isinstance(spec, Mapping) or "upper" not in spec:
            continue
        magnitude = STUDY_KEYS.get(key) in AMPLITUDE_NAMES
        bounds[key] = spec["upper"] if magnitude else (spec["upper"] - spec.get("lower", 0.0)) / 2
    return bounds


def key_dimensions(
    model: WaveGeneratorModel,
    width: float,
    bounds: Mapping[str, float],
    contributors: CalloutTables | None = None,
) -> tuple[Dimension, ...]:
    """The table for the parts of a `model`; `width` is the profile's, mm.

    `bounds` are tolerances by study key (mm or deg) or by contributor; `contributors` the study's callouts, which
    replace the errors they feed. A value of `bounds` under a contributor's name replaces the callout's own.
    """
    parts = model.parts
    rows = [row for part in parts if not part.context for row in _sizes(part, model)]
    return (*rows, *_slides(parts), *_location(model.structure, width, bounds, contributors or {}))


class _Rows:
    """Collects the dimensions of one part, each once."""

    def __init__(self, part: str) -> None:
        self.part = part
        self.rows: list[Dimension] = []

    def add(self, name: str, nominal: float, tolerance: str, source: str) -> None:
        self._keep(Dimension(self.part, name, nominal, tolerance, source))

    def zone(self, name: str, tolerance: str, source: str) -> None:
        self._keep(Dimension(self.part, name, None, tolerance, source))

    def limits(self, name: str, nominal: float, limits: tuple[float, float], label: str, source: str) -> None:
        """A dimension with its lower and upper deviation, mm; `label` is the tolerance class, '' without one."""
        lower, upper = limits
        text = f"±{upper:.4g}" if math.isclose(-lower, upper) else f"{_signed(upper)}/{_signed(lower)}"
        nominal = rounded(nominal, limits)
        self._keep(Dimension(self.part, name, nominal, f"{label} {text}".strip(), source, lower, upper))

    def _keep(self, row: Dimension) -> None:
        if row not in self.rows:
            self.rows.append(row)


def _signed(value: float) -> str:
    return f"{value:+.4g}" if abs(value) > 5e-8 else "0"


def _sizes(part: Part, model: WaveGeneratorModel) -> list[Dimension]:
    rows = _Rows(part.name)
    zone, first = model.profile_zone, part.body[0]
    if isinstance(part.contour, Circle):
        # Radius and offset share the zone: each may use half of it to either side.
        rows.limits("disc diameter", 2 * part.contour.radius, (-zone / 2, zone / 2), "", "profile tolerance")
    elif part.contour is not None:
        box = part.contour.box
        rows.add("major axis", box[3] - box[1], f"profile {zone:g}", "export")
        rows.add("minor axis", box[2] - box[0], f"profile {zone:g}", "export")
        # The zone bounds the outline's length: a parallel curve half a zone off is pi zones longer.
        rows.limits("perimeter", part.contour.perimeter, (-math.pi * zone, math.pi * zone), "", "profile tolerance")
    if isinstance(first, Prism):
        heights = sum(piece.height for piece in part.body if isinstance(piece, Prism))
        if isinstance(part.contour, Circle):
            rows.limits(WIDTH, heights, (-_thinner(heights), 0.0), "", "held by the ring")
        else:
            rows.limits(WIDTH, heights, general_limits(heights), "", "ISO 2768-m")
    _fitted(rows, part, model)
    key = part.bore.key if isinstance(part.bore, KeywayBore) else None
    if key is not None and isinstance(part.bore, KeywayBore):
        rows.zone("keyway, to the axis of the bore", f"symmetry {keyway_symmetry(part.bore):.4g}", "IT9 of its width")
        rows.limits("keyway, width", key.width, deviations("JS9", key.width), "JS9", "DIN 6885-1")
        depth = 2 * part.bore.radius + key.hub_depth
        rows.limits("keyway, d + t2", depth, (0.0, key.hub_depth_tolerance), "", "DIN 6885-1")
    if isinstance(part.bore, DBore):
        rows.add("flat, from the axis of the bore", part.bore.flat, f"position {FLAT_ZONE:g}", "fit")
    if part.bolts:
        name = f"circle of {part.bolts.count} holes of {part.bolts.hole:g}"
        rows.add(name, 2 * part.bolts.radius, "position 0.1", "fit")
    return rows.rows


def _thinner(thickness: float) -> float:
    """Tolerance, mm, of a disc's `thickness` (mm) and of the length that holds the discs: into the material, so that
    the ring goes into its groove."""
    return round(min(0.1, 0.05 * thickness), 2)


def _fitted(rows: _Rows, part: Part, model: WaveGeneratorModel) -> None:
    """Bores, seats and journals with the limits of their fits."""
    plan = model.plan
    hole, shaft = plan.hole_of(part.name), plan.shaft_of(part.name)
    first = part.body[0]
    if isinstance(first, Prism) and isinstance(first.inner, Circle) and hole is not None:
        rows.limits("hole for the journal", 2 * first.inner.radius, hole.hole_limits, hole.hole, "budget")
    for piece in part.body[1:]:
        if isinstance(piece, Prism) and isinstance(piece.outline, Circle) and shaft is not None:
            name = "seat" if not piece.outline.offset else "journals"
            rows.limits(name, 2 * piece.outline.radius, shaft.shaft_limits, shaft.shaft, "budget")
            if offset := abs(piece.outline.offset):
                rows.add("offset of the journals' axes", offset, f"position Ø{model.journal_zone:g}", "budget")
            if piece.groove is not None and (ring := ring_of(2 * piece.outline.radius)) is not None:
                cut, wide = ring.groove_class, ring.groove_width
                held = piece.groove.bottom - first.top
                longer = _thinner(model.profiled[0].size[2])
                rows.limits(FLANGE_TO_GROOVE, held, (0.0, longer), "", "held by the ring")
                rows.limits("ring groove, diameter", ring.groove, deviations(cut, ring.groove), cut, "DIN 471")
                rows.limits("ring groove, width", wide, deviations("H13", wide), "H13", "DIN 471")
    if part.bore is None:
        return
    diameter = 2 * part.bore.radius
    if part.clearance_hole:
        rows.limits("clearance hole", diameter, deviations("H11", diameter), "H11", "fit")
    elif hole is not None:
        rows.limits("bore", diameter, hole.hole_limits, hole.hole, "budget")


def _slides(parts: tuple[Part, ...]) -> list[Dimension]:
    """Each slot with the block that runs in it; their difference is the cross-slide's clearance."""
    found = []
    for slide in slides_of(parts):
        slot, block = _Rows(slide.above.name), _Rows(slide.below.name)
        source = f"clearance {slide.clearance:g} with its mate"
        slot.limits("slot", slide.slot.width, (0.0, slide.zone), "", source)
        slot.limits(SLOT_DEPTH, slide.slot.depth, slide.depth_limits, "", "clear of the block")
        block.limits("block", slide.block.width, (-slide.zone, 0.0), "", source)
        block.limits(BLOCK_HEIGHT, slide.block.height, slide.height_limits, "", "clear of the slot")
        found += slot.rows + block.rows
    return found


def _location(
    structure: Structure, width: float, bounds: Mapping[str, float], contributors: CalloutTables
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
        zone = f"axis within diameter {2 * bounds[ECCENTRICITY]:.4g}"
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
