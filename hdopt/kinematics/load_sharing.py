"""What measured teeth do in mesh: the mean over the teeth in contact that share the load.

A deviation known tooth by tooth acts as p_mesh(x) = sum_j w(x - x_j) p_j / sum_j w(x - x_j), where x is the place of
the deepest point on the spline and x_j that of tooth j. The weights w are even in the middle of the window and fall to
zero at both ends as a raised cosine (Tukey's window), so that a tooth that enters makes no step. The window is as wide
as it must be for independent teeth to give 1/sqrt(Z_mp), with Z_mp = Z_CS c/(2 pi) the teeth on one side of the contact
angle c (Jia 2021, Eq. (13)). It lies evenly about the deepest point: which side carries depends on the torque, and
would shift the phase of every wave alike.

Deviations of misalignment are common to all teeth: cos psi over the same window, so that their mean is that of one wave
a turn. They are not random from tooth to tooth, and 1/sqrt(Z_mp) is not for them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.mechanics.contact_model import contact_of

TAPER = 0.5
"""Share of the window that falls off, both ends together."""
PLACES_PER_TOOTH = 12
"""Places of a table for one tooth; cubics join them."""


@dataclass(frozen=True)
class LoadSharing:
    """Weights over a window of `width` (rad of the spline) of which the share `taper` falls off; 0 weighs all alike."""

    width: float
    taper: float = TAPER

    @classmethod
    def of(cls, drive: Drive, taper: float = TAPER) -> LoadSharing:
        """The window of `drive` for which independent teeth give 1/sqrt(Z_mp), with this `taper`."""
        angle = contact_of(drive).angle
        # (integral of w)^2 over integral of w^2, for a window of width 1.
        effective = (1 - taper / 2) ** 2 / (1 - 5 * taper / 8)
        return cls(angle / effective, taper)

    def weights(self, offset: Array) -> Array:
        """Weight of a tooth `offset` (rad) beside the deepest point; same shape."""
        inside = np.abs(offset) / (self.width / 2)
        even = 1 - self.taper
        falling = np.clip((inside - even) / self.taper, 0.0, 1.0) if self.taper > 0 else np.zeros_like(inside)
        return np.where(inside <= 1, 0.5 + 0.5 * np.cos(math.pi * falling), 0.0)

    def response(self, waves: float, teeth: int) -> float:
        """What is left of the amplitude of a sine of so many `waves` a turn over `teeth`, at a tooth's own place.

        For even weights and many teeth it is sin(k c/2)/(k c/2).
        """
        offset = np.mod(2 * math.pi * np.arange(teeth) / teeth + math.pi, 2 * math.pi) - math.pi
        weights = self.weights(offset)
        return float(np.sum(weights * np.cos(waves * offset)) / np.sum(weights))

    def table(self, teeth: MeasuredTeeth) -> Array:
        """Mean over the teeth in contact on an even grid of one turn of the spline of `teeth`, mm of arc,
        (12 Z,)."""
        return np.asarray(self.tables(np.array([teeth.deviations]), teeth.first_angle)[0])

    def tables(self, deviations: Array, first_angle: float = 0.0) -> Array:
        """The same of many splines whose teeth have the cumulative `deviations` (n, Z), mm of arc, (n, 12 Z); their
        first teeth lie at `first_angle`, rad."""
        z = deviations.shape[1]
        places = np.arange(z * PLACES_PER_TOOTH).reshape(z, PLACES_PER_TOOTH)
        offset = np.mod(2 * math.pi * places / places.size - first_angle + math.pi, 2 * math.pi) - math.pi
        weights = self.weights(offset)
        # One circular convolution over the teeth for each place within a tooth.
        window = np.fft.rfft((weights / weights.sum(axis=0)).T)
        shared = np.fft.irfft(np.fft.rfft(deviations)[:, None, :] * window, z)
        return np.ascontiguousarray(shared.transpose(0, 2, 1)).reshape(len(deviations), places.size)


NO_TABLE: Array = np.empty(0)


def mesh_tables(drive: Drive) -> tuple[Array, Array]:
    """Tables of the measured teeth of CS and FS of `drive` over one turn of each spline, mm of arc; empty for a spline
    whose teeth are not measured. Raises `MissingValue` where the contact angle lacks an addendum."""
    if not drive.has_measured_teeth:
        return NO_TABLE, NO_TABLE
    sharing = LoadSharing.of(drive)
    circular = [*([] if drive.cs_teeth is None else [drive.cs_teeth]), *_out_of_round(drive)]
    return (
        np.asarray(sum(map(sharing.table, circular))) if circular else NO_TABLE,
        NO_TABLE if drive.fs_teeth is None else sharing.table(drive.fs_teeth),
    )


def _out_of_round(drive: Drive) -> tuple[MeasuredTeeth, ...]:
    """The teeth of a measured circular spline that is out of round, () where none was measured.

    The wave generator presses a tooth into a space that lies dr further out by dr less: the depth delta, whose arc is
    delta tan(alpha) (Jia 2021, Eqs. (24)-(26)), becomes delta - dr, and the tooth drives as one with the pitch
    deviation -dr tan(alpha) does. So a circular spline off-centre by e acts as an input axis off by -e. First order:
    the deepest point itself stays where the wave generator has it.
    """
    if drive.cs_roundness is None:
        return ()
    z = drive.geometry.circular_spline_teeth
    radial = drive.cs_roundness.radial(np.arange(z, dtype=np.float64) * (2 * math.pi / z))
    return (MeasuredTeeth(tuple((-math.tan(drive.geometry.pressure_angle) * radial).tolist())),)


def misalignment_share(drive: Drive) -> float:
    """What is left of the arc that misalignment makes where the teeth in contact of `drive` share it: the mean of one
    wave a turn. It is common to all teeth, so that 1/sqrt(Z_mp) is not for it."""
    return LoadSharing.of(drive).response(1, drive.geometry.circular_spline_teeth)


def mesh_range(drive: Drive) -> float:
    """How far the measured teeth of `drive` can move the driving deviation, mm of arc: the ranges of both tables, and
    what a cubic can pass the places of a table by. 0 without measured teeth."""
    from hdopt.kinematics.beat_tables import second_difference

    tables = [table for table in mesh_tables(drive) if len(table)]
    return float(sum(np.ptp(table) + second_difference(table, 1) / 2 for table in tables))
