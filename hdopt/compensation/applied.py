"""How a controller applies a compensation: what every table says of itself, in plain sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hdopt.compensation.mesh import Beat
from hdopt.compensation.of_speed import Angular, OfSpeed
from hdopt.compensation.surface import Crossing, Grid, Harmonics
from hdopt.compensation.zones import Zones
from hdopt.recordings.recording import Recording

USE = "output = input/N - error, the error in arcmin at input_rad and output_rad"
_TERMS = "cos_arcmin cos(p) + sin_arcmin sin(p), p = k input_rad + j output_rad"
CROSSED = math.log(10)
"""Over so many of its lengths an exponential crosses nine tenths of its way."""


def how_applied(found: Angular | OfSpeed) -> dict[str, str]:
    """What `found` adds to the output and how it is worked out, by what is said."""
    common = found.common if isinstance(found, OfSpeed) else found
    return {"use": USE, "error": _error(found), "path": _path(common.crossing)}


def which_sum(found: Zones) -> str:
    """Which of both zones' sums of `found` drives."""
    return "larger" if found.sense > 0 else "smaller"


def crosses(crossing: Crossing) -> str:
    """How the return error crosses after a reversal by its `crossing`, in words."""
    if crossing.deg == 0:
        return "at once"
    return "in a straight line" if crossing.straight else "exponentially"


def crossing_deg(crossing: Crossing) -> float:
    """Output travel (deg) after a reversal over which the return error has crossed by its `crossing`, of an exponential
    nine tenths."""
    return crossing.deg * (1.0 if crossing.straight else CROSSED)


def how_counted(recordings: Sequence[Recording]) -> dict[str, str]:
    """How the channels of the `recordings` were read, and which were turned around, by what is said: a controller that
    reads the same counters has other signs than the table. Records of arrays say nothing of channels."""
    read = [line for line in recordings[0].understood if " = " in line]
    said = {"read": read[0]} if read else {}
    turned = [one.name for one in recordings if one.output_reversed]
    if turned:
        whose = "" if len(turned) == len(recordings) else f" of {', '.join(turned)}"
        said["turned"] = (
            f"the output{whose} was counted against the input, and is turned around here: in its own counts the output "
            "stands at -(input/N - error), and output_moved_rad is minus what it moved"
        )
    return said


def _error(found: Angular | OfSpeed) -> str:
    if isinstance(found, OfSpeed):
        return f"{_error(found.common)}; with lag_arcmin_per_input_rpm input_rpm, and what each speed has of its own"
    if isinstance(found, Zones):
        return (
            f"sum 0, with half_return_arcmin path, + the {which_sum(found)} of sums 1 and 2; every term adds {_TERMS} "
            "to its sum"
        )
    if isinstance(found, Harmonics):
        return f"half_return_arcmin path + the sum over all terms of {_TERMS}"
    return f"half_return_arcmin path + the value of the table, arcmin, {_between(found)}"


def _between(found: Grid) -> str:
    inputs, outputs = found.values.shape
    rows = f"row i stands at i/{inputs} of an input turn"
    if isinstance(found, Beat):
        return (
            f"in straight lines along the rows: {rows}, column n holds the input turn that begins at n/{outputs} of "
            "the output's turn; the first row of column n + 1 follows the last of column n"
        )
    return (
        f"in straight lines between its angles: {rows}, column j at j/{outputs} of an output turn; the first row "
        "follows the last, and so do the columns"
    )


def _path(crossing: Crossing) -> str:
    moves = {
        "at once": "is the sign of output_moved",
        "in a straight line": "grows by 2 output_moved/return_crossing_output_deg, within -1 and 1",
        "exponentially": (
            "becomes s + (path - s) exp(-|output_moved|/return_crossing_output_deg), s the sign of output_moved: nine "
            f"tenths are crossed over {crossing_deg(crossing):.3g} deg"
        ),
    }[crosses(crossing)]
    return (
        "the side of the return error, 1 forward, -1 backward, 0 unknown; kept, and after each move of the output by "
        f"output_moved (deg, forward positive) it {moves}; the recordings began with return_path_at_start times the "
        "sign of their first motion"
    )
