"""What `hdopt run` can do: each step turns a study into sections of the report and numbers for results.json."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING

from hdopt.errors import HdoptError, unknown_name

if TYPE_CHECKING:
    from hdopt.report import Section
    from hdopt.study import Study


@dataclass(frozen=True)
class StepResult:
    """What a step found: sections for people, JSON-ready numbers for programs."""

    sections: tuple[Section, ...]
    results: Mapping[str, object] = field(default_factory=dict)


Step = Callable[["Study", int], StepResult]
"""A step takes the study and the seed of whatever it does at random."""

STEPS: dict[str, str] = {
    "waveform": "hdopt.steps.waveform:waveform",
    "orders": "hdopt.steps.waveform:orders",
    "lag": "hdopt.steps.waveform:lag",
    "structures": "hdopt.steps.structures:structures",
    "profiles": "hdopt.steps.profiles:profiles",
    "sensitivities": "hdopt.steps.design:sensitivities",
    "design_map": "hdopt.steps.design:design_map",
}
"""Step -> where it is, in the order of a report; a step is imported only when a study asks for it."""


def find_step(name: str) -> Step:
    """The step of this name; an unknown one is an error that names the nearest."""
    if name not in STEPS:
        raise HdoptError(unknown_name("step", name, STEPS))
    module, _, attribute = STEPS[name].partition(":")
    return getattr(import_module(module), attribute)


def requirement_arcmin(study: Study) -> float | None:
    """The largest peak-to-peak error the study allows, arcmin, where it says one."""
    section = study.sections.get("requirement")
    return None if section is None else getattr(section, "peak_to_peak_arcmin", None)
