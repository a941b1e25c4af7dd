"""The walls that features leave between each other, in closed form, and the least one that is allowed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from hdopt.errors import HdoptError
from hdopt.geometry.features import DBore, KeywayBore
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.slide_features import Tongue

ROUNDING = 1e-9
"""What sums of given sizes may miss, mm."""

SEAT_SHARE = 0.5
"""Least share of a rim's width that chamfer and lead-in leave for the bearing."""


@dataclass(frozen=True)
class Wall:
    """Material between two features of a part, mm, and the keys of [export] that move them."""

    part: str
    between: str
    thickness: float
    keys: str
    share: float = 1.0
    """Which part of the least wall is enough here (an edge may be thinner than a wall)."""


def require_walls(parts: Sequence[Part], least: float) -> None:
    """Raise an `HdoptError` that names both features where one of `parts` that is made has a wall below `least` mm."""
    # The carrier of the bearing first: other parts' sizes follow from its width where nobody gives them.
    for part in sorted((part for part in parts if not part.context), key=lambda part: part.contour is None):
        for wall in walls_of(part):
            if wall.thickness < wall.share * least - ROUNDING:
                raise HdoptError(
                    f"{wall.part.replace('_', ' ')}: {wall.between} is {wall.thickness:.4g} mm; "
                    f"{wall.share * least:.4g} mm are needed (export.minimum_wall_mm is {least:g}); change {wall.keys}"
                )
        _require_seat(part)


def _require_seat(part: Part) -> None:
    """Chamfer and lead-in leave the bearing its seat."""
    for piece in part.body:
        if isinstance(piece, Prism) and part.contour is piece.outline:
            edges = piece.bottom_edge.axial + piece.top_edge.axial
            if piece.height - edges < SEAT_SHARE * piece.height:
                raise HdoptError(
                    f"{part.name.replace('_', ' ')}: chamfer and lead-in ({edges:.4g} mm) leave the bearing less than "
                    f"half of a rim {piece.height:.4g} mm wide; give a smaller export.chamfer_mm or "
                    "export.lead_in_length_mm, or a greater wave_generator.width_mm"
                )


def walls_of(part: Part) -> Iterator[Wall]:
    """Every wall of a part."""
    for piece in part.body:
        if isinstance(piece, Prism):
            yield from _of_prism(part, piece)
        else:
            yield from _of_tongue(part, piece)
    yield from _of_countersinks(part)


def _opening(part: Part) -> str:
    return "keyway" if isinstance(part.bore, KeywayBore) else "bore"


def _of_prism(part: Part, piece: Prism) -> Iterator[Wall]:
    yield Wall(part.name, "its axial width", piece.height, _height_keys(part))
    if piece.recesses:
        # One recess that runs into the next is no outline that a solid can be made from.
        yield Wall(part.name, "what its undercuts leave of a seat", piece.straight, _height_keys(part), 0.0)
    rim = piece.outline.least_radius - max((recess.depth for recess in piece.recesses), default=0.0)
    if piece.inner is not None:
        ring = (piece.outline.box[2] - piece.outline.box[0] - piece.inner.box[2] + piece.inner.box[0]) / 2
        yield Wall(part.name, "the ring between hole and rim", ring, "export.journal_radius_mm")
    if part.bore is not None:
        between = f"the wall between {_opening(part)} and rim"
        yield Wall(part.name, between, rim - part.bore.reach, "export.bore_mm or export.mount")
        edge = rim - max(piece.top_edge.radial, piece.bottom_edge.radial) - part.bore.radius - part.countersink
        yield Wall(part.name, "the edge between countersink and rim", edge, "export.bore_chamfer_mm", 0.5)
    if part.slot is not None and piece is part.body[0]:
        if part.slot.closed:
            keys = "clearances.disc_radius_mm"
            yield Wall(part.name, "the wall between slot and rim", rim - part.slot.mouth_reach, keys)
        floor = piece.height - part.slot.depth
        yield Wall(part.name, "the floor of the slot", floor, "export.slot_depth_mm")
    if part.bolts is not None and part.holds_bolts(piece):
        yield from _of_bolts(part, rim)


def _of_bolts(part: Part, rim: float) -> Iterator[Wall]:
    bolts = part.bolts
    assert bolts is not None
    keys = "export.bolt_circle_mm, export.bolt_thread or export.bolt_count"
    yield Wall(part.name, "the wall between bolt holes and rim", rim - bolts.radius - bolts.hole / 2, keys)
    if part.bore is not None:
        left = bolts.radius - bolts.hole / 2 - part.bore.reach
        yield Wall(part.name, f"the wall between bolt holes and {_opening(part)}", left, keys)
    if bolts.count > 1:
        web = 2 * bolts.radius * math.sin(math.pi / bolts.count) - bolts.hole
        yield Wall(part.name, "the web between two bolt holes", web, keys)


def _of_tongue(part: Part, piece: Tongue) -> Iterator[Wall]:
    yield Wall(part.name, "the width of its block", piece.width, "clearances.slot_1_width_mm or slot_2_width_mm")
    if part.bore is not None:
        left = piece.radius - part.bore.reach
        yield Wall(part.name, f"the block beside the {_opening(part)}", left, "export.bore_mm")


def _of_countersinks(part: Part) -> Iterator[Wall]:
    """What countersinks leave of the bore between them."""
    if part.bore is None or not part.countersink:
        return
    deep = part.countersink + (part.bore.depth_of_countersink if isinstance(part.bore, DBore) else 0.0)
    slot = part.slot.depth if part.slot is not None else 0.0
    left = part.top - part.bottom - len(part.countersunk) * deep - slot
    yield Wall(part.name, "the bore that its countersinks leave", left, "export.bore_chamfer_mm")


def _height_keys(part: Part) -> str:
    return {
        "hub": "export.hub_flange_thickness_mm or wave_generator.width_mm",
        "eccentric_hub": "export.hub_flange_thickness_mm or wave_generator.width_mm",
        "input_disc": "export.disc_thickness_mm",
        "floating_disc": "export.disc_thickness_mm",
    }.get(part.name, "wave_generator.width_mm")
