"""One damaged tooth: a pulse on a spline, which the driving zone meets each time that it passes.

Between teeth a deviation goes in straight lines, so that one tooth, with less on its neighbours, is a triangle over a
few pitches: sharper than any number of waves that a record supports, and a few coefficients for a controller. Each zone
meets the tooth a little before or behind its end of the major axis, by as much as the errors shift its deepest point
there: that sways once an output turn (Jia 2021, Eqs. (16)-(23)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.compensation.teeth import CELLS, Teeth
from hdopt.effects.met import Spline, off_centre
from hdopt.kinematics.cartesian import CartesianModel, rotation_of

PLACES, TIMES = 96, 3
"""Output angles at which the place of a tooth is looked up, and how often, as it depends on itself."""
COEFFICIENTS = 6
"""Of a `Pulse`: its height, half width and place, how that sways, and the zone's order."""


@dataclass(frozen=True)
class Pulse:
    """A triangle `height` arcmin high, `half_width` rad to its foot, where a + j b (input and output angle a and b)
    passes `centre` + `cos` cos b + `sin` sin b, rad, once round; in the sum of `zone` 0 or 1."""

    zone: int
    j: int
    centre: float
    cos: float
    sin: float
    half_width: float
    height: float

    def at(self, inputs: Array, outputs: Array) -> Array:
        """Error (arcmin, n) that it adds to its zone at `inputs`, `outputs` (n,) rad."""
        place = inputs + self.j * outputs - self.cos * np.cos(outputs) - self.sin * np.sin(outputs)
        return self.height * _triangle(place, self.centre, self.half_width)


@dataclass(frozen=True)
class Damage:
    """A triangle on a `spline`: `centre` and `half_width` rad, `height` mm of arc."""

    spline: Spline
    centre: float
    half_width: float
    height: float

    def table(self, row: float = 0.0) -> Array:
        """It round the spline at `CELLS` even steps, (CELLS,) mm; its mean over a `row` of so many rad about each."""
        angle = np.asarray(np.arange(CELLS) * (2 * np.pi / CELLS), float)
        count = max(1, round(row / (2 * np.pi / CELLS)) | 1) if row else 1
        offsets = (np.arange(count) - count // 2) * (2 * np.pi / CELLS)
        each = [self.height * _triangle(angle + off, self.centre, self.half_width) for off in offsets]
        return np.asarray(np.mean(each, axis=0), float)

    def on(self, teeth: Teeth, row: float = 0.0) -> Teeth:
        """`teeth` with it; its mean over a `row` rad."""
        if self.spline is Spline.CIRCULAR:
            return replace(teeth, cs=np.broadcast_to(teeth.cs, CELLS) + self.table(row))
        return replace(teeth, fs=np.broadcast_to(teeth.fs, CELLS) + self.table(row))

    def met(self, model: CartesianModel, errors: Array, sense: float) -> tuple[Pulse, ...]:
        """What a controller takes of it: its pulse in either zone of the `model` with `errors` (12,) mm."""
        b = np.asarray(np.arange(PLACES) * (2 * np.pi / PLACES), float)
        sways = np.column_stack([np.ones(PLACES), np.cos(b), np.sin(b)])
        j = int(self.spline is Spline.FLEX)
        found = []
        for zone in (0, 1):
            place = np.full(PLACES, self.centre - math.pi * zone)
            for _ in range(TIMES):
                turned = np.stack([place - j * b, place - j * b + b])
                place = self.centre - math.pi * zone - model.beyond_at(rotation_of(turned), errors)[self.spline, zone]
            centre, cos, sin = (float(one) for one in np.linalg.lstsq(sways, place, rcond=None)[0])
            height = sense * self.height * model.arcmin_per_mm
            found.append(Pulse(zone, j, centre, cos, sin, self.half_width, height))
        return tuple(found)


def _triangle(angle: Array, centre: float, half_width: float) -> Array:
    return np.asarray(np.maximum(1 - np.abs(off_centre(angle, centre, 2 * math.pi)) / half_width, 0.0), float)
