"""A whole proof within one process, for a small run in continuous integration or while a diagnosis is being built."""

from tests.blind.cases import generate
from tests.blind.score import score
from tests.blind.suite import plan


def prove(diagnose, seed, **sizes):
    """Scores of `diagnose`, a function from a case's recordings (tuple of tables) to an answer by the contract.

    `sizes` are those of `suite.plan`: families, nothing, repeats, pairs, share. The keys stay in here until every
    answer is given; an answer that raises counts as none, and its message is what `Scores.invalid` shows.
    """
    answers, keys, raised = {}, [], {}
    for number, spec in enumerate(plan(seed, **sizes), start=1):
        case, key = generate(spec, f"case-{number:04d}")
        keys.append(key.to_dict())
        try:
            answers[case.id] = diagnose(case.recordings)
        except Exception as error:
            raised[case.id] = f"{type(error).__name__}: {error}"
    return score(answers, keys, raised)
