"""The explorer as a step of a study: a page inside the report, and a file beside it."""

from __future__ import annotations

from hdopt.errors import HdoptError
from hdopt.files import write_text
from hdopt.report import Download, Section, Text
from hdopt.study import Study
from hdopt.workflow.explore import EXPLORER_FILE, explorer_page
from hdopt.workflow.steps import Context, StepResult


def explorer(study: Study, context: Context) -> StepResult:
    """The explorer of the `study` in the folder of the `context`, which also gives the seed of its cloud, and a section
    that opens it; a word of why where the closed form does not know the drive."""
    title = "Explorer"
    try:
        page = explorer_page(study, seed=context.seed)
    except HdoptError as error:
        section = Section("explorer", title, (Text(f"Left out: {error}."),))
        return StepResult((section,), {"left_out": str(error)})
    place = context.folder / EXPLORER_FILE
    write_text(place, page.html)
    held = Download(EXPLORER_FILE, page.html, "Opens in a new tab; saved, it opens from disk.", opens=True)
    section = Section(
        "explorer",
        title,
        (held, *map(Text, page.notes)),
        "The drive under sliders: move an error, the pressure angle or the width, and see what the error becomes.",
    )
    return StepResult((section,), {"drives": len(page.cloud)}, (place,))
