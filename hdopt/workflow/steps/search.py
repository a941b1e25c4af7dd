"""The step that searches designs, says how sure the choice is, and writes the chosen design's study file."""

from __future__ import annotations

from dataclasses import replace

from hdopt.files import write_text
from hdopt.optimize.records import SearchResult
from hdopt.optimize.summary import chosen_words, design_words, nearest_boundary
from hdopt.optimize.views import trade_views
from hdopt.report import Download, Section, Text
from hdopt.report.sections.search import trade_sections
from hdopt.study import Study
from hdopt.workflow.search import search as search_designs
from hdopt.workflow.search_verification import verify
from hdopt.workflow.steps import Context, StepResult
from hdopt.workflow.write_design import chosen_study_toml


def search(study: Study, context: Context) -> StepResult:
    """Best design of the `study`, fronts, its price, its verification and, where [search] asks, the regions in which it
    holds; names the choice and writes its study file to the folder of the `context`."""
    result = search_designs(study, context.seed)
    if not result.feasible:
        return _no_design(study, result)
    checked = verify(study, result, context.seed)
    file = context.folder / f"{study.name}-chosen.toml"
    text = chosen_study_toml(study, result)
    write_text(file, text)
    results = result.to_dict() | {
        "verification": checked.to_dict(),
        "chosen_study": file.name,
    }
    first, *others = trade_sections(result, trade_views(result), checked, file.name)
    notes = tuple(Text(f"{note[:1].upper()}{note[1:]}.") for note in result.notes)
    chosen = Download(file.name, text, "The study file of the chosen design, for every other command.")
    sections = (replace(first, items=(*notes, *first.items, chosen)), *others)
    says = (
        f"chosen wave generator: {chosen_words(result)}",
        *(() if result.regions is None else (nearest_boundary(result.regions),)),
        f"study file: {file}  (hdopt export {file} --step wg.step)",
    )
    return StepResult(sections, results, (file,), says)


def _no_design(study: Study, result: SearchResult) -> StepResult:
    """What is said where no design keeps every limit."""
    text = (
        f"No design keeps all limits. The nearest, {design_words(result.best)}, breaks: "
        f"{'; '.join(result.best.broken_limits)}. Ease a limit or widen a variable."
    )
    section = Section("trade-chosen", "No wave generator keeps all limits", (Text(text),))
    return StepResult((section,), result.to_dict(), says=(text,), answer=False)
