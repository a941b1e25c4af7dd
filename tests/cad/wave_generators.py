"""Drives with what an export needs."""

from __future__ import annotations

from dataclasses import replace

import cases

from hdopt.drive.geometry import Clearances, Drive, Structure
from hdopt.drive.profiles import Ellipse, TwoDisk

CLEARANCES = Clearances(backlash=0.01, cross_slide=0.02, slot_1_width=6.0, slot_2_width=6.0, disc_radius=15.0)


def drive(base: str = "ellipse", structure: Structure = Structure.INTEGRAL, **generator) -> Drive:
    """The CSF-25-80 with one of every profile and a structure, and with changes to its wave generator."""
    made = replace(cases.drive(cases.PROFILES[base], structure), clearances=CLEARANCES)
    return replace(made, wave_generator=replace(made.wave_generator, **generator))


def scaled(made: Drive, scale: float) -> Drive:
    """A drive with an ellipse or a two-disk profile `scale` times as large; the cross-slide clearance stays."""
    generator, clear = made.wave_generator, made.clearances
    profile = generator.profile
    if isinstance(profile, TwoDisk):
        larger = TwoDisk(scale * profile.undeformed_radius, scale * profile.max_deflection, profile.wrap_angle)
    else:
        larger = Ellipse(scale * profile.semi_major, scale * profile.semi_minor)
    widths = {name: scale * getattr(clear, name) for name in ("slot_1_width", "slot_2_width", "disc_radius")}
    return replace(
        made,
        wave_generator=replace(
            generator,
            profile=larger,
            width=scale * generator.width,
            bearing_thickness=scale * generator.bearing_thickness,
        ),
        clearances=replace(clear, **widths),
    )
