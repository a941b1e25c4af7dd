"""Run a study: every step it asks for, one report, the numbers beside it."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast  # Any: values of JSON

from hdopt.errors import HdoptError, MissingLibrary, MissingValue, unknown_name
from hdopt.figures import drawn
from hdopt.files import ShownAsTable, make_folder, to_json, write_bytes, write_text
from hdopt.parallel.engine import engine_from, engine_in_force
from hdopt.parallel.kept import Kept
from hdopt.report import REPORT_FILE, RESULTS_FILE, Figure, Item, Report, Section, Table, Text
from hdopt.report.cells import index_has_meaning
from hdopt.report.sections.inputs import inputs_section
from hdopt.study import AnyStudy, Study, as_study
from hdopt.study.comments import comments_of
from hdopt.study.defaults import defaults_taken
from hdopt.study.drive import StudySection
from hdopt.study.write import study_toml
from hdopt.workflow.placed import numbers_named
from hdopt.workflow.provenance import own_version, provenance
from hdopt.workflow.requirement import of_run
from hdopt.workflow.run_folder import RunFolder, finish, run_folder
from hdopt.workflow.run_verdict import section_of_run
from hdopt.workflow.steps import STEPS, Context, Step, StepResult, find_step
from hdopt.workflow.texts import with_texts

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure

Progress = Callable[[Iterable[str]], Iterable[str]]


@dataclass(frozen=True)
class RunResult(ShownAsTable):
    """What a run left: the page, and what each step found, by its name."""

    study: str
    report: Path
    steps: Mapping[str, StepResult]

    @property
    def answer(self) -> bool:
        """False where the answer of a step was "no"."""
        return all(step.answer for step in self.steps.values())

    @property
    def found(self) -> dict[str, Mapping[str, Any]]:
        """The results of each step."""
        return {name: step.results for name, step in self.steps.items()}

    @property
    def figures(self) -> dict[str, go.Figure]:
        """The figures of the page by their keys, in its order."""
        return {item.key: item.figure for item in self._items() if isinstance(item, Figure)}

    def plot(self, figure: str | None = None, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """The page's `figure` of this key, the first one if None. `backend` is "plotly" or "matplotlib", which draws
        lines, points and bars. Raises `HdoptError` for a key that the page does not have."""
        found = self.figures
        if not found:
            raise HdoptError(f"the report of {self.study} has no figure; its tables are in tables()")
        if figure is not None and figure not in found:
            raise HdoptError(unknown_name("figure", figure, found))
        return drawn(found[figure or next(iter(found))], backend)

    def to_frame(self) -> pd.DataFrame:
        """One row a step: whether its answer is yes, and what it says."""
        import pandas as pd

        rows = [(name, step.answer, "; ".join(step.says) or left_out(step)) for name, step in self.steps.items()]
        return pd.DataFrame(rows, columns=["step", "answer", "says"])

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: the steps, and every table of the page by its key."""
        tables = {item.key: item.frame for item in self._items() if isinstance(item, Table)}
        framed = {key: frame.reset_index() if index_has_meaning(frame) else frame for key, frame in tables.items()}
        return {"steps": self.to_frame(), **framed}

    def _items(self) -> Iterator[Item]:
        for step in self.steps.values():
            for section in step.sections:
                yield from section.items

    def to_dict(self) -> dict[str, Any]:
        return {
            "study": self.study,
            "report": str(self.report),
            "files": [str(file) for step in self.steps.values() for file in step.files],
            "steps": {name: dict(step.results) for name, step in self.steps.items()},
        }


def left_out(step: StepResult) -> str:
    """Why a `step` was left out; "" where it was not."""
    return f"left out: {step.results['left_out']}" if "left_out" in step.results else ""


@numbers_named
def run_study(
    study: AnyStudy, folder: str | Path, seed: int = 1, progress: Progress = iter, resume: bool = False
) -> RunResult:
    """Do the steps that a `study`, or its name or path, asks for and write report.html, results.json and the CSV
    files into `folder`.

    A study asks for the steps that [study] lists; where it lists none, for all that its sections ask for, and one
    that then lacks a number or a library is left out, with a word in the report. `progress` is told of each step as
    it begins. The folder is replaced as a whole at the end, or not at all; files in it that no run wrote stay. With
    `resume`, steps and parts of steps that an interrupted run of the same study, seed and version finished are taken
    from it. Raises `HdoptError` for a folder that cannot be written, or that another run is writing to.
    """
    study, folder = as_study(study), Path(folder)
    listed, names = steps_of(study)
    try:
        todo = {name: find_step(name) for name in names}
    except HdoptError as error:
        raise HdoptError(f"{study.document.where(('study', 'steps'))}: {error}") from error
    with run_folder(folder, work_key(study, seed), resume) as run:
        found = {}
        for name in progress(names):
            found[name] = _done_before(run, name) or _do(run, name, todo[name], study, seed, listed)
        found = {name: _relocated(step, run.new, folder) for name, step in found.items()}
        _write(study, found, run, seed, folder)
        finish(run, files_of_run(run.target))
    return RunResult(study.name, folder / REPORT_FILE, found)


def work_key(study: Study, seed: int) -> str:
    """What two runs must share for one to go on with the parts of the other: `study`, `seed` and versions."""
    return f"{study.sha256} {seed} {own_version()} {platform.python_version()}"


def _do(run: RunFolder, name: str, step: Step, study: Study, seed: int, listed: bool) -> StepResult:
    """Do one step and keep it. What it spreads over the engine is kept part by part meanwhile."""
    try:
        with engine_in_force(Kept(engine_from(None), run.parts, name)):
            result = step(study, Context(run.new, seed))
    except (MissingLibrary, MissingValue) as error:
        if listed:
            raise
        result = _left_out(name, error)
    files = {str(file.relative_to(run.new)): file.read_bytes() for file in result.files}
    run.parts.keep(f"{name}.step", (result, files))
    # Taken from disk even now, so that a run and one that goes on later cannot but give the same bytes.
    return cast(StepResult, run.parts.load(f"{name}.step")[0])


def _done_before(run: RunFolder, name: str) -> StepResult | None:
    """The result of a step that an earlier run finished, its files written again."""
    if not run.parts.has(f"{name}.step"):
        return None
    result, files = run.parts.load(f"{name}.step")
    for file, content in files.items():
        make_folder((run.new / file).parent)
        write_bytes(run.new / file, content)
    return cast(StepResult, result)


def _write(study: Study, found: Mapping[str, StepResult], run: RunFolder, seed: int, folder: Path) -> None:
    """The page, the tables and the numbers, the latter with their provenance and the hash of every file beside them."""
    from hdopt.report.html import date_of_page, write_report

    by_step = {name: step.results for name, step in found.items()}
    first = section_of_run(of_run(study, by_step), by_step)
    sections = (
        *((first,) if first else ()),
        *(section for step in found.values() for section in step.sections),
        _inputs(study),
    )
    # The page travels: what it says of files is their names, not the folder they were written to.
    results = {"study": study.name, "steps": with_texts(by_step, f"{folder}{os.sep}", "")}
    write_report(Report(study.title, description_of(study), sections, results), run.new)
    files = sorted(path for path in run.new.rglob("*") if path.is_file() and path.name != RESULTS_FILE)
    hashes = {str(path.relative_to(run.new)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
    known = {"source": dict(study.recipe), "date": date_of_page(), "files": hashes}
    results = {
        "study": study.name,
        "steps": {name: dict(step.results) for name, step in found.items()},
        "provenance": provenance(study, seed, "run") | known,
    }
    write_text(run.new / RESULTS_FILE, to_json(results) + "\n")


def _inputs(study: Study) -> Section:
    """The appendix of the page: what went in, with what the study file says of it."""
    comments = comments_of(study.document)
    text = study_toml(study.data, comments.head or (study.title,), comments.beside, comments.above)
    defaults = defaults_taken(study.sections, tuple(study.sections), study.document)
    return inputs_section(study.data, text, study.name, defaults, comments.beside)


def files_of_run(folder: Path) -> tuple[str, ...]:
    """Names of the files that the run in `folder` wrote, as far as it says; () where there was none."""
    try:
        known = json.loads((folder / RESULTS_FILE).read_bytes())["provenance"]["files"]
        return (RESULTS_FILE, *known)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return ()


def _relocated(step: StepResult, old: Path, new: Path) -> StepResult:
    """A step's result with the names that its files will have."""
    files = tuple(new / file.relative_to(old) for file in step.files)
    results, says = (with_texts(part, str(old), str(new)) for part in (step.results, step.says))
    return replace(step, results=results, says=tuple(says), files=files)


def steps_of(study: Study) -> tuple[bool, tuple[str, ...]]:
    """Whether the `study` lists its steps, and the names of those it asks for."""
    section = study.find("study", StudySection)
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
    """What the `study` says of itself, or failing that what drive it is about."""
    section = study.find("study", StudySection)
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
