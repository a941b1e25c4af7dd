"""Answer blind cases with the diagnosis, then open the keys and show the score as it is."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import pandas as pd

from hdopt.report import Points, Ruling, Section, Table, Text
from hdopt.report.sections.words import label
from hdopt.studies.sections import ConcealedSection
from hdopt.study import Study
from hdopt.workflow.steps import Context, StepResult

if TYPE_CHECKING:
    from hdopt.bench.scores import CaseScore, Scores

RELIABILITY = "Stated confidence against how often it was right"


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
    gate = [vars(criterion) for criterion in scores.gate()]
    results: dict[str, object] = {
        "seed": size.seed,
        "share": size.share,
        "cases": len(scores.cases),
        "passed": bool(scores.passed),
    }
    results["gate"] = gate
    says = tuple(scores.summary().splitlines())
    return StepResult((proof_section(scores, size),), results, says=says, answer=bool(scores.passed))


def proof_section(scores: Scores, size: ConcealedSection) -> Section:
    """The page of a blind proof of the given `size`: its verdict, the gate, confidences and every failed case of its
    `scores`."""
    gate = scores.gate()
    missed = [criterion.name for criterion in gate if not criterion.passed]
    ruling = f"{len(gate) - len(missed)} of {len(gate)} criteria of the gate are kept, in {len(scores.cases)} cases."
    reliability = scores.reliability_frame()
    failed = pd.DataFrame([_failed_row(case) for case in scores.failed])
    items = (
        Ruling(bool(scores.passed), ruling),
        *((Points(tuple(f"Missed: {name}." for name in missed)),) if missed else ()),
        Table("concealed-gate", "The gate, frozen before the first full run", pd.DataFrame(map(vars, gate))),
        *((Table("concealed-reliability", RELIABILITY, reliability),) if len(reliability) else ()),
        *((Table("concealed-failed", "Every case that failed", failed),) if len(failed) else ()),
        Text(f"Seed {size.seed}, {size.share:.0%} of the full proof, {len(scores.cases)} cases."),
    )
    return Section("concealed-physics", "What a bench concealed, and what was found", items)


def _failed_row(case: CaseScore) -> dict[str, str | float]:
    """A failed case as a row of the page, its effects in words."""
    return {
        "case": case.id,
        "family": case.family,
        "severity": case.severity,
        "concealed": named(case.truth) or case.outside or "nothing",
        "of the kind": case.hidden,
        "verdict": case.verdict,
        "said": named(case.said),
        "why it failed": case.reason,
    }


def named(effects: Iterable[str]) -> str:
    """The `effects` of the catalogue in words, one after the other."""
    return ", ".join(label(effect) for effect in effects)
