"""Answer blind cases with the diagnosis, then open the keys and show the score as it is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import isnan, nan
from typing import TYPE_CHECKING

import pandas as pd

from hdopt.report import Points, Ruling, Section, Table, Text
from hdopt.report.sections.words import label
from hdopt.studies.sections import ConcealedSection
from hdopt.study import Study
from hdopt.workflow.doing import counted
from hdopt.workflow.steps import Context, StepResult

if TYPE_CHECKING:
    from hdopt.bench.scores import CaseScore, Criterion, Scores

RELIABILITY = "Stated confidence against how often it was right"


def concealed_physics(study: Study, context: Context) -> StepResult:
    """Score of a blind proof of the `study`, with the diagnosis' seed of the `context`: false alarms, exact sets,
    unknowns, intervals, confidences, every failed case.

    The answer to the study is "no" where a criterion of the frozen gate (`hdopt.bench.thresholds`) is missed.
    """
    from hdopt.bench.proof import prove
    from hdopt.bench.suite import plan
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
    work, families = for_large_items(engine_from(None)).map, tuple(size.families)
    total = len(plan(size.seed, families, share=size.share))
    scores = prove(
        answer,
        size.seed,
        lambda function, cases: counted(work(function, cases), total, "case"),
        share=size.share,
        families=families,
    )
    gate = [vars(criterion) for criterion in scores.gate()]
    results: dict[str, object] = {
        "seed": size.seed,
        "share": size.share,
        "cases": len(scores.cases),
        "passed": bool(scores.passed),
    }
    results["gate"] = gate
    says = tuple(without_empty(scores.summary().split("\n\n")))
    return StepResult((proof_section(scores, size),), results, says=says, answer=bool(scores.passed))


def proof_section(scores: Scores, size: ConcealedSection) -> Section:
    """The page of a blind proof of the given `size`: its verdict, the gate, confidences and every failed case of its
    `scores`."""
    gate = scores.gate()
    judged = [criterion for criterion in gate if not isnan(criterion.value)]
    kept = sum(criterion.passed for criterion in judged)
    ruling = f"{kept} of {len(judged)} criteria of the gate are kept, in {len(scores.cases)} cases."
    reliability = scores.reliability_frame()
    failed = pd.DataFrame([_failed_row(case) for case in scores.failed])
    items = (
        Ruling(bool(scores.passed), ruling),
        Points(tuple(_missed(gate, len(scores.cases), size.share))),
        Table("concealed-gate", "The gate, frozen before the first full run", gate_frame(gate)),
        *(
            (Table("concealed-families", "Right by family of cases", families_frame(scores)),)
            if scores.families
            else ()
        ),
        *((Table("concealed-reliability", RELIABILITY, reliability),) if len(reliability) else ()),
        *((Table("concealed-failed", "Every case that failed", failed),) if len(failed) else ()),
        Text(f"Seed {size.seed}, {100 * size.share:g} % of the full proof, {len(scores.cases)} cases."),
    )
    return Section("concealed-physics", "What a bench concealed, and what was found", items)


AT_MOST = ("false-alarm", "unknown physics named", "effects whose", "calibration", "cases that cannot")
"""How the criteria begin whose limit is an upper one; the others have a lower one."""
ENOUGH = "enough cases"


def gate_frame(gate: Sequence[Criterion]) -> pd.DataFrame:
    """The criteria of the `gate`, a row each: its value and limit, whether it is kept, and of how many; one that no
    case bears on is neither kept nor missed."""
    rows = []
    for one in gate:
        limit = "" if isnan(one.limit) or one.name == ENOUGH else f"{_side(one)} {one.limit:.3g}"
        value = nan if one.name == ENOUGH else one.value
        asked = not isnan(one.value)
        rows.append((one.name, value, limit, ("yes" if one.passed else "no") if asked else "not asked", one.detail))
    return pd.DataFrame(rows, columns=["criterion", "value", "limit", "kept", "counted"])


def families_frame(scores: Scores) -> pd.DataFrame:
    """How many cases of each family were answered rightly, of `scores`."""
    rows = [(name, rate.n, rate.hits) for name, rate in scores.families.items()]
    return pd.DataFrame(rows, columns=["family", "cases", "right"])


def _side(one: Criterion) -> str:
    return "at most" if one.name.startswith(AT_MOST) else "at least"


def _missed(gate: Sequence[Criterion], cases: int, share: float) -> Iterator[str]:
    """What keeps a proof from passing, a sentence each."""
    for one in gate:
        if not one.passed and not isnan(one.value) and one.name != ENOUGH:
            yield f"Missed: {one.name} {one.value:.3g}, {_side(one)} {one.limit:.3g} is asked ({one.detail})."
    unasked = [one.name for one in gate if isnan(one.value)]
    if unasked:
        yield f"No case of this run bears on {len(unasked)} criteria: {'; '.join(unasked)}."
    if any(one.name == ENOUGH and not one.passed for one in gate):
        yield (
            f"{cases} cases are too few for the gate, whatever they say: it is that of the full proof, and this is "
            f"{100 * share:g} % of it or a part of its families."
        )


def without_empty(blocks: Iterable[str]) -> Iterator[str]:
    """Lines of the `blocks` of a summary, without those that have a heading and nothing below it."""
    for block in blocks:
        heading, _, rest = block.partition("\n")
        if "Empty DataFrame" in rest or not (rest.strip() or ":" in heading):
            continue
        yield from (*block.rstrip().splitlines(), "")


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
