"""Answer blind cases with the diagnosis, then open the keys and show the score as it is."""

from __future__ import annotations

import pandas as pd

from hdopt.report import KeyFigures, Section, Table, Text
from hdopt.studies.sections import ConcealedSection
from hdopt.study import Study
from hdopt.workflow.steps import Context, StepResult


def concealed_physics(study: Study, context: Context) -> StepResult:
    """Score of a blind proof of the `study`, with the diagnosis' seed of the `context`: false alarms, exact sets,
    unknowns, intervals, confidences, every failed case.

    The answer to the study is "no" where a criterion of the frozen gate (`hdopt.bench.thresholds`) is missed.
    """
    from hdopt.bench.proof import prove
    from hdopt.diagnosis import diagnose
    from hdopt.parallel.engine import engine_from, for_large_items
    from hdopt.recordings.read import recording_from_table

    size = study.section("concealed", ConcealedSection, "concealed-physics")
    drive = study.drive
    ratio = drive.geometry.ratio

    def answer(tables: tuple[pd.DataFrame, ...]) -> dict[str, object]:
        records = [recording_from_table(table, ratio, name=f"recording {i + 1}") for i, table in enumerate(tables)]
        return diagnose(records, drive, seed=context.seed).to_dict()

    # Each case is a part of its own: kept when it is done, and on a cluster where there is one.
    spread = for_large_items(engine_from(None)).map
    scores = prove(answer, size.seed, spread, share=size.share, families=tuple(size.families))
    gate = pd.DataFrame([vars(criterion) for criterion in scores.gate()])
    failed = pd.DataFrame(
        [vars(case) | {"truth": ", ".join(case.truth), "said": ", ".join(case.said)} for case in scores.failed]
    )
    section = Section(
        "concealed-physics",
        "What a bench concealed, and what was found",
        (
            KeyFigures({c.name: f"{c.value:.3g} (limit {c.limit:.3g})" for c in scores.gate()}),
            Table("concealed-gate", "The gate, frozen before the first full run", gate),
            Table(
                "concealed-reliability",
                "Stated confidence against how often it was right",
                scores.reliability_frame().reset_index(),
            ),
            *((Table("concealed-failed", "Every case that failed", failed),) if len(failed) else ()),
            Text(f"Seed {size.seed}, {size.share:.0%} of the full proof, {len(scores.cases)} cases."),
        ),
    )
    results: dict[str, object] = {
        "seed": size.seed,
        "share": size.share,
        "cases": len(scores.cases),
        "passed": bool(scores.passed),
    }
    results["gate"] = gate.to_dict("records")
    return StepResult((section,), results, says=tuple(scores.summary().splitlines()), answer=bool(scores.passed))
