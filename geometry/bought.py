"""What is bought for a wave generator: the screws that hold the cam on its hub, the ring that holds the discs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hdopt.geometry.din471 import Ring, ring_of
from hdopt.geometry.part import Prism
from hdopt.geometry.screws import longest_screw
from hdopt.geometry.threads import THREADS

if TYPE_CHECKING:
    from hdopt.geometry.job import Job


@dataclass(frozen=True)
class Screws:
    """`count` screws with a `thread`, `length` mm, `engaged` mm of it in the hub's thread.

    Their axes lie `radius` mm from that of the wave generator. They stand with their heads on the cam's front,
    at z = `top`, and reach down to z = `bottom` at most.
    """

    count: int
    thread: str
    length: int
    engaged: float
    radius: float
    bottom: float
    top: float

    @property
    def words(self) -> tuple[str, str, str]:
        """Name, number and material in the parts list."""
        name = f"screw, {self.count} off, {round(self.engaged, 1):g} mm in thread"
        return name, f"ISO 4762 - {self.thread} × {self.length}", "steel 8.8"


@dataclass(frozen=True)
class HeldRing:
    """A retaining `ring` in its groove with its lower wall at z = `bottom`, on a journal `offset` mm off the axis."""

    ring: Ring
    bottom: float
    offset: float

    @property
    def words(self) -> tuple[str, str, str]:
        """Name, number and material in the parts list."""
        return "retaining ring", self.ring.name, "spring steel"


def bought(job: Job) -> list[Screws | HeldRing]:
    """What is bought for a `job`, in the order of the parts list."""
    found: list[Screws | HeldRing] = []
    by_name = {part.name: part for part, _ in job.made}
    hub, cam = by_name.get("hub"), by_name.get("cam")
    if hub is not None and cam is not None and hub.bolts is not None and cam.bolts is not None:
        room = cam.top - hub.bottom
        thread = next(name for name, (hole, _) in THREADS.items() if abs(hole - cam.bolts.hole) < 1e-9)
        length = longest_screw(thread, room)
        assert length is not None  # the flange is thick enough for one
        engaged = length - (cam.top - cam.bottom)
        found.append(Screws(hub.bolts.count, thread, length, engaged, hub.bolts.radius, hub.bottom, cam.top))
    for part, _ in job.made:
        for piece in part.body:
            if isinstance(piece, Prism) and piece.groove is not None:
                ring = ring_of(piece.outline.box[2] - piece.outline.box[0])
                assert ring is not None
                offset = (piece.outline.box[1] + piece.outline.box[3]) / 2
                found.append(HeldRing(ring, piece.groove.bottom, offset))
    return found
