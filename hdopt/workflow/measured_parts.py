"""What is to be said of a drive's measured parts wherever they count."""

from __future__ import annotations

import math

from hdopt.drive.geometry import Drive
from hdopt.drive.profiles import MeasuredProfile
from hdopt.workflow.rough_profile import words_on_a_rough_profile


def words_on_measured_parts(drive: Drive) -> list[str]:
    """That a table of `drive` was re-centred, and by how much, or that it was not, and that a cam's points scatter: a
    sentence each, [] where no part was measured."""
    found = []
    for name, teeth in (("cs_teeth", drive.cs_teeth), ("fs_teeth", drive.fs_teeth)):
        if teeth is None:
            continue
        # A probe at a constant radius sees e/cos(alpha) of a part held e off its centre: e along the tooth's pitch and
        # e tan(alpha) across it, a quarter of a turn apart.
        held = 1000 * teeth.eccentricity * math.cos(drive.geometry.pressure_angle)
        wave = f"a first harmonic of {1000 * teeth.eccentricity:.2f} um"
        size = f"{name}: {wave}, as of a part held {held:.2f} um off-centre,"
        done = (
            f"was taken out; {name}.recentre = false keeps it"
            if teeth.recentred
            else f"is kept; {name}.recentre = true takes it out"
        )
        found.append(f"{size} {done}")
        found += [f"{name}: {doubt}" for doubt in teeth.doubts]
    profile = drive.wave_generator.profile
    if isinstance(profile, MeasuredProfile):
        found.append(
            f"wave_generator: the measured profile lies {1000 * profile.off_centre:.2f} um off its table's centre, "
            "which is kept as part of its shape, beside wg_eccentricity_mm"
        )
        found += words_on_a_rough_profile(drive)
    ring = drive.cs_roundness
    if ring is not None:
        size = f"cs_roundness: {1000 * ring.peak_to_valley:.2f} um from peak to valley up to {ring.cutoff} UPR;"
        centre = f"an eccentricity of {1000 * ring.eccentricity:.2f} um"
        done = "was taken out" if ring.recentred else "is kept and adds to axis_eccentricity_mm"
        found.append(f"{size} {centre} {done}")
    return found
