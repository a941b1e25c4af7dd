"""How often a name is right, by what its answer shows: `python -m tests.benchmarks.confidence_fit [RUN...] [--on RUN]`

Reads the kept answers of registered runs of the blind proof (docs/proof), learns the log odds that a name in a `named`
answer is right from how many are named and from how much of the noise floor's multiple is left on turns left out, and
holds that against the best constant by log score, each run left out in turn. The slopes of all runs stand in
`hdopt/diagnosis/settings.py` (`right_*`). `--on` tries them as they stand there on a run that they were not learned on.
"""

from __future__ import annotations

import argparse
import math
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from hdopt.bench import registry
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict.named_effect import chance_right

RUNS = ("run-014", "run-015", "run-016", "run-017", "run-018")
FEATURES = ("names beside it", "log of held-out error over the floor")
CAP = 0.97
"""What all names had before they were told apart."""
BINS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.97, 1.0)


def names(run: str) -> tuple[np.ndarray, np.ndarray]:
    """Of each name of the `named` answers of a registered `run`: its features (n, 2), and whether it is right (n,)."""
    answers, keys = registry.kept(registry.FOLDER, run)
    rows, right = [], []
    for key in keys:
        answer = answers.get(key["id"])
        if not answer or answer.get("verdict") != "named":
            continue
        over = np.log(answer["fit"]["heldout_rms_extended_arcmin"] / answer["fit"]["noise_floor_arcmin"])
        for effect in answer["effects"]:
            rows.append([len(answer["effects"]) - 1, np.clip(over, 0, np.log(DEFAULT.verdict.right_most_over))])
            right.append(effect["id"] in {*key["effects"], *key["beside_true"]})
    return np.array(rows), np.array(right, float)


def logistic(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Log odds at zero and slopes (k + 1,) on `x` (n, k) by greatest likelihood of `y` (n,)."""
    design = np.column_stack([np.ones(len(x)), x])

    def loss(slopes: np.ndarray) -> float:
        score = design @ slopes
        return float(np.sum(np.logaddexp(0, score) - y * score))

    return minimize(loss, np.zeros(design.shape[1])).x


def chance(slopes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Chances (n,) that names with the features `x` (n, k) are right."""
    return expit(slopes[0] + x @ slopes[1:])


def log_score(p: np.ndarray, y: np.ndarray) -> float:
    """Mean log of the chance given to what was so."""
    return float(np.mean(np.log(np.where(y > 0, p, 1 - p))))


def reliability(p: np.ndarray, y: np.ndarray) -> None:
    """Print how many names were right by their chance."""
    print("| chance | names | mean | right |")
    for low, high in pairwise(BINS):
        inside = (p >= low) & (p < high)
        if inside.any():
            print(f"| {low:g}-{high:g} | {inside.sum()} | {p[inside].mean():.3f} | {y[inside].mean():.3f} |")


def main() -> None:
    """Print slopes, scores and the reliability of the runs named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", default=RUNS)
    parser.add_argument("--on", metavar="RUN", help="a run to try the shipped slopes on")
    options = parser.parse_args()
    if options.on:
        x, y = names(options.on)
        p = np.array([chance_right(1 + beside, math.exp(over), DEFAULT.verdict) for beside, over in x])
        cap, best = (log_score(np.full(len(y), one), y) for one in (CAP, y.mean()))
        print(f"{options.on}: {len(y)} names, {int(y.sum())} right")
        print(
            f"log score as shipped {log_score(p, y):.4f}, by {CAP} for all {cap:.4f}, by the best constant {best:.4f}"
        )
        reliability(p, y)
        return
    known = {run: names(run) for run in options.runs}
    x, y = (np.concatenate([one[i] for one in known.values()]) for i in (0, 1))
    print(f"{len(y)} names, {int(y.sum())} right")
    learned, constant, seen = [], [], []
    for run, (own, right) in known.items():
        others = [one for name, one in known.items() if name != run]
        rest, so = (np.concatenate([one[i] for one in others]) for i in (0, 1))
        learned.append(chance(logistic(rest, so), own))
        constant.append(np.full(len(right), so.mean()))
        seen.append(right)
    p, c, y_seen = (np.concatenate(one) for one in (learned, constant, seen))
    print(f"each run left out: log score {log_score(p, y_seen):.4f}, by the constant {log_score(c, y_seen):.4f}")
    reliability(p, y_seen)
    slopes = logistic(x, y)
    print(f"log odds alone at the floor {slopes[0]:.3f}")
    for label, slope in zip(FEATURES, slopes[1:], strict=True):
        print(f"{label}: {slope:.3f}")


if __name__ == "__main__":
    main()
