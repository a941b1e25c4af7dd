"""hdopt: design optimization and tolerancing for harmonic drives (strain wave gears).

Everything a command does is one call, which takes a study, its name or its path: `hdopt.kinematic_error("csf-25-80")`;
docs/python.md lists them. Names are imported when they are first used, so that `import hdopt` costs nothing.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any  # Any: whatever of the package is asked for by name

if TYPE_CHECKING:
    from hdopt.allocation.results import AllocateResult as AllocateResult
    from hdopt.diagnosis.settings import DiagnosisSettings as DiagnosisSettings
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis as Diagnosis
    from hdopt.diagnosis.verdict.many import DiagnosedBatch as DiagnosedBatch
    from hdopt.diagnosis.verdict.named_effect import NamedEffect as NamedEffect
    from hdopt.drive.errors import DriveErrors as DriveErrors
    from hdopt.drive.geometry import Drive as Drive
    from hdopt.drive.geometry import DriveGeometry as DriveGeometry
    from hdopt.drive.geometry import WaveGenerator as WaveGenerator
    from hdopt.errors import HdoptError as HdoptError
    from hdopt.files import write_tables as write_tables
    from hdopt.geometry.export import ExportResult as ExportResult
    from hdopt.optimize.records import SearchResult as SearchResult
    from hdopt.recordings.bench import Bench as Bench
    from hdopt.recordings.read import read_recording as read_recording
    from hdopt.recordings.read import recording_from_table as recording_from_table
    from hdopt.recordings.recording import Recording as Recording
    from hdopt.recordings.sheet import Batch as Batch
    from hdopt.recordings.sheet import Inspection as Inspection
    from hdopt.study import Study as Study
    from hdopt.study import load_study as load_study
    from hdopt.study import shipped_drives as shipped_drives
    from hdopt.study import shipped_studies as shipped_studies
    from hdopt.tolerance.results import SobolResult as SobolResult
    from hdopt.tolerance.results import StackResult as StackResult
    from hdopt.tolerance.screening import Screening as Screening
    from hdopt.workflow.acceptance_sheet import SheetLabel as SheetLabel
    from hdopt.workflow.allocate import allocate as allocate
    from hdopt.workflow.check_study import StudyCheck as StudyCheck
    from hdopt.workflow.check_study import check_study as check_study
    from hdopt.workflow.compare import CompareResult as CompareResult
    from hdopt.workflow.compare import compare as compare
    from hdopt.workflow.compensate import Compensated as Compensated
    from hdopt.workflow.compensate import compensate as compensate
    from hdopt.workflow.diagnose import diagnose as diagnose
    from hdopt.workflow.diagnose_many import diagnose_many as diagnose_many
    from hdopt.workflow.explore import ExploreResult as ExploreResult
    from hdopt.workflow.explore import explore as explore
    from hdopt.workflow.export import export as export
    from hdopt.workflow.inspect import inspect as inspect
    from hdopt.workflow.inspect_many import inspect_many as inspect_many
    from hdopt.workflow.kinematic_error import KinematicErrorResult as KinematicErrorResult
    from hdopt.workflow.kinematic_error import ProfileResult as ProfileResult
    from hdopt.workflow.kinematic_error import kinematic_error as kinematic_error
    from hdopt.workflow.kinematic_error import profile as profile
    from hdopt.workflow.new_study import NewStudy as NewStudy
    from hdopt.workflow.new_study import new_study as new_study
    from hdopt.workflow.peak_to_peak import peak_to_peak as peak_to_peak
    from hdopt.workflow.recorded_drive import RecordedDrive as RecordedDrive
    from hdopt.workflow.recorded_drive import recorded_drive as recorded_drive
    from hdopt.workflow.run import RunResult as RunResult
    from hdopt.workflow.run import run_study as run_study
    from hdopt.workflow.search import search as search
    from hdopt.workflow.stack import ToleranceProblem as ToleranceProblem
    from hdopt.workflow.stack import screen as screen
    from hdopt.workflow.stack import sobol as sobol
    from hdopt.workflow.stack import stack as stack
    from hdopt.workflow.verify import Verification as Verification
    from hdopt.workflow.verify import verify_run as verify_run

_EXPORTS: dict[str, str] = {
    "AllocateResult": "hdopt.allocation.results",
    "DiagnosisSettings": "hdopt.diagnosis.settings",
    "Diagnosis": "hdopt.diagnosis.verdict.diagnosis",
    "DiagnosedBatch": "hdopt.diagnosis.verdict.many",
    "NamedEffect": "hdopt.diagnosis.verdict.named_effect",
    "DriveErrors": "hdopt.drive.errors",
    "Drive": "hdopt.drive.geometry",
    "DriveGeometry": "hdopt.drive.geometry",
    "WaveGenerator": "hdopt.drive.geometry",
    "HdoptError": "hdopt.errors",
    "write_tables": "hdopt.files",
    "ExportResult": "hdopt.geometry.export",
    "SearchResult": "hdopt.optimize.records",
    "Bench": "hdopt.recordings.bench",
    "read_recording": "hdopt.recordings.read",
    "recording_from_table": "hdopt.recordings.read",
    "Recording": "hdopt.recordings.recording",
    "Batch": "hdopt.recordings.sheet",
    "Inspection": "hdopt.recordings.sheet",
    "Study": "hdopt.study",
    "load_study": "hdopt.study",
    "shipped_drives": "hdopt.study",
    "shipped_studies": "hdopt.study",
    "SobolResult": "hdopt.tolerance.results",
    "StackResult": "hdopt.tolerance.results",
    "Screening": "hdopt.tolerance.screening",
    "SheetLabel": "hdopt.workflow.acceptance_sheet",
    "allocate": "hdopt.workflow.allocate",
    "StudyCheck": "hdopt.workflow.check_study",
    "check_study": "hdopt.workflow.check_study",
    "CompareResult": "hdopt.workflow.compare",
    "compare": "hdopt.workflow.compare",
    "Compensated": "hdopt.workflow.compensate",
    "compensate": "hdopt.workflow.compensate",
    "diagnose": "hdopt.workflow.diagnose",
    "diagnose_many": "hdopt.workflow.diagnose_many",
    "ExploreResult": "hdopt.workflow.explore",
    "explore": "hdopt.workflow.explore",
    "export": "hdopt.workflow.export",
    "inspect": "hdopt.workflow.inspect",
    "inspect_many": "hdopt.workflow.inspect_many",
    "KinematicErrorResult": "hdopt.workflow.kinematic_error",
    "ProfileResult": "hdopt.workflow.kinematic_error",
    "kinematic_error": "hdopt.workflow.kinematic_error",
    "profile": "hdopt.workflow.kinematic_error",
    "NewStudy": "hdopt.workflow.new_study",
    "new_study": "hdopt.workflow.new_study",
    "peak_to_peak": "hdopt.workflow.peak_to_peak",
    "RecordedDrive": "hdopt.workflow.recorded_drive",
    "recorded_drive": "hdopt.workflow.recorded_drive",
    "RunResult": "hdopt.workflow.run",
    "run_study": "hdopt.workflow.run",
    "search": "hdopt.workflow.search",
    "ToleranceProblem": "hdopt.workflow.stack",
    "screen": "hdopt.workflow.stack",
    "sobol": "hdopt.workflow.stack",
    "stack": "hdopt.workflow.stack",
    "Verification": "hdopt.workflow.verify",
    "verify_run": "hdopt.workflow.verify",
}
"""Public name -> the module that has it. What type checkers see above is the same list."""

__all__ = list(_EXPORTS)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("hdopt")
    if name not in _EXPORTS:
        raise AttributeError(f"module 'hdopt' has no attribute {name!r}")
    return _public(name)


@cache
def _public(name: str) -> Any:
    from types import FunctionType

    from hdopt.keywords import names_keywords

    if name not in _EXPORTS:  # a built-in type, of an annotation
        raise KeyError(name)
    found = getattr(import_module(_EXPORTS[name]), name)
    if not isinstance(found, FunctionType):
        return names_keywords(found)
    from hdopt.workflow.called import as_called

    return as_called(found, _public)


def __dir__() -> list[str]:
    return sorted([*globals(), *_EXPORTS])
