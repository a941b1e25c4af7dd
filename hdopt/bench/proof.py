"""A whole proof within one process, for a small run in continuous integration or while a diagnosis is being built."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any  # Any: values of JSON; sizes of cases

import pandas as pd

from hdopt.bench.cases import Case, generate
from hdopt.bench.gears import CSF
from hdopt.bench.score import score
from hdopt.bench.scores import Scores
from hdopt.bench.suite import plan


def prove(
    diagnose: Callable[[tuple[pd.DataFrame, ...]], dict[str, Any]],
    seed: int,
    spread: Callable[..., Iterable[Any]] = map,
    gears: Sequence[str] = (CSF.name,),
    **sizes: Any,
) -> Scores:
    """Scores of `diagnose`, a function from a case's recordings (tuple of tables) to an answer by the contract.

    `seed` draws the cases, of the drives `gears`; `sizes` are those of `suite.plan`: families, cases, share. The keys
    stay in here until every answer is given; an answer that raises counts as none, and its message is what
    `Scores.invalid` shows. `spread` is a map that may do the cases elsewhere, results in order.
    """
    answers: dict[str, dict[str, Any]] = {}
    keys: list[dict[str, Any]] = []
    raised: dict[str, str] = {}

    def cases() -> Iterator[Case]:
        for number, spec in enumerate(plan(seed, gears=gears, **sizes), start=1):
            case, key = generate(spec, f"case-{number:04d}")
            keys.append(key.to_dict())
            yield case

    def answered(case: Case) -> tuple[str, dict[str, Any] | None, str | None]:
        try:
            return case.id, diagnose(case.recordings), None
        except Exception as error:
            return case.id, None, f"{type(error).__name__}: {error}"

    for name, answer, failure in spread(answered, cases()):
        if failure is None:
            answers[name] = answer
        else:
            raised[name] = failure
    return score(answers, keys, raised)
