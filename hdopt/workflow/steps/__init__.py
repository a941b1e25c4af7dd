"""What `hdopt run` can do: each step turns a study into sections of the report, numbers and files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from hdopt.errors import HdoptError, unknown_name

if TYPE_CHECKING:
    from hdopt.report import Section
    from hdopt.study import Study


@dataclass(frozen=True)
class Context:
    """What a step has besides the study: the folder that files go to, and the seed of whatever is done at random."""

    folder: Path
    seed: int = 1


@dataclass(frozen=True)
class StepResult:
    """What a step found: sections for people, JSON-ready numbers for programs, and the files it wrote.

    `says` are lines for the terminal; `answer` is False where the answer is "no": infeasible, or a failed check.
    """

    sections: tuple[Section, ...]
    results: Mapping[str, object] = field(default_factory=dict)
    files: tuple[Path, ...] = ()
    says: tuple[str, ...] = ()
    answer: bool = True


Step = Callable[["Study", Context], StepResult]


@dataclass(frozen=True)
class StepPlace:
    """Where a step is ('module:function'), and the sections that make a study ask for it without listing it."""

    place: str
    asked_by: tuple[str, ...] = ()

    def asked(self, sections: Mapping[str, object]) -> bool:
        """Whether a study with these sections that lists no steps gets this one."""
        return bool(self.asked_by) and all(section in sections for section in self.asked_by)


ONE_DRIVE = ("drive", "errors")
MANY_DRIVES = ("drive", "tolerances", "requirement")

STEPS: dict[str, StepPlace] = {
    "waveform": StepPlace("hdopt.workflow.steps.waveform:waveform", ONE_DRIVE),
    "effects": StepPlace("hdopt.workflow.steps.waveform:effects", (*ONE_DRIVE, "effects")),
    "orders": StepPlace("hdopt.workflow.steps.waveform:orders", ONE_DRIVE),
    "lag": StepPlace("hdopt.workflow.steps.waveform:lag", ONE_DRIVE),
    "structures": StepPlace("hdopt.workflow.steps.structures:structures", ONE_DRIVE),
    "profiles": StepPlace("hdopt.workflow.steps.profiles:profiles", ONE_DRIVE),
    "sensitivities": StepPlace("hdopt.workflow.steps.design:sensitivities", ONE_DRIVE),
    "design_map": StepPlace("hdopt.workflow.steps.design:design_map", ONE_DRIVE),
    "stack": StepPlace("hdopt.workflow.steps.tolerances:stack", MANY_DRIVES),
    "sobol": StepPlace("hdopt.workflow.steps.tolerances:sobol", MANY_DRIVES),
    "allocate": StepPlace("hdopt.workflow.steps.tolerances:allocate", ("allocate",)),
    "geometry": StepPlace("hdopt.workflow.steps.geometry:geometry", ("drive", "export")),
    "search": StepPlace("hdopt.workflow.steps.search:search", ("search",)),
    "explorer": StepPlace("hdopt.workflow.steps.explorer:explorer", ONE_DRIVE),
    "concealed_physics": StepPlace("hdopt.studies.concealed_physics:concealed_physics"),
    "real_residuals": StepPlace("hdopt.studies.real_residuals:real_residuals"),
    "paper_reproduction": StepPlace("hdopt.studies.paper_reproduction:paper_reproduction"),
}
"""Every step, in the order of a report; a step is imported only when a study asks for it."""


def find_step(name: str) -> Step:
    """The step of this name; an unknown one is an error that names the nearest."""
    if name not in STEPS:
        raise HdoptError(unknown_name("step", name, STEPS))
    module, _, attribute = STEPS[name].place.partition(":")
    step: Step = getattr(import_module(module), attribute)
    return step


def requirement_arcmin(study: Study) -> float | None:
    """The largest peak-to-peak error that the `study` allows, arcmin; None where it does not say."""
    from hdopt.study.tolerances import RequirementSection

    section = study.find("requirement", RequirementSection)
    return None if section is None else section.peak_to_peak_arcmin
