"""Cases on which the confidence of a name is learned: short records of the bench, answered by the diagnosis.

    python -m tests.benchmarks.confidence_cases --workers 2

A run that was stopped is resumed. None of the cases is a golden one or one of a proof: their seeds are their own. Of
each answer only what the confidence is computed from is kept, with the truth beside it, one JSON object a line in
`confidence-cases.jsonl`.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import combinations
from pathlib import Path

import numpy as np

from hdopt.bench.cases import CATALOGUE, ONE_IN_THE_OTHER, TROUBLES, Spec, generate
from hdopt.bench.gears import BUILT
from hdopt.bench.hidden_outside import ALL_KINDS
from hdopt.recordings.read import recording_from_table
from hdopt.study import load_study

KEPT = Path(__file__).with_name("confidence-cases.jsonl")
SEED = 20_190_000
SINGLES, PAIRS, TRIPLES, OUTSIDERS, NOTHING, BESIDE = 80, 40, 20, 40, 12, 16
TURNS = 16, 36
"""Input turns of a stroke: some can be hidden from a whole diagnosis, and an answer takes 5 to 20 s."""
TROUBLED = tuple(trouble for trouble in TROUBLES if trouble != "short")  # a brief record is short already


def specs() -> list[Spec]:
    """All cases, in an order in which any beginning holds every family."""
    rng = np.random.default_rng(SEED)
    effects = list(CATALOGUE)
    allowed = [[s for s in combinations(effects, n) if not any(b <= set(s) for b in ONE_IN_THE_OTHER)] for n in (2, 3)]
    asked: list[dict[str, object]] = [
        {"family": "single", "effects": (effects[i % len(effects)],), "severity": severity(rng)} for i in range(SINGLES)
    ]
    for family, sets, count in (("pair", allowed[0], PAIRS), ("triple", allowed[1], TRIPLES)):
        for i in rng.choice(len(sets), count, replace=False):
            asked.append({"family": family, "effects": sets[i], "severity": severity(rng)})
    kinds = [str(kind) for kind in rng.permutation(ALL_KINDS)]
    asked += [
        {"family": "unknown", "outside": kinds[i % len(kinds)], "severity": severity(rng)} for i in range(OUTSIDERS)
    ]
    asked += [{"family": "nothing"}] * NOTHING
    for i in range(BESIDE):
        beside = {"built": BUILT[i % len(BUILT)]} if i % 2 else {"trouble": TROUBLED[i // 2 % len(TROUBLED)]}
        hidden = {"effects": (str(rng.choice(effects)),), "severity": severity(rng)} if i % 4 > 1 else {}
        asked.append({"family": "beside", **beside, **hidden})
    seeds = SEED + np.arange(len(asked))
    turns = rng.integers(*TURNS, len(asked))
    made = [
        Spec(seed=int(s), size="brief", turns=float(t), **one) for s, t, one in zip(seeds, turns, asked, strict=True)
    ]
    return [made[i] for i in rng.permutation(len(made))]


def severity(rng: np.random.Generator) -> float:
    """A severity from 0.1 to 1, as likely in one octave as in another, drawn by `rng`."""
    return round(float(np.exp(rng.uniform(np.log(0.1), 0.0))), 3)


def answered(spec: Spec) -> dict[str, object]:
    """What is kept of the diagnosis of the case `spec`, with its truth."""
    from hdopt.diagnosis.pipeline import gather_evidence
    from hdopt.diagnosis.verdict.draw import draw_verdict
    from hdopt.diagnosis.verdict.facts import find
    from hdopt.kinematics.cartesian import CartesianModel
    from hdopt.parallel.workers import one_linear_algebra_thread

    case, key = generate(spec)
    drive = load_study(drive="csf-25-80").drive
    ratio = drive.geometry.ratio
    began = time.process_time()
    with one_linear_algebra_thread():
        read = [recording_from_table(t, ratio, name=f"recording {i + 1}") for i, t in enumerate(case.recordings)]
        evidence = gather_evidence(read, CartesianModel.of(drive), 1)
        said = draw_verdict(evidence, ())
        findings = find(evidence)
    facts = findings.facts
    nested = evidence.nested
    numbers = {name: value for name, value in vars(facts).items() if isinstance(value, bool | int | float)}
    return {
        "seed": spec.seed,
        "family": spec.family,
        "truth": list(spec.effects),
        "beside_true": list(key.beside_true),
        "severity": spec.severity,
        "outside": spec.outside,
        "separable": bool(key.separable),
        "verdict": said.verdict,
        "rule": said.rule,
        "ambiguous_with": said.to_dict()["ambiguous_with"],
        "fit": dict(said.fit),
        "facts": numbers,
        "nested": None if nested is None else {"effects": list(nested.effects), "turns": nested.turns},
        "turns": evidence.rows.blocks,
        "rows": len(evidence.rows),
        "candidates": [[list(c.effects), c.log_bayes_factor] for c in evidence.selection.candidates[:8]],
        "effects": [
            {
                "id": one.id,
                "confidence": one.confidence,
                "log_evidence_apart": one.log_evidence_apart,
                "rms_arcmin": one.where["rms_arcmin"],
                "share": one.where["share_of_residual"],
                "imitates": max((p.imitates for p in findings.pairs if p.effect == one.id), default=0.0),
                "apart": min((p.evidence_apart for p in findings.pairs if p.effect == one.id), default=None),
            }
            for one in said.effects
        ],
        "cpu_s": round(time.process_time() - began, 1),
    }


def line(spec: Spec) -> str:
    """`answered(spec)` as a line of JSON; a case that cannot be drawn or answered says why."""
    try:
        kept = answered(spec)
    except Exception as error:  # one case must not end the run
        kept = {"seed": spec.seed, "family": spec.family, "error": f"{type(error).__name__}: {error}"}

    def short(value: object) -> object:
        return float(f"{value:.6g}") if isinstance(value, float) else value

    text = json.dumps(kept, default=lambda value: value.item())
    return json.dumps(json.loads(text, parse_float=lambda v: short(float(v))), separators=(",", ":"))


def main() -> None:
    """Answer what `--out` does not hold yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=KEPT)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--most", type=int, default=10_000)
    options = parser.parse_args()
    done = {json.loads(one)["seed"] for one in options.out.read_text().splitlines()} if options.out.exists() else set()
    todo = [spec for spec in specs()[: options.most] if spec.seed not in done]
    with ProcessPoolExecutor(options.workers) as pool, options.out.open("a") as out:
        for text in pool.map(line, todo):
            out.write(text + "\n")
            out.flush()


if __name__ == "__main__":
    main()
