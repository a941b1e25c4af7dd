"""Whether the confidence of a name can be computed: `python -m tests.benchmarks.confidence_fit`

Reads `confidence-cases.jsonl`, learns the chance that a name is right from what carries it, and holds it against the
best constant by log score, each case left out in turn with all of its names.
"""

from __future__ import annotations

import argparse
import json
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from tests.benchmarks.confidence_cases import KEPT

RIDGE = 1.0
"""Penalty on a slope per standard deviation of its feature: a normal prior of unit width."""
LIMIT = 0.002
"""Chances are kept this far from 0 and 1 in scores."""
BINS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.98, 1.0)


def names(cases: list[dict]) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Of each name in `cases`: the features' names, their values (n, k), whether it is right (n,), its case (n,)."""
    rows, right, group = [], [], []
    for number, case in enumerate(cases):
        for effect in case.get("effects", []):
            rows.append(features(case, effect))
            right.append(effect["id"] in {*case["truth"], *case["beside_true"]})
            group.append(number)
    return list(rows[0]), np.array([list(one.values()) for one in rows]), np.array(right, float), np.array(group)


def features(case: dict, effect: dict) -> dict[str, float]:
    """What may carry the name of an `effect` in a `case`, each larger where more speaks for it."""
    fit, nested = case["fit"], case["nested"]
    unseen = fit["heldout_nested_rms_arcmin"] or fit["heldout_rms_extended_arcmin"]
    apart = effect["log_evidence_apart"]
    return {
        "log of evidence apart": np.log1p(max(apart if apart is not None else 100.0, 0.0)),
        "log of floor over unseen": -np.log(unseen / fit["noise_floor_arcmin"]),
        "log of placebo over extended": np.log(fit["heldout_rms_placebo_arcmin"] / fit["heldout_rms_extended_arcmin"]),
        "log of its size over the floor": np.log(effect["rms_arcmin"] / fit["noise_floor_arcmin"]),
        "found again": 0.5 if nested is None else float(effect["id"] in nested["effects"]),
        "only explanation": float(case["verdict"] == "named"),
        "alone": float(len(case["effects"]) == 1),
    }


def logistic(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slopes (k + 1,), the constant first, on `x` (n, k) shifted and scaled by what comes second and third."""
    middle, spread = x.mean(0), np.where(x.std(0) > 0, x.std(0), 1.0)
    design = np.column_stack([np.ones(len(x)), (x - middle) / spread])

    def loss(slopes: np.ndarray) -> float:
        score = design @ slopes
        return float(np.sum(np.logaddexp(0, score) - y * score) + RIDGE * np.sum(slopes[1:] ** 2) / 2)

    return minimize(loss, np.zeros(design.shape[1])).x, middle, spread


def chance(learned: tuple[np.ndarray, np.ndarray, np.ndarray], x: np.ndarray) -> np.ndarray:
    """Chances (n,) that names with the features `x` (n, k) are right."""
    slopes, middle, spread = learned
    return np.clip(expit(slopes[0] + (x - middle) / spread @ slopes[1:]), LIMIT, 1 - LIMIT)


def log_score(p: np.ndarray, y: np.ndarray) -> float:
    """Mean log of the chance given to what was so."""
    return float(np.mean(np.log(np.where(y > 0, p, 1 - p))))


def left_out(x: np.ndarray, y: np.ndarray, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chances (n,) by the features and by the constant, each case left out of what was learned."""
    learned, constant = np.empty(len(y)), np.empty(len(y))
    for one in np.unique(group):
        out = group == one
        learned[out] = chance(logistic(x[~out], y[~out]), x[out])
        constant[out] = np.clip(y[~out].mean(), LIMIT, 1 - LIMIT)
    return learned, constant


def main() -> None:
    """Print scores, slopes and the reliability of `--cases`."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=Path, default=KEPT)
    options = parser.parse_args()
    cases = [json.loads(line) for line in options.cases.read_text().splitlines()]
    answered = [case for case in cases if "error" not in case]
    labels, x, y, group = names(answered)
    print(f"{len(answered)} cases answered of {len(cases)}")
    print(f"{len(y)} names in {len(np.unique(group))} cases, {int(y.sum())} right")
    learned, constant = left_out(x, y, group)
    print(f"log score: features {log_score(learned, y):.4f}, constant {log_score(constant, y):.4f}")
    for i, label in enumerate(labels):
        alone, _ = left_out(x[:, [i]], y, group)
        print(f"  {label} alone {log_score(alone, y):.4f}")
    said = np.array([effect["confidence"] for case in answered for effect in case["effects"]])
    print(f"  as said {log_score(np.clip(said, LIMIT, 1 - LIMIT), y):.4f}")
    slopes, middle, spread = logistic(x, y)
    print(f"constant {slopes[0]:.3f}")
    for label, slope, m, s in zip(labels, slopes[1:], middle, spread, strict=True):
        print(f"{label}: {slope:.3f} per {s:.3f} from {m:.3f}")
    print("| computed, case left out | names | mean | right |")
    for low, high in pairwise(BINS):
        inside = (learned >= low) & (learned < high)
        if inside.any():
            print(f"| {low:g}-{high:g} | {inside.sum()} | {learned[inside].mean():.3f} | {y[inside].mean():.3f} |")


if __name__ == "__main__":
    main()
