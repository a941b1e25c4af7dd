"""The closed form as the lanes call it: inlined by LLVM.

Numba's own inlining, as the other kernels have it, would type each copy anew: minutes instead of seconds.
"""

from __future__ import annotations

from hdopt.kinematics import closed_form
from hdopt.kinematics.compiled_closed_form import compiled

rigid_motion = compiled(closed_form.rigid_motion)
motion_at = compiled(closed_form.motion_at)
rim_depth = compiled(closed_form.rim_depth)
tooth_deviation = compiled(closed_form.tooth_deviation)
