"""How the functions of the lanes are compiled: into their callers, by LLVM.

Numba's own inlining, as the other kernels have it, would type each copy anew: minutes instead of seconds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

from hdopt.kinematics import closed_form
from hdopt.kinematics.compiled_closed_form import OPTIONS

Function = TypeVar("Function", bound=Callable[..., object])


def inlined(function: Function) -> Function:
    """`function` compiled into each of its callers."""
    return cast("Function", njit(forceinline=True, **OPTIONS)(function))


rigid_motion = inlined(closed_form.rigid_motion)
motion_at = inlined(closed_form.motion_at)
rim_depth = inlined(closed_form.rim_depth)
tooth_deviation = inlined(closed_form.tooth_deviation)
