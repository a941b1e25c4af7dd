"""The outlines of every part that is made, for wire cutting and milling: what goes through, and what is blind.

A machine that is given a blind slot as a closed line cuts it through. What does not go through lies therefore on a
layer whose name begins with BLIND, and a note says how far it goes. The parts lie side by side, each about its own
axis.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.geometry.arcs import outline_of, outline_of_bore, outline_of_slot, outline_of_strip
from hdopt.geometry.callouts import hole_note
from hdopt.geometry.contour import Circle, Contour
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.slide_features import Tongue

if TYPE_CHECKING:
    from hdopt.geometry.job import Job

APART = 1.15
"""Distance between two parts' axes over the sum of their radii."""


@dataclass(frozen=True)
class Outline:
    """A closed outline: its layer, what it is to follow, its area in closed form, and how far it goes where it is
    blind.

    `rows` (x, y, bulge) lie in the drawing; the part's own axis lies at x = `shift` there, mm. `part` is its name.
    """

    layer: str
    rows: Array
    area: float
    contour: Contour | None = None
    note: str = ""
    shift: float = 0.0
    part: str = ""


def all_outlines(job: Job) -> list[Outline]:
    """The outlines of all parts of a `job`: what carries the bearing first, in the middle of the drawing, the others to
    its right. Where one part carries it, its layers have no part's name at their end."""
    carriers = job.model.profiled
    others = [part for part in job.model.parts if not part.context and part not in carriers]
    found, edge = [], -math.inf
    for part in (*carriers, *others):
        radius = max(abs(value) for value in (part.box[0], part.box[1], part.box[3], part.box[4]))
        shift = 0.0 if edge == -math.inf else edge + (2 * APART - 1) * radius
        edge = shift + radius
        end = "" if len(carriers) == 1 and part in carriers else f"_{part.name.upper()}"
        for outline in _of_part(job, part):
            moved = outline.rows + np.array([shift, 0.0, 0.0])
            found.append(replace(outline, layer=outline.layer + end, rows=moved, shift=shift, part=part.name))
    return found


def _of_part(job: Job, part: Part) -> Iterator[Outline]:
    zone = job.model.profile_zone
    if part.contour is not None:
        yield _along("PROFILE", part.contour)
        yield _along("TOLERANCE_OUTER", part.contour.inward(-zone / 2))
        yield _along("TOLERANCE_INNER", part.contour.inward(zone / 2))
    elif isinstance(part.body[0], Prism):
        yield _along("OUTLINE", part.body[0].outline)
    if part.bore:
        yield Outline("BORE", outline_of_bore(part.bore), part.bore.area_with_disc(0.0))
    for inner in part.walls[1:]:
        yield _along("BORE", inner)
    for piece in part.body[1:]:
        high = f"stands {piece.height:g} high, z = {piece.bottom:g} to {piece.top:g}"
        if isinstance(piece, Tongue):
            rows = outline_of_strip(piece.width, piece.radius, piece.direction)
            yield Outline("BLIND_BLOCK", rows, piece.area, note=high)
        else:
            yield replace(_along("BLIND_STEP", piece.outline), note=high)
    if part.slot:
        deep = f"{part.slot.depth:g} deep from the back"
        slot = part.slot
        rows = outline_of_slot(slot) if slot.closed else outline_of_strip(slot.width, slot.disc_radius, slot.direction)
        yield Outline("BLIND_SLOT", rows, slot.area, note=deep)
    if part.bolts:
        hole = Circle(part.bolts.hole / 2)
        for x, y in part.bolts.centres:
            rows = outline_of(hole) + np.array([x, y, 0.0])
            yield Outline("HOLES", rows, hole.area, note=hole_note(part, job.model))


def _along(layer: str, contour: Contour) -> Outline:
    return Outline(layer, outline_of(contour), contour.area, contour)
