"""The closed form as compiled kernels call it: inlined, so that the code around it decides about rounding."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar, cast  # Any: numba's options are of several kinds

from numba import njit

from hdopt.arrays import Array
from hdopt.kinematics import closed_form
from hdopt.kinematics.closed_form import ErrorComponents, RigidMotion, TipGeometry
from hdopt.kinematics.inner import inner

Function = TypeVar("Function", bound=Callable[..., object])

# Division by zero gives an infinity that the kernels' comparisons expect; sums keep their order, so that results do not
# depend on how the compiler vectorizes.
# (Any: numba's options are of several kinds.)
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "nsz", "arcp", "afn"}}
# Without counts of arrays' users; Numba's own types do not know of it.
UNCOUNTED: dict[str, Any] = OPTIONS | {"_nrt": False}


def inlined(function: Function) -> Function:
    """`function` compiled into each of its callers. Numba's own types lose a function that takes numbers or arrays."""
    return cast("Function", njit(inline="always", **OPTIONS)(function))


def entry(function: Function) -> Function:
    """`function` compiled for Python to call: kept on disk, and run beside other threads."""
    return cast("Function", njit(cache=True, nogil=True, **OPTIONS)(function))


def compiled(function: Function) -> Function:
    """`function` for other compiled ones: LLVM puts it into each of its callers.

    It must: what stays a function of its own is compiled once for itself and once more with its caller, with other
    rounding. The process that compiles takes the first, one that loads the caller from disk the second. It may make no
    arrays, and sort none (`allocating` may). Those it is given are its caller's, so that their users need not be
    counted, which would cost some 20 cycles wherever an array is named.
    """
    return inner(forceinline=True, **UNCOUNTED)(function)


def allocating(function: Function) -> Function:
    """The same of a `function` that makes arrays."""
    return inner(forceinline=True, **OPTIONS)(function)


rigid_motion = inlined(closed_form.rigid_motion)
rim_constants = inlined(closed_form.rim_constants)
motion_at = inlined(closed_form.motion_at)
rim_depth = inlined(closed_form.rim_depth)
tooth_deviation = inlined(closed_form.tooth_deviation)


def _motion_of_row(tip: TipGeometry, row: Array) -> tuple[RigidMotion[float], float, float]:
    """The rigid motion of one drive, and the cosine and sine part (mm of arc) of its CS tooth term.

    `tip` has the wave generator's constants, `row` (12,) the errors in the order of ERROR_NAMES, mm and rad.
    """
    components = ErrorComponents(
        row[0] * math.sin(row[1]),
        row[0] * math.cos(row[1]),
        math.tan(row[3]),
        math.tan(row[2]),
        row[4] * math.cos(row[5]),
        row[4] * math.sin(row[5]),
        math.tan(row[6]),
        math.tan(row[7]),
    )
    motion = rigid_motion(tip, components)
    return motion, row[8] * math.sin(row[9]), row[8] * math.cos(row[9])


motion_of_row = inlined(_motion_of_row)
