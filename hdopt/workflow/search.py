"""`hdopt.search`: from a study to the best design, the fronts, what limits cost, and how sure the choice is."""

from __future__ import annotations

from hdopt.optimize.fronts import Progress
from hdopt.optimize.records import SearchResult
from hdopt.optimize.search import search_designs
from hdopt.study import AnyStudy, Study, as_study
from hdopt.workflow.search_setup import setup_of


def search(
    study: AnyStudy = None, seed: int = 1, progress: Progress = lambda stage: None, fronts: bool = True
) -> SearchResult:
    """Search a study's designs for the best, and for fronts between its two objectives.

    `study` is a study, its name or its path; `seed` that of what is done at random; `progress` is told what comes
    next; without `fronts` only the best design is looked for. An interrupt (Ctrl-C) ends it with the best so far.
    """
    study = as_study(study)
    setup = setup_of(study, seed)
    return search_designs(setup, seed, progress, fronts=fronts, study=study.name, notes=_notes(study))


def _notes(study: Study) -> tuple[str, ...]:
    """What is to be said of the study's effects."""
    if not study.effects:
        return ()
    from hdopt.workflow.effect_selection import inclusion

    chosen = inclusion(study, "drive")
    carried = (
        "the effects found on the study's drive are carried over to every design: a radial one follows the pressure "
        "angle, the others stay; the lag is without them"
    )
    return (*chosen.says, carried) if chosen.counted else chosen.says
