"""The one contact model of a drive: which of its teeth are in contact, for k_e and flank pressure alike."""

from __future__ import annotations

from hdopt.drive.geometry import Drive
from hdopt.errors import MissingValue
from hdopt.mechanics.contact import TIPS, Contact
from hdopt.mechanics.tooth_path import Mesh


def contact_of(drive: Drive) -> Contact:
    """The teeth of `drive` in contact, counted as its geometry says: tips that overlap where it says nothing.

    Raises `MissingValue` where an addendum, or for flanks that carry the backlash, is not given; `HdoptError` where the
    tips never overlap, or overlap all round.
    """
    gear = drive.geometry
    mesh = Mesh(gear, drive.wave_generator.profile)
    return mesh.contact(gear.contact or TIPS, gear.pressure_angle, drive.clearances.backlash)


def mean_flank_pressure(drive: Drive, torque: float | None = None) -> float:
    """Mean pressure on the engaged tooth flanks of `drive` under the output `torque` (N mm; the drive's own if None),
    N/mm^2: `Contact.flank_pressure` of `contact_of`. Raises `MissingValue` where torque, face width or what the contact
    needs is not given."""
    torque = drive.load.torque if torque is None else torque
    if torque is None:
        raise MissingValue("the flank pressure", "load.torque_nm")
    if drive.load.tooth_face_width is None:
        raise MissingValue("the flank pressure", "load.tooth_face_width_mm")
    return contact_of(drive).flank_pressure(torque, drive.load.tooth_face_width)
