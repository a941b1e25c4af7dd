"""Score answers against the sealed keys: `python -m hdopt.bench.score --dir DIR`.

Answers are JSON files DIR/answers/<id>.json as `hdopt diagnose --json` writes them; `marking` says how each is marked.
"""

import argparse
import hashlib
import itertools
import json
from collections import defaultdict
from pathlib import Path

import numpy as np

from hdopt.bench import thresholds
from hdopt.bench.marking import (
    CLAIMS,
    COMPARED,
    OPEN_DEFINITIONS,
    check_answer,
    covered,
    credit,
    explanations,
    improvement,
)
from hdopt.bench.scores import Bin, CaseScore, Rate, Scores


def score(answers, keys, raised=None):
    """Scores of `answers` (id -> contract dictionary) against `keys` (dictionaries as the generator seals them).

    `raised` (id -> message) says of cases without an answer why there is none.
    """
    cases, invalid, coverage, statements = [], [], defaultdict(list), []
    for key in keys:
        answer = answers.get(key["id"])
        problem = (raised or {}).get(key["id"]) or check_answer(answer)
        if problem:
            invalid.append(f"{key['id']}: {problem}")
            cases.append(_case(key, {"verdict": "invalid", "effects": []}, 0.0, problem, float("nan"), False))
            continue
        points, reason = credit(answer, key)
        gain, below = improvement(answer, key) if key["effects"] and key["detectable"] else (float("nan"), False)
        cases.append(_case(key, answer, points, reason, gain, below))
        if answer["verdict"] not in ("named", "ambiguous"):
            continue
        for effect in answer["effects"]:
            statements.append((effect["confidence"], effect["id"] in key["effects"]))
            for name, truth in key["parameters"].get(effect["id"], {}).items():
                stated = (effect.get("parameters") or {}).get(name)
                if stated and truth["identifiable"] and name in COMPARED.get(effect["id"], ()):
                    coverage[f"{effect['id']}.{name}"].append(covered(stated, name, truth))
    return _collect(tuple(cases), tuple(invalid), coverage, statements, keys)


def _case(key, answer, points, reason, gain, below):
    valid = answer["verdict"] != "invalid"
    return CaseScore(
        id=key["id"],
        family=key["family"],
        severity=key["severity"],
        truth=tuple(key["effects"]),
        hidden=key["outside"] or key["trouble"] or ", ".join(key["variants"]),
        verdict=answer["verdict"],
        said=tuple(effect["id"] for effect in answer["effects"]) if valid else (),
        explanations=len(explanations(answer)) if valid else 0,
        credit=points,
        reason=reason,
        alarm=not valid or answer["verdict"] in CLAIMS,
        detectable=key["detectable"],
        # No answer to a case with something to gain gains nothing.
        improvement=0.0 if not valid and key["effects"] and key["detectable"] else gain,
        below_noise=below,
    )


def _collect(cases, invalid, coverage, statements, keys):
    nothing = [case for case in cases if case.family == "nothing"]
    decoys = [case for case in cases if case.family == "decoy" and not case.truth]
    hidden = [case for case in cases if case.family in ("single", "pair")]
    unknown = [case for case in cases if case.family == "unknown"]
    grave = [case for case in hidden if case.severity >= thresholds.EXACT_SET_FROM_SEVERITY]
    severities = sorted({case.severity for case in hidden})
    gains = [case.improvement for case in hidden if np.isfinite(case.improvement)]
    reliability = _reliability(statements)
    fixed = [hit for name, hits in coverage.items() if name.split(".")[1] not in OPEN_DEFINITIONS for hit in hits]
    return Scores(
        cases=cases,
        false_alarms=_rate(case.alarm for case in nothing),
        decoy_false_alarms=_rate(case.alarm for case in decoys),
        insufficient=_rate(case.verdict == "insufficient" for case in nothing),
        exact={s: _mean(case for case in hidden if case.severity == s) for s in severities},
        exact_detectable={s: _mean(c for c in hidden if c.severity == s and c.detectable) for s in severities},
        exact_by_effect={
            name: _mean(c for c in grave if name in c.truth) for name in sorted({n for c in grave for n in c.truth})
        },
        exact_gate=_mean(grave),
        exact_ceiling=_ceiling(keys),
        unknown_recall=_rate(case.verdict == "unknown" for case in unknown),
        unknown_named=_rate(case.verdict in ("named", "ambiguous") for case in unknown),
        unknown_by_kind={
            kind: _rate(c.verdict == "unknown" for c in unknown if c.hidden == kind)
            for kind in sorted({case.hidden for case in unknown})
        },
        improvement=(float(np.median(gains)) if gains else float("nan"), len(gains)),
        below_noise=sum(case.below_noise for case in cases),
        coverage=_rate(fixed),
        coverage_by_parameter={name: _rate(hits) for name, hits in coverage.items()},
        reliability=reliability,
        calibration_error=_calibration_error(reliability),
        unknown_kinds=len({key["outside"] for key in keys if key["family"] == "unknown"}),
        invalid=invalid,
    )


def _rate(hits):
    hits = list(hits)
    return Rate(int(sum(hits)), len(hits))


def _mean(cases):
    credits = [case.credit for case in cases]
    return (float(np.mean(credits)) if credits else float("nan"), len(credits))


def _calibration_error(bins):
    """Mean distance of stated confidence from observed frequency; rounded, so that a limit can be met exactly."""
    total = sum(b.right.n for b in bins)
    return round(sum(b.right.n * abs(b.stated - b.right.value) for b in bins) / total, 9) if total else float("nan")


def _ceiling(keys):
    grave = [
        k for k in keys if k["family"] in ("single", "pair") and k["severity"] >= thresholds.EXACT_SET_FROM_SEVERITY
    ]
    open_ended = [1.0 if key["separable"] else 1 / (1 + len(key["rivals"])) for key in grave]
    return float(np.mean(open_ended)) if grave else float("nan")


def _reliability(statements):
    edges = thresholds.RELIABILITY_BINS
    bins = []
    for low, high in itertools.pairwise(edges):
        inside = [(c, right) for c, right in statements if low <= c < high or (c == high == edges[-1])]
        if inside:
            stated = float(np.mean([c for c, _ in inside]))
            bins.append(Bin(low, high, stated, _rate(right for _, right in inside)))
    return tuple(bins)


def read(folder, answers=None):
    """Answers and keys of a proof's folder. Refuses keys that are not those sealed when the cases were written."""
    folder = Path(folder)
    text = (folder / "sealed" / "keys.json").read_text()
    checksum = (folder / "keys.sha256").read_text().strip()
    if hashlib.sha256(text.encode()).hexdigest() != checksum:
        raise ValueError(f"{folder / 'sealed' / 'keys.json'} is not what was sealed (sha256 {checksum}): generate anew")
    found = {}
    for path in sorted(Path(answers or folder / "answers").glob("*.json")):
        try:
            found[path.stem] = json.loads(path.read_text())
        except json.JSONDecodeError:
            found[path.stem] = {}
    return found, json.loads(text)["keys"]


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m hdopt.bench.score", description=__doc__)
    parser.add_argument("--dir", required=True, type=Path, help="what the generator wrote")
    parser.add_argument("--answers", type=Path, help="default: DIR/answers")
    options = parser.parse_args(arguments)
    scores = score(*read(options.dir, options.answers))
    print(scores.summary())
    return 0 if scores.passed else 1


if __name__ == "__main__":
    raise SystemExit(main())
