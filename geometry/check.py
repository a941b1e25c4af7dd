"""The check of an exported file: what was read back from disk against closed-form values and the analytic curve.

Nothing here sees the solids that were written; a file is judged by its own content. What the check allows:
- profile: `PROFILE_TOLERANCE`, ten times finer than a wire-cutting or grinding machine places a point;
- volume: the build tolerance over the part's whole surface, which is what splines that keep it can differ by;
- extents: the build tolerance and the gap that Open CASCADE puts around a box.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any  # Any: rows of what STEP says, of several kinds

import numpy as np

from hdopt.files import JsonReady
from hdopt.geometry.callouts import Callout
from hdopt.geometry.model import WaveGeneratorModel
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.part21 import Part21
from hdopt.geometry.solids import BUILD_TOLERANCE
from hdopt.geometry.step import SCHEMAS, Identity, StepFile, StepPart
from hdopt.geometry.surface import face_points, walls
from hdopt.words import counted

if TYPE_CHECKING:
    import cadquery as cq

PROFILE_TOLERANCE = 5e-5
"""Largest distance of a profile surface from the analytic curve, mm."""

BOX_GAP = 1e-7
"""What Open CASCADE adds to every side of a bounding box, mm."""

LARGEST_ANGULAR_GAP = math.radians(6)
"""A wall with a wider gap between two checked points is not closed round the axis."""

INTERFERENCE_VOLUME = 1e-6
"""A common volume above this, mm^3, is interference; touching faces have none."""


class CheckFailed(Exception):
    """A file that was written is not what it should be. `failures` has a sentence for each thing that is wrong."""

    def __init__(self, file: str, failures: Sequence[str]) -> None:
        self.failures = tuple(failures)
        super().__init__(f"{file} fails its check and was not written: " + "; ".join(failures))


@dataclass(frozen=True)
class PartCheck:
    """A part as measured in the file, beside its closed-form values."""

    name: str
    volume: float
    expected_volume: float
    size: tuple[float, float, float]
    expected_size: tuple[float, float, float]
    profile_deviation: float | None
    context: bool

    def to_dict(self) -> JsonReady:
        return {
            "name": self.name,
            "volume_mm3": self.volume,
            "expected_volume_mm3": self.expected_volume,
            "bounding_box_mm": list(self.size),
            "expected_bounding_box_mm": list(self.expected_size),
            "profile_deviation_um": None if self.profile_deviation is None else self.profile_deviation * 1e3,
            "context": self.context,
        }


@dataclass(frozen=True)
class StepCheck:
    """The outcome for one STEP file that passed."""

    parts: tuple[PartCheck, ...]

    @property
    def profile_deviation(self) -> float:
        """Largest deviation of any profile surface, mm."""
        return max(part.profile_deviation for part in self.parts if part.profile_deviation is not None)

    def to_dict(self) -> JsonReady:
        return {
            "parts": [part.to_dict() for part in self.parts],
            "max_profile_deviation_um": self.profile_deviation * 1e3,
        }


def check_step(file: StepFile, model: WaveGeneratorModel, identity: Identity, schema: str, name: str = "") -> StepCheck:
    """Compare a `file` that was read back with the `model` it is to show.

    `identity` and `schema` ("AP214" or "AP242") are what its header has to say; `name` is what the file is called in
    messages, its own name where empty. Raises `CheckFailed` with all that is wrong.
    """
    name = name or file.path.name
    failures = list(_check_header(file, identity, schema))
    names, expected = [part.name for part in file.parts], [part.name for part in model.parts]
    if sorted(names) != sorted(expected):
        failures.append(f"it holds the parts {', '.join(names) or 'none'}, not {', '.join(expected)}")
        raise CheckFailed(name, failures)
    checks = []
    for part in model.parts:
        found = next(item for item in file.parts if item.name == part.name)
        wrong, check = _check_part(found, part)
        failures += wrong
        if check:
            checks.append(check)
    if not failures:
        failures += interferences(file.parts, [part for part in model.parts if part.context])
    if failures:
        raise CheckFailed(name, failures)
    return StepCheck(tuple(checks))


def _check_header(file: StepFile, identity: Identity, schema: str) -> Iterable[str]:
    if not file.schema.startswith(SCHEMAS[schema][1]):
        yield f"its schema is {file.schema or 'not named'}, not {schema}"
    if not file.in_millimetres:
        yield "its unit of length is not the millimetre"
    # Lines of a header are broken anywhere, also at a space.
    if identity.description.replace(" ", "") not in file.header.replace(" ", ""):
        yield f"its header does not say {identity.description!r}"


def tolerance_failures(text: str, callouts: Iterable[Callout]) -> list[str]:
    """What the text of a STEP file says of tolerances that the callouts do not, or lacks; the text alone is read.

    Magnitudes are compared, for a kernel that wrote zeros would read back its own zeros as right.
    """
    found = Part21.of(text)
    wanted, sizes = [], []
    for callout in callouts:
        wanted += [(frame.symbol, frame.zone, frame.datums) for frame in callout.frames]
        sizes += [callout.size] if callout.size else []
    stated = [(item.kind, item.zone, item.datums) for item in found.tolerances()]
    failures = []
    if not _alike(sorted(wanted), sorted(stated)):
        failures.append(f"its geometric tolerances are {stated}, not {sorted(wanted)}")
    said = [(item.nominal, item.lower, item.upper) for item in found.sizes()]
    if not _alike(sorted(sizes), sorted(said)):
        failures.append(f"its sizes are {said}, not {sorted(sizes)}")
    return failures


def _alike(wanted: Sequence[tuple[Any, ...]], found: Sequence[tuple[Any, ...]]) -> bool:
    """Whether both hold the same rows, numbers to a nanometre."""
    if len(wanted) != len(found):
        return False
    for one, other in zip(wanted, found, strict=True):
        for a, b in zip(one, other, strict=True):
            if (abs(a - b) > 1e-6) if isinstance(a, float) else a != b:
                return False
    return True


def _check_part(found: StepPart, part: Part) -> tuple[list[str], PartCheck | None]:
    name = part.name
    if len(found.solids) != 1:
        return [f"{name} has {len(found.solids)} solids, not 1"], None
    (solid,) = found.solids
    failures = []
    if not _is_valid(solid):
        failures.append(f"{name} is not a valid solid")
    if not all(shell.Closed() for shell in solid.Shells()):
        failures.append(f"{name} is not closed")
    if found.colour is None or not np.allclose(found.colour, part.colour, atol=0.005):
        failures.append(f"{name} has the colour {found.colour}, not {part.colour}")

    volume, allowed = volume_of(solid), BUILD_TOLERANCE * solid.Area() + 1e-9 * part.volume
    if not abs(volume - part.volume) <= allowed:
        failures.append(f"{name} has a volume of {volume:.6f} mm^3; {part.volume:.6f} is right to {allowed:.1g}")
    box = solid.BoundingBox(tolerance=0.0)
    extent = (box.xmin, box.ymin, box.zmin, box.xmax, box.ymax, box.zmax)
    if not np.abs(np.subtract(extent, part.box)).max() <= BUILD_TOLERANCE + 2 * BOX_GAP:
        failures.append(f"{name} spans {_list(extent)} mm; {_list(part.box)} is right")

    wrong, deviation = _check_walls(solid, part)
    failures += wrong
    size = (extent[3] - extent[0], extent[4] - extent[1], extent[5] - extent[2])
    return failures, PartCheck(name, volume, part.volume, size, part.size, deviation, part.context)


def _is_valid(solid: cq.Solid) -> bool:
    """Open CASCADE's check, curves on surfaces included, at every point and not at a few."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    return bool(BRepCheck_Analyzer(solid.wrapped, True, False, True).IsValid())


def volume_of(solid: cq.Solid) -> float:
    """Volume of a `solid`, mm^3, integrated until it is sure: the usual quick rule is 6e-7 off on smoothed profiles."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid.wrapped, properties, 1e-8)
    return float(properties.Mass())


def _check_walls(solid: cq.Solid, part: Part) -> tuple[list[str], float | None]:
    """The outermost wall, and the inner one of a ring, against their analytic curves."""
    found, failures, deviation = walls(solid), [], None
    for index, contour in enumerate(part.walls):
        if index >= len(found) or found[index].largest_gap > LARGEST_ANGULAR_GAP:
            failures.append(f"{part.name} has no closed wall number {index + 1} from outside")
            continue
        off = float(np.abs(contour.deviation(found[index].points[:, :2])).max())
        deviation = max(off, deviation or 0.0)
        if not off <= PROFILE_TOLERANCE:
            failures.append(
                f"{part.name}: wall number {index + 1} from outside is {off * 1e3:.4g} um off the analytic curve; "
                f"{PROFILE_TOLERANCE * 1e3:g} um are allowed"
            )
    return failures, deviation


def interferences(parts: Sequence[StepPart], context: Sequence[Part] = ()) -> list[str]:
    """Pairs of parts that overlap, a sentence each.

    Parts that are made are intersected. The rings of the context coincide with their neighbours along spline walls,
    where intersection takes seconds a pair; points of the neighbours are looked up between the ring's contours
    instead, which its own walls were checked against.
    """
    rings = {part.name: part.body[0] for part in context if isinstance(part.body[0], Prism)}
    found = []
    for first, second in itertools.combinations(parts, 2):
        if not _boxes_meet(first, second):
            continue
        if {first.name, second.name} & set(rings):
            pairs = [(first, rings.get(second.name)), (second, rings.get(first.name))]
            inside = sum(_points_inside(part, ring) for part, ring in pairs if ring is not None)
            if inside:
                points = counted(inside, "surface point lies", "surface points lie")
                found.append(f"{first.name} and {second.name} overlap ({points} in the other)")
            continue
        volume = first.shape.intersect(second.shape).Volume()
        if volume > INTERFERENCE_VOLUME:
            found.append(f"{first.name} and {second.name} overlap by {volume:.4g} mm^3")
    return found


def _points_inside(part: StepPart, ring: Prism) -> int:
    """How many points on a part's surface lie in a ring, deeper than both their profile tolerances."""
    (solid,) = part.solids
    points = np.concatenate([face_points(solid), *(wall.points for wall in walls(solid))])
    return int(np.count_nonzero(ring.contains(points, 2 * PROFILE_TOLERANCE)))


def _boxes_meet(first: StepPart, second: StepPart) -> bool:
    a, b = first.shape.BoundingBox(), second.shape.BoundingBox()
    return all(
        getattr(a, f"{axis}min") < getattr(b, f"{axis}max") - BOX_GAP
        and getattr(b, f"{axis}min") < getattr(a, f"{axis}max") - BOX_GAP
        for axis in "xyz"
    )


def _list(values: Iterable[float]) -> str:
    return "(" + ", ".join(f"{value:.6f}" for value in values) + ")"
