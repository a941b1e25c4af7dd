"""Small words shared by the sections: names made readable, numbers with their units."""

from __future__ import annotations

import math

from hdopt.effects import EFFECTS

ERROR_LABELS = {
    "axis_eccentricity": "Axis eccentricity",
    "axis_eccentricity_direction": "Axis eccentricity, direction",
    "axis_tilt_y": "Axis tilt along y",
    "axis_tilt_x": "Axis tilt along x",
    "wg_eccentricity": "WG eccentricity",
    "wg_eccentricity_direction": "WG eccentricity, direction",
    "wg_tilt_major": "WG tilt, major axis",
    "wg_tilt_minor": "WG tilt, minor axis",
    "cs_tooth_amplitude": "CS tooth amplitude",
    "cs_tooth_phase": "CS tooth phase",
    "fs_tooth_amplitude": "FS tooth amplitude",
    "fs_tooth_phase": "FS tooth phase",
}
"""Drive error -> how a page calls it."""

ERROR_SYMBOLS = {
    "axis_eccentricity": "e_1",
    "axis_eccentricity_direction": "β_1",
    "axis_tilt_y": "β_2",
    "axis_tilt_x": "β_3",
    "wg_eccentricity": "e_2",
    "wg_eccentricity_direction": "α_1",
    "wg_tilt_major": "α_2",
    "wg_tilt_minor": "α_3",
    "cs_tooth_amplitude": "a_CS",
    "cs_tooth_phase": "φ_CS",
    "fs_tooth_amplitude": "a_FS",
    "fs_tooth_phase": "φ_FS",
}
"""Drive error -> its symbol in Jia 2021, an underscore before what is set low."""


def label(name: str) -> str:
    """A name from the code as a heading: 'one_way_major' reads 'One-way, major axis'."""
    known = {
        "one_way_major": "One-way, major axis",
        "one_way_minor": "One-way, minor axis",
        "automatic": "Automatic alignment",
        "two_disk": "Two-disk",
    }
    if name in EFFECTS:
        return EFFECTS[name].heading
    return known.get(name, name.replace("_", " ")[:1].upper() + name.replace("_", " ")[1:])


def in_sentence(name: str) -> str:
    """The heading `name` as it stands within a sentence: its first letter small, unless it begins an abbreviation."""
    return name[:1].lower() + name[1:] if name[1:2].islower() or name[1:2] == " " else name


def short(value: float) -> str:
    """`value` in three digits, and a large number written out: '0.0153', '1784'."""
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def percent(share: float) -> str:
    """A `share` of 0 to 1 in percent, with enough digits to tell it from a whole: 99.07 %, 99.9987 %."""
    left = 100 * (1 - share)
    digits = 2 if left >= 0.01 or left <= 0 else math.ceil(-math.log10(left)) + 1
    return f"{100 * share:.{digits}f}\u00a0%"
