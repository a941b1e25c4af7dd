"""The wave generator's files, drawing and picture, as a step of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hdopt.workflow.steps import Context, StepResult

if TYPE_CHECKING:
    from hdopt.study import Study


def geometry(study: Study, context: Context) -> StepResult:
    """Export the wave generator of the `study` into the folder of the `context`: STEP, DXF, drawing, and a picture
    where it can be rendered."""
    from hdopt.geometry.check import CheckFailed
    from hdopt.geometry.picture import NoPicture
    from hdopt.report import Section, Text
    from hdopt.report.sections.geometry import geometry_section
    from hdopt.workflow.export import export

    places = {kind: context.folder / f"wave-generator.{kind}" for kind in ("step", "dxf", "svg", "png")}
    try:
        try:
            result = export(study, places)
        except NoPicture:
            del places["png"]
            result = export(study, places)
    except CheckFailed as failed:
        words = f"The export failed: {failed}."
        return StepResult((Section("geometry", "Wave generator to be made", (Text(words),)),), {}, (), (words,), False)
    picture = places["png"].read_bytes() if "png" in places else None
    texts = {kind: places[kind].read_text(encoding="utf-8") for kind in ("step", "dxf", "svg")}
    section = geometry_section(result, texts, picture)
    deviation = result.profile_deviation_um
    unmet = (budget.verdict for budget in result.model.plan.budgets if not budget.met)
    says = (f"wave generator: {len(result.model.parts)} parts, profile within {deviation:.2g} um in the files", *unmet)
    return StepResult((section,), result.to_dict(), tuple(places.values()), says)
