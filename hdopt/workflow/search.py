"""`hdopt.search`: from a study to the best design, the fronts, what limits cost, and how sure the choice is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from hdopt.files import write_text
from hdopt.kinematics.model_error import model_error
from hdopt.optimize.fronts import Progress
from hdopt.optimize.records import SearchResult
from hdopt.optimize.region_maps import find_regions
from hdopt.optimize.search import search_designs
from hdopt.study import AnyStudy, Study, as_study
from hdopt.study.search import SearchSection
from hdopt.study.tolerances import TolerancesBase
from hdopt.workflow.measured_parts import words_on_measured_parts
from hdopt.workflow.output_files import Files, checked_files, write_table_files
from hdopt.workflow.placed import numbers_named
from hdopt.workflow.search_setup import setup_of
from hdopt.workflow.stack import PILOT_MEASURED, PILOT_N, drive_problem_of, words_on_graded_teeth
from hdopt.workflow.write_design import chosen_study_toml

FILES = ("csv", "xlsx", "study")


@numbers_named
def search(
    study: AnyStudy = None,
    seed: int = 1,
    progress: Progress = lambda stage: None,
    fronts: bool = True,
    files: Files | None = None,
    regions: bool | None = None,
) -> SearchResult:
    """Search a study's designs for the best, and for fronts between its two objectives.

    `study` is a study, its name or its path; `seed` that of what is done at random; `progress` is told what comes
    next; without `fronts` only the best design is looked for; with `regions` (as [search] of the study says, if None)
    each constant of the trade is followed to where another choice is the better, which takes a few times as long. An
    interrupt (Ctrl-C) ends it with the best so far. `files` to write: {"study": PATH} the chosen design as a study,
    {"csv": PATH} or {"xlsx": PATH} the tables.
    Raises `HdoptError` before any work where a file cannot be written.
    """
    study, wanted = as_study(study), checked_files(files, FILES)
    setup = setup_of(study, seed)
    result = search_designs(setup, seed, progress, fronts=fronts, study=study.name, notes=_notes(study))
    result = replace(result, notes=(*result.notes, *words_on_model(result)))
    if _asks_for_regions(study) if regions is None else regions:
        result = with_regions(result, seed, progress)
    write_search(result, wanted, study)
    return result


def _asks_for_regions(study: Study) -> bool:
    section = study.find("search", SearchSection)
    return section is not None and section.regions


def with_regions(result: SearchResult, seed: int = 1, progress: Progress = lambda stage: None) -> SearchResult:
    """A search's `result` with the regions of the trade's constants in which its choice holds; as it is where no design
    keeps the limits, or the search was interrupted. `seed` and `progress` as in `search`."""
    if not result.feasible or result.interrupted:
        return result
    progress("regions")
    return replace(result, regions=find_regions(result, seed))


def write_search(result: SearchResult, files: Mapping[str, Path], study: Study) -> None:
    """Write of the `result` of a search of `study` what `files` asks for ("csv", "xlsx", "study" -> path).

    The study of the chosen design stays out where no design keeps the limits. Raises `HdoptError` where a file cannot
    be written.
    """
    write_table_files(result, files)
    if "study" in files and result.feasible:
        write_text(files["study"], chosen_study_toml(study, result, files["study"].parent))


def words_on_model(result: SearchResult) -> tuple[str, ...]:
    """A sentence where the closed form is far from the exact geometry for the best design of `result` under the
    tolerances; () where it is not, or where no tolerances were searched under."""
    setup = result.setup
    design = setup.space.design(result.chosen.combination, result.chosen.values)
    if setup.trade.sample is None or not isinstance(design.drive.geometry.flexspline_teeth, int):
        return ()
    drives = PILOT_MEASURED if design.drive.has_measured_teeth else PILOT_N
    said = model_error(design.drive, setup.trade.of(setup.trade.sample[:drives], design)).says
    return () if said is None else (f"the best design: {said}",)


def _notes(study: Study) -> tuple[str, ...]:
    """What is to be said of the study's teeth that are drawn or measured, and of its effects."""
    notes = (*_on_drawn_teeth(study), *words_on_measured_parts(study.drive))
    if not study.effects:
        return notes
    from hdopt.workflow.effect_selection import inclusion

    chosen = inclusion(study, "drive")
    carried = (
        "the effects found on the study's drive are carried over to every design: a radial one follows the pressure "
        "angle, the others stay; the lag is without them"
    )
    if not chosen.counted:
        return (*notes, *chosen.says)
    if "tolerances" not in study.sections:
        return (*notes, *chosen.says, carried)
    same = "under the tolerances the effects are the same in every drive: they have no tolerance"
    if drive_problem_of(study).response.teeth:
        dear = "teeth drawn beside effects take about 1 ms a drive: search.samples says of how many a quantile is made"
        return (*notes, *chosen.says, carried, same, dear)
    return (*notes, *chosen.says, carried, same)


def _on_drawn_teeth(study: Study) -> tuple[str, ...]:
    """What teeth that are drawn from tolerances of pitch rest on, and what of them stays in every design."""
    tolerances = study.find("tolerances", TolerancesBase)
    if tolerances is None or not tolerances.graded(study.drive.geometry):
        return ()
    stays = (
        "quantiles draw teeth from tolerances of pitch, the same teeth in every design, as large as the "
        "study's own module makes them; the nominal figures are those of [errors], without them"
    )
    return (*words_on_graded_teeth(drive_problem_of(study)), stays)
