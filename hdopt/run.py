"""Run a study: every step it asks for, one report, the numbers beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hdopt.errors import HdoptError
from hdopt.report import Report
from hdopt.steps import STEPS, find_step
from hdopt.study import Study

Progress = Callable[[Iterable[str]], Iterable[str]]


@dataclass(frozen=True)
class RunResult:
    """What a run left: the page, and the results of each step by its name."""

    study: str
    report: Path
    steps: Mapping[str, Mapping[str, Any]]

    def to_dict(self) -> dict[str, Any]:
        return {"study": self.study, "report": str(self.report), "steps": dict(self.steps)}


def run(study: Study, folder: Path, seed: int = 1, progress: Progress = iter) -> RunResult:
    """Do the steps that [study] lists (all of those that need no more than a drive, where it lists none), and write
    report.html, results.json and the CSV files into `folder`. `progress` is told of each step as it begins."""
    from hdopt.report.html import write_report

    names = steps_of(study)
    try:
        todo = {name: find_step(name) for name in names}
    except HdoptError as error:
        raise HdoptError(f"{study.document.where(('study', 'steps'))}: {error}") from error
    sections, results = [], {}
    for name in progress(names):
        found = todo[name](study, seed)
        sections += found.sections
        results[name] = found.results
    report = Report(study.title, description_of(study), tuple(sections), {"study": study.name, "steps": results})
    return RunResult(study.name, write_report(report, folder), results)


def steps_of(study: Study) -> tuple[str, ...]:
    """The names of the steps that a study asks for."""
    section = study.sections.get("study")
    asked = section.steps if section else None
    if asked == []:
        raise HdoptError(
            f"{study.document.where(('study', 'steps'))}: is empty; name at least one of {', '.join(STEPS)}"
        )
    return tuple(asked or STEPS)


def description_of(study: Study) -> str:
    """What the study says of itself, or failing that what drive it is about."""
    section = study.sections.get("study")
    if section and section.description:
        return section.description
    gear, generator = study.drive.geometry, study.drive.wave_generator
    return (
        f"Ratio {gear.ratio:g}, {gear.flexspline_teeth} and {gear.circular_spline_teeth} teeth, "
        f"{generator.profile.name.replace('_', '-')} wave generator, {generator.structure.value.replace('_', '-')}."
    )
