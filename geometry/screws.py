"""Screws that hold a cam on its hub: which lengths are made, and how far they must reach into the thread.

`ENGAGEMENT` is the least length of engaged thread over the thread's diameter, for screws of class 8.8 and coarse
threads that are cut into the part: Bossard, technical section F.039, "Length of engaged thread", from trials with M6 to
M16; smaller threads are taken alike. VDI 2230 works it out from the strengths of both, which is not done here.
"""

from __future__ import annotations

import math
import re

from hdopt.errors import HdoptError

LENGTHS = (3, 4, 5, 6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50, 55, 60, 65, 70, 80)
"""Of cylinder head screws, mm (ISO 4762)."""

LONGEST = {"M2": 20, "M3": 30, "M4": 40, "M5": 50, "M6": 60, "M8": 80}
"""Of each thread, mm (ISO 4762, as the FreeCAD Fasteners workbench reprints it)."""

ENGAGEMENT = {"aluminium": 2.0, "steel or cast iron": 1.0}
"""Steel above 360 N/mm^2 and cast iron above 220 N/mm^2; aluminium alloys above 180 N/mm^2."""

_ALUMINIUM = re.compile(r"alumini?um|\bEN[ -]?AW\b|\bAW[ -]?\d|\bAl(?=[A-Z\d ]|$)", re.IGNORECASE)


def kind_of(material: str | None) -> str:
    """Which row of `ENGAGEMENT` holds for a `material`, by its name: steel unless it says aluminium; None for the usual
    steel."""
    return "aluminium" if material and _ALUMINIUM.search(material) else "steel or cast iron"


def least_engagement(thread: str, material: str | None) -> float:
    """Least length, mm, of a `thread` ("M3") that is to be engaged in a `material`."""
    return ENGAGEMENT[kind_of(material)] * float(thread[1:])


def longest_screw(thread: str, room: float) -> int | None:
    """The longest screw, mm, with this `thread` that is made and stands out of no `room` (mm below its head); None
    where there is none."""
    fits = (length for length in LENGTHS if length <= min(room + 1e-9, LONGEST[thread]))
    return max(fits, default=None)


def flange_for(thread: str, grip: float, least: float, usual: float) -> float:
    """Thickness, mm, of the flange behind a part that is `grip` mm thick: the `usual` one, or, to half a millimetre,
    what a screw with this `thread` needs that is made and engages at least `least` mm."""
    enough = (length for length in LENGTHS if grip + least - 1e-9 <= length <= LONGEST[thread])
    length = next(enough, None)
    return usual if length is None else max(usual, math.ceil(2 * (length - grip) - 1e-9) / 2)


def require_engagement(thread: str, grip: float, flange: float, material: str | None) -> None:
    """Raise an `HdoptError` where no screw with this `thread` that goes through `grip` mm and stands out of no `flange`
    (mm thick) of a `material` engages enough of it."""
    least = least_engagement(thread, material)
    length = longest_screw(thread, grip + flange)
    engaged = 0.0 if length is None else max(0.0, length - grip)
    if engaged >= least - 1e-9:
        return
    thicker = flange_for(thread, grip, least, flange)
    remedy = f"give export.hub_flange_thickness_mm = {thicker:g} or a smaller export.bolt_thread"
    if thicker == flange:
        remedy = "give a larger export.bolt_thread, whose screws are longer, or export.hub = false"
    kind = kind_of(material)
    raise HdoptError(
        f"the longest screw that does not stand out of the hub's flange, {thread} x {length}, engages {engaged:.4g} "
        f"mm of thread: it goes through {grip:.4g} mm of cam, the flange is {flange:.4g} mm thick. {least:g} mm are "
        f"needed in {kind} ({ENGAGEMENT[kind]:g} diameters); {remedy}"
    )
