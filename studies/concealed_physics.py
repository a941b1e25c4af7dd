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
INTERVAL = "Low and high: the 95 % interval of the share that was right."


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
    section = proof_section(scores, size)
    return StepResult((section,), results, says=tuple(said_of(section, scores)), answer=bool(scores.passed))


def said_of(section: Section, scores: Scores) -> Iterator[str]:
    """Lines for the terminal: how the page's `section` begins, then the counts behind it, of `scores`."""
    for item in section.items:
        if isinstance(item, Ruling):
            yield f"{'kept' if item.met else 'missed'}: {item.text}"
        if isinstance(item, Points):
            yield from item.sentences
    yield ""
    _, *blocks = scores.summary().split("\n\n")  # the gate comes first, and is said already
    yield from without_empty(blocks)


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
        *((Table("concealed-reliability", RELIABILITY, reliability, INTERVAL),) if len(reliability) else ()),
        *((Table("concealed-failed", "Every case that failed", failed, "", {"severity": "g"}),) if len(failed) else ()),
        Text(f"Seed {size.seed}, {100 * size.share:g} % of the full proof, {len(scores.cases)} cases."),
    )
    return Section("concealed-physics", "What a bench concealed, and what was found", items)


AT_MOST = ("false-alarm", "unknown physics named", "effects whose", "calibration", "cases that cannot")
"""How the criteria begin whose limit is an upper one; the others have a lower one."""
ENOUGH = "enough cases"
UNCOVERED = "effects whose intervals do not"
BOTH = ", at most "
"""What comes before the upper limit in the detail of a criterion that has both."""


def gate_frame(gate: Sequence[Criterion]) -> pd.DataFrame:
    """The criteria of the `gate`, a row each: its value and limit, whether it is kept, and of how many; one that no
    case bears on is neither kept nor missed."""
    rows = []
    for one in gate:
        limit = "" if isnan(one.limit) or one.name == ENOUGH else _limit(one)
        value = nan if one.name == ENOUGH else one.value
        asked = not isnan(one.value)
        rows.append((one.name, value, limit, ("yes" if one.passed else "no") if asked else "not asked", _counted(one)))
    return pd.DataFrame(rows, columns=["criterion", "value", "limit", "kept", "counted"])


def families_frame(scores: Scores) -> pd.DataFrame:
    """How many cases of each family were answered rightly, of `scores`."""
    rows = [(name, rate.n, rate.hits) for name, rate in scores.families.items()]
    return pd.DataFrame(rows, columns=["family", "cases", "right"])


def _limit(one: Criterion) -> str:
    """'at most 0.01', or '0.93 to 0.97' of a criterion whose detail names its upper limit."""
    _, both, upper = one.detail.partition(BOTH)
    if both:
        return f"{one.limit:.3g} to {upper}"
    return f"{'at most' if one.name.startswith(AT_MOST) else 'at least'} {one.limit:.3g}"


def _counted(one: Criterion) -> str:
    """What a criterion was counted in, its effects in words."""
    counted = one.detail.partition(BOTH)[0]
    effects = counted.split(", ")
    return named(effects) if one.name == UNCOVERED and counted else counted


def _missed(gate: Sequence[Criterion], cases: int, share: float) -> Iterator[str]:
    """What keeps a proof from passing, a sentence each."""
    for one in gate:
        if not one.passed and not isnan(one.value) and one.name != ENOUGH:
            counted = f" ({_counted(one)})" if _counted(one) else ""
            yield f"Missed: {one.name}: {one.value:.3g}, where {_limit(one)} is asked{counted}."
    unasked = [one.name for one in gate if isnan(one.value)]
    if unasked:
        criteria = "one criterion" if len(unasked) == 1 else f"{len(unasked)} criteria"
        yield f"No case of this run bears on {criteria}: {'; '.join(unasked)}."
    if any(one.name == ENOUGH and not one.passed for one in gate):
        few = "One case is" if cases == 1 else f"{cases} cases are"
        yield (
            f"{few} too few for the gate, whatever {'it says' if cases == 1 else 'they say'}: it is that of the full "
            f"proof, and this is "
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
    """A failed case as a row of the page, its effects in words; no severity where nothing was hidden."""
    concealed = named(case.truth) or case.outside or "nothing"
    kind = f" ({case.hidden})" if case.hidden and case.hidden != concealed else ""
    said = named(case.said)
    return {
        "case": case.id,
        "family": case.family,
        "severity": case.severity or nan,
        "concealed": f"{concealed}{kind}",
        "answered": f"{case.verdict}: {said}" if said else case.verdict,
        "why it failed": case.reason,
    }


def named(effects: Iterable[str]) -> str:
    """The `effects` of the catalogue in words, one after the other."""
    return ", ".join(label(effect) for effect in effects)
