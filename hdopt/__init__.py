"""hdopt: design optimization and tolerancing for harmonic drives (strain wave gears).

Everything a command does is one call: `hdopt.load_study(path)`, `hdopt.kinematic_error(study)`, ... Names are imported
when they are first used, so that `import hdopt` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_EXPORTS: dict[str, str] = {
    "load_study": "hdopt.study",
    "kinematic_error": "hdopt.workflow.kinematic_error",
    "profile": "hdopt.workflow.kinematic_error",
    "stack": "hdopt.workflow.stack",
    "sobol": "hdopt.workflow.stack",
    "screen": "hdopt.workflow.stack",
    "allocate": "hdopt.workflow.allocate",
    "run_study": "hdopt.workflow.run",
    "diagnose": "hdopt.diagnosis",
    "read_recording": "hdopt.recordings.read",
    "export": "hdopt.workflow.export",
    "compare": "hdopt.workflow.compare",
    "search": "hdopt.workflow.search",
    "HdoptError": "hdopt.errors",
    "Study": "hdopt.study",
    "Drive": "hdopt.drive.geometry",
    "DriveGeometry": "hdopt.drive.geometry",
    "WaveGenerator": "hdopt.drive.geometry",
    "DriveErrors": "hdopt.drive.errors",
    "KinematicErrorResult": "hdopt.workflow.kinematic_error",
    "ProfileResult": "hdopt.workflow.kinematic_error",
    "StackResult": "hdopt.tolerance.results",
    "SobolResult": "hdopt.tolerance.results",
    "Screening": "hdopt.tolerance.screening",
    "AllocateResult": "hdopt.allocation.results",
    "SearchResult": "hdopt.optimize.records",
    "RunResult": "hdopt.workflow.run",
}
"""Public name -> the module that has it."""

__all__ = list(_EXPORTS)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("hdopt")
    if name not in _EXPORTS:
        raise AttributeError(f"module 'hdopt' has no attribute {name!r}")
    return getattr(import_module(_EXPORTS[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_EXPORTS])
