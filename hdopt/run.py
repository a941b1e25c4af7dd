"""Run a study: every step it asks for, one report, the numbers beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hdopt.errors import HdoptError, MissingLibrary, MissingValue
from hdopt.files import make_folder
from hdopt.report import Report, Section, Text
from hdopt.steps import STEPS, Context, StepResult, find_step
from hdopt.study import Study

Progress = Callable[[Iterable[str]], Iterable[str]]


@dataclass(frozen=True)
class RunResult:
    """What a run left: the page, and what each step found, by its name."""

    study: str
    report: Path
    steps: Mapping[str, StepResult]

    @property
    def answer(self) -> bool:
        """False where the answer of a step was "no"."""
        return all(step.answer for step in self.steps.values())

    def to_dict(self) -> dict[str, Any]:
        return {
            "study": self.study,
            "report": str(self.report),
            "files": [str(file) for step in self.steps.values() for file in step.files],
            "steps": {name: dict(step.results) for name, step in self.steps.items()},
        }


def run_study(study: Study, folder: Path, seed: int = 1, progress: Progress = iter) -> RunResult:
    """Do the steps that a study asks for and write report.html, results.json and the CSV files into `folder`.

    A study asks for the steps that [study] lists; where it lists none, for all that its sections ask for, and one
    that then lacks a number or a library is left out, with a word in the report. `progress` is told of each step as
    it begins.
    """
    from hdopt.report.html import write_report

    listed, names = steps_of(study)
    try:
        todo = {name: find_step(name) for name in names}
    except HdoptError as error:
        raise HdoptError(f"{study.document.where(('study', 'steps'))}: {error}") from error
    make_folder(folder)
    context, found = Context(folder, seed), {}
    for name in progress(names):
        try:
            found[name] = todo[name](study, context)
        except (MissingLibrary, MissingValue) as error:
            if listed:
                raise
            found[name] = _left_out(name, error)
    sections = tuple(section for step in found.values() for section in step.sections)
    results = {"study": study.name, "steps": {name: dict(step.results) for name, step in found.items()}}
    page = write_report(Report(study.title, description_of(study), sections, results), folder)
    return RunResult(study.name, page, found)


def steps_of(study: Study) -> tuple[bool, tuple[str, ...]]:
    """Whether the study lists its steps, and the names of those it asks for."""
    section = study.sections.get("study")
    asked = section.steps if section else None
    if asked == []:
        raise HdoptError(
            f"{study.document.where(('study', 'steps'))}: is empty; name at least one of {', '.join(STEPS)}"
        )
    if asked:
        return True, tuple(asked)
    names = tuple(name for name, place in STEPS.items() if place.asked(study.sections))
    if not names:
        raise HdoptError(f"{study.source} asks for nothing; give it [drive] and [errors], or list steps in [study]")
    return False, names


def description_of(study: Study) -> str:
    """What the study says of itself, or failing that what drive it is about."""
    section = study.sections.get("study")
    if section and section.description:
        return section.description
    if "drive" not in study.sections:
        return ""
    gear, generator = study.drive.geometry, study.drive.wave_generator
    return (
        f"Ratio {gear.ratio:g}, {gear.flexspline_teeth} and {gear.circular_spline_teeth} teeth, "
        f"{generator.profile.name.replace('_', '-')} wave generator, {generator.structure.value.replace('_', '-')}."
    )


def _left_out(name: str, error: HdoptError) -> StepResult:
    title = name.replace("_", " ").capitalize()
    return StepResult(
        (Section(name.replace("_", "-"), title, (Text(f"Left out: {error}."),)),), {"left_out": str(error)}
    )
