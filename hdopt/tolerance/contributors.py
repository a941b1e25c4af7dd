"""Drawing callouts, and what each lets a drive's error be.

Designers tolerance features: a coaxiality, a runout, a pitch deviation. A callout of value t (mm) allows an error of
t times a factor; the directions of several that feed one error are free, so they add as vectors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hdopt.errors import HdoptError, unknown_name

ECCENTRICITY, TILT, TOOTH = "eccentricity", "tilt", "tooth deviation"

VECTORS: dict[str, tuple[str, str, str]] = {
    "axis_eccentricity": (ECCENTRICITY, "axis_eccentricity", "axis_eccentricity_direction"),
    "wg_eccentricity": (ECCENTRICITY, "wg_eccentricity", "wg_eccentricity_direction"),
    "axis_tilt": (TILT, "axis_tilt_y", "axis_tilt_x"),
    "wg_tilt": (TILT, "wg_tilt_major", "wg_tilt_minor"),
    "cs_tooth": (TOOTH, "cs_tooth_amplitude", "cs_tooth_phase"),
    "fs_tooth": (TOOTH, "fs_tooth_amplitude", "fs_tooth_phase"),
}
"""Vector errors by name: their kind and the two errors that hold them (magnitude and direction, or both components)."""


@dataclass(frozen=True)
class Callout:
    """A kind of callout: the kind of error it feeds, and the error (mm, or rad for a tilt) that one mm of it allows."""

    kind: str
    meaning: str
    factor: Callable[[float], float]
    needs_length: bool = False


def _half(_: float) -> float:
    return 0.5


CALLOUTS: dict[str, Callout] = {
    "coaxiality": Callout(ECCENTRICITY, "diameter t of the zone: eccentricity up to t/2", _half),
    "position": Callout(ECCENTRICITY, "diameter t of the zone: eccentricity up to t/2", _half),
    "total_runout": Callout(ECCENTRICITY, "t: eccentricity t/2 where form error is nil", _half),
    "fit_clearance": Callout(ECCENTRICITY, "clearance c on diameter: eccentricity up to c/2", _half),
    "perpendicularity": Callout(TILT, "t over length l: tilt up to t/l", lambda length: 1 / length, needs_length=True),
    "parallelism": Callout(TILT, "t over length l: tilt up to t/l", lambda length: 1 / length, needs_length=True),
    "total_cumulative_pitch": Callout(TOOTH, "F_p: amplitude up to F_p/2 if it is one sine", _half),
}
"""The callouts by the name a study file uses."""


@dataclass(frozen=True)
class Contributor:
    """A named feature: its callout, value in mm, the vector error it feeds, and the length a tilt is measured over."""

    name: str
    callout: str
    value: float
    feeds: str
    length: float | None = None

    def __post_init__(self) -> None:
        where = f"contributor {self.name!r}"
        if self.callout not in CALLOUTS:
            raise HdoptError(f"{where}: {unknown_name('callout', self.callout, CALLOUTS)}")
        if self.feeds not in VECTORS:
            raise HdoptError(f"{where}: {unknown_name('error to feed', self.feeds, VECTORS)}")
        if not 0 < self.value < float("inf"):
            raise HdoptError(f"{where}: its value is {self.value!r} mm; it must be a finite number above 0")
        callout, kind = CALLOUTS[self.callout], VECTORS[self.feeds][0]
        if callout.kind != kind:
            fitting = ", ".join(name for name, (other, *_) in VECTORS.items() if other == callout.kind)
            raise HdoptError(f"{where}: {self.callout} cannot feed {self.feeds}, a {kind}; it feeds {fitting}")
        if callout.needs_length and not (self.length and self.length > 0):
            raise HdoptError(f"{where}: {self.callout} needs length_mm, the length that it is measured over")

    @property
    def error_per_mm(self) -> float:
        """Error (mm or rad) that one mm of the callout allows."""
        return CALLOUTS[self.callout].factor(self.length or 1.0)
