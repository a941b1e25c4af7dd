"""Drives with what an export needs."""

from __future__ import annotations

from dataclasses import replace

import cases

from hdopt.drive import Clearances, Drive, Structure

CLEARANCES = Clearances(backlash=0.01, cross_slide=0.02, slot_1_width=6.0, slot_2_width=6.0, disc_radius=15.0)


def drive(base: str = "ellipse", structure: Structure = Structure.INTEGRAL, **generator) -> Drive:
    """The CSF-25-80 with one of every profile and a structure, and with changes to its wave generator."""
    made = replace(cases.drive(cases.PROFILES[base], structure), clearances=CLEARANCES)
    return replace(made, wave_generator=replace(made.wave_generator, **generator))
