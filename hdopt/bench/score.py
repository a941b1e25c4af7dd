"""Score answers against the sealed keys: `python -m hdopt.bench.score --dir DIR`, or `--run NAME` of a kept run.

Answers are JSON files DIR/answers/<id>.json as `hdopt diagnose --json` writes them; `marking` says how each is marked.
The keys and answers of a registered run lie beside the register (`registry`), so that anyone can score them again.
"""

from __future__ import annotations

import argparse
import itertools
import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias  # Any: values of JSON; groups are names or pairs of numbers

import numpy as np

from hdopt.bench import registry, thresholds
from hdopt.bench.arrays import Array
from hdopt.bench.marking import (
    CLAIMS,
    COMPARED,
    SETTLED,
    check_answer,
    covered,
    credit,
    explanations,
    improvement,
    told_apart,
    undecidable,
)
from hdopt.bench.scores import Bin, CaseScore, Rate, Scores

Record: TypeAlias = dict[str, Any]
"""An answer or a key as JSON has it, with values of several types."""

INVALID: Record = {"verdict": "invalid", "effects": []}


def score(answers: Mapping[str, Record], keys: Sequence[Record], raised: Mapping[str, str] | None = None) -> Scores:
    """Scores of `answers` (id -> contract dictionary) against `keys` (dictionaries as the generator seals them).

    `raised` (id -> message) says of cases without an answer why there is none.
    """
    excused = undecidable(keys)
    cases: list[CaseScore] = []
    invalid: list[str] = []
    coverage: defaultdict[str, list[bool]] = defaultdict(list)
    statements: list[tuple[float, bool]] = []
    for key in keys:
        answer = answers.get(key["id"])
        problem = (raised or {}).get(key["id"]) or check_answer(answer)
        if answer is None or problem:
            invalid.append(f"{key['id']}: {problem}")
            cases.append(_case(key, INVALID, (0.0, problem), key["id"] in excused))
            continue
        cases.append(_case(key, answer, credit(answer, key, key["id"] in excused), key["id"] in excused))
        if answer["verdict"] in ("named", "ambiguous"):
            statements += _statements(answer, key)
            _cover(answer, key, coverage)
    return _collect(tuple(cases), tuple(invalid), coverage, statements, keys)


def _statements(answer: Record, key: Record) -> list[tuple[float, bool]]:
    true = {*key["effects"], *key["beside_true"]}
    return [(effect["confidence"], effect["id"] in true) for effect in answer["effects"]]


def _cover(answer: Record, key: Record, coverage: dict[str, list[bool]]) -> None:
    for effect in answer["effects"]:
        for name, truth in key["parameters"].get(effect["id"], {}).items():
            stated = (effect.get("parameters") or {}).get(name)
            if stated and truth["identifiable"] and name in COMPARED.get(effect["id"], ()):
                coverage[f"{effect['id']}.{name}"].append(covered(stated, name, truth))


def _case(key: Record, answer: Record, marked: tuple[float, str], excused: bool) -> CaseScore:
    valid = answer["verdict"] != "invalid"
    measured = key["effects"] and key["detectable"] and not key["built"]
    gain, below = improvement(answer, key) if measured else (float("nan"), False)
    return CaseScore(
        id=key["id"],
        family=key["family"],
        gear=key["gear"],
        severity=key["severity"],
        truth=tuple(key["effects"]),
        outside=key["outside"],
        hidden=key["outside"] or key["trouble"] or key["reading"] or key["built"] or ", ".join(key["variants"]),
        verdict=answer["verdict"],
        said=tuple(effect["id"] for effect in answer["effects"]) if valid else (),
        explanations=len(explanations(answer)) if valid else 0,
        credit=marked[0],
        reason=marked[1],
        claim=not valid or answer["verdict"] in CLAIMS,
        told_apart=told_apart(key),
        excused=excused,
        improvement=gain,
        below_noise=below,
    )


def _collect(
    cases: tuple[CaseScore, ...],
    invalid: tuple[str, ...],
    coverage: Mapping[str, list[bool]],
    statements: Sequence[tuple[float, bool]],
    keys: Sequence[Record],
) -> Scores:
    empty = [case for case in cases if case.nothing]
    hidden = [case for case in cases if case.truth]
    grave = [case for case in hidden if case.severity >= thresholds.EXACT_SET_FROM_SEVERITY]
    outside = [case for case in cases if case.outside]
    gains = [case.improvement for case in hidden if np.isfinite(case.improvement)]
    definitions = min((key.get("definitions", 1) for key in keys), default=1)
    fixed = {n: hits for n, hits in coverage.items() if SETTLED.get(n.split(".")[1], 1) <= definitions}
    reliability = _reliability(statements)
    counts = sorted({len(case.truth) for case in hidden})
    return Scores(
        cases=cases,
        families=_by(cases, lambda case: case.family, lambda case: case.credit == 1),
        false_alarms=_rate(case.credit < 1 for case in empty),
        false_alarms_by_family=_by(empty, lambda case: case.family, lambda case: case.credit < 1),
        right_by_count={n: _rate(c.credit == 1 for c in grave if len(c.truth) == n) for n in counts},
        strict_by_count={n: _rate(c.credit == 1 for c in grave if len(c.truth) == n and not c.excused) for n in counts},
        right_by_size=_by(hidden, lambda case: (len(case.truth), case.severity), lambda case: case.credit == 1),
        right_by_effect={
            name: _rate(c.credit == 1 for c in grave if name in c.truth)
            for name in sorted({n for c in grave for n in c.truth})
        },
        undecidable=_rate(not case.told_apart for case in cases),
        unknown_named=_rate(c.credit < 1 and c.verdict in ("named", "ambiguous") for c in outside),
        unknown_recognised=_rate(case.credit == 1 for case in outside),
        unknown_by_form=_by(outside, lambda case: case.outside, lambda case: case.credit == 1),
        improvement=(float(np.median(gains)) if gains else float("nan"), len(gains)),
        below_noise=sum(case.below_noise for case in cases),
        coverage=_rate(hit for hits in fixed.values() for hit in hits),
        coverage_by_parameter={name: _rate(hits) for name, hits in sorted(coverage.items())},
        reliability=reliability,
        calibration_error=_calibration_error(reliability),
        log_score=_log_score(statements),
        redrawn=sum(key["redrawn"] for key in keys),
        drives=len({key["gear"] for key in keys}),
        invalid=invalid,
    )


def _rate(hits: Iterable[bool]) -> Rate:
    counted = list(hits)
    return Rate(int(sum(counted)), len(counted))


def _by(
    cases: Iterable[CaseScore], group: Callable[[CaseScore], Any], hit: Callable[[CaseScore], bool]
) -> dict[Any, Rate]:
    """Rates by group; Any, because a group may be a name or a pair of numbers."""
    groups: defaultdict[Any, list[bool]] = defaultdict(list)
    for case in cases:
        groups[group(case)].append(hit(case))
    return {name: _rate(hits) for name, hits in sorted(groups.items())}


def _calibration_error(bins: Sequence[Bin]) -> float:
    """Mean distance of stated confidence from observed frequency; rounded, so that a limit can be met exactly."""
    total = sum(b.right.n for b in bins)
    return round(sum(b.right.n * abs(b.stated - b.right.value) for b in bins) / total, 9) if total else float("nan")


def _log_score(statements: Sequence[tuple[float, bool]]) -> tuple[float, float]:
    """Mean log probability of what came true, as stated and of the best constant; NaN where nothing was stated."""
    if not statements:
        return float("nan"), float("nan")
    least = thresholds.LEAST_CONFIDENCE
    right = np.array([hit for _, hit in statements], float)

    def mean_log(stated: Array) -> float:
        p = np.clip(stated, least, 1 - least)
        return float(np.mean(right * np.log(p) + (1 - right) * np.log(1 - p)))

    return mean_log(np.array([c for c, _ in statements])), mean_log(np.full(right.size, right.mean()))


def _reliability(statements: Sequence[tuple[float, bool]]) -> tuple[Bin, ...]:
    edges = thresholds.RELIABILITY_BINS
    bins = []
    for low, high in itertools.pairwise(edges):
        inside = [(c, right) for c, right in statements if low <= c < high or (c == high == edges[-1])]
        if inside:
            stated = float(np.mean([c for c, _ in inside]))
            bins.append(Bin(low, high, stated, _rate(right for _, right in inside)))
    return tuple(bins)


def read(folder: str | Path, answers: str | Path | None = None) -> tuple[dict[str, Record], list[Record]]:
    """Answers and keys of a proof's `folder`, or of the folder `answers`. Refuses keys that are not those sealed when
    the cases were written."""
    folder = Path(folder)
    text = (folder / "sealed" / "keys.jsonl").read_text()
    checksum = (folder / "keys.sha256").read_text().strip()
    if registry.sha(text) != checksum:
        raise ValueError(
            f"{folder / 'sealed' / 'keys.jsonl'} is not what was sealed (sha256 {checksum}): generate anew"
        )
    found: dict[str, Record] = {}
    for path in sorted(Path(answers or folder / "answers").glob("*.json")):
        try:
            found[path.stem] = json.loads(path.read_text())
        except json.JSONDecodeError:
            found[path.stem] = {}
    return found, [json.loads(line) for line in text.splitlines()]


def main(arguments: Sequence[str] | None = None) -> int:
    """Score what `arguments` name and print all of it; status 0 where the gate is passed."""
    parser = argparse.ArgumentParser(prog="python -m hdopt.bench.score", description=__doc__)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--dir", type=Path, help="what the generator wrote")
    source.add_argument("--run", help="a run of the register")
    parser.add_argument("--answers", type=Path, help="default: DIR/answers")
    parser.add_argument("--register", type=Path, default=registry.FOLDER, help="folder of the register")
    options = parser.parse_args(arguments)
    if options.run:
        scores = score(*registry.kept(options.register, options.run))
    else:
        scores = score(*read(options.dir, options.answers))
    print(scores.summary())
    return 0 if scores.passed else 1


if __name__ == "__main__":
    raise SystemExit(main())
