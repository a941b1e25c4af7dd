"""hdopt: design optimization and tolerancing for harmonic drives (strain wave gears).

Everything a command does is one call: `hdopt.load_study(path)`, `hdopt.kinematic_error(study)`, ... Names are imported
when they are first used, so that `import hdopt` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_EXPORTS: dict[str, str] = {
    "load_study": "hdopt.study",
    "kinematic_error": "hdopt.analysis",
    "profile": "hdopt.analysis",
    "stack": "hdopt.tolerancing",
    "sobol": "hdopt.tolerancing",
    "allocate": "hdopt.allocation",
    "run_study": "hdopt.run",
    "diagnose": "hdopt.diagnosis",
    "read_recording": "hdopt.recording",
    "export": "hdopt.geometry.export",
    "search": "hdopt.trade",
    "HdoptError": "hdopt.errors",
}
"""Public name -> the module that has it."""

__all__ = list(_EXPORTS)


def __getattr__(name: str) -> Any:
    if name not in _EXPORTS:
        raise AttributeError(f"module 'hdopt' has no attribute {name!r}")
    return getattr(import_module(_EXPORTS[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_EXPORTS])
