"""Which cases a proof is made of. The order is shuffled, so that a case's name says nothing of what is in it."""

from itertools import combinations

import numpy as np

from hdopt.bench.cases import CATALOGUE, ONE_IN_THE_OTHER, TROUBLES, Spec
from hdopt.bench.hidden_outside import KINDS
from hdopt.bench.readings import BITS, ORIENTATIONS, SCALES

SEVERITIES = (0.1, 0.25, 0.5, 1.0)
FAMILIES = ("nothing", "single", "knee", "pair", "decoy", "unknown", "orientation", "scale", "long", "coarse", "swing")
# Physics that the other orientation of both angles must not hide or double.
MIRRORED_EFFECTS = ("hysteresis", "output_coupling", "encoder_input_eccentricity", "cs_tooth_harmonics")


def plan(seed, families=FAMILIES, nothing=300, repeats=2, pairs=40, share=1.0):
    """Specs of a proof. `share` below 1 keeps that part of every family (a small proof for continuous integration)."""
    for family in families:
        if family not in FAMILIES:
            raise ValueError(f"unknown family {family!r}; there are {', '.join(FAMILIES)}")
    rng = np.random.default_rng(seed)
    makers = {
        "nothing": lambda: [("nothing", {})] * nothing,
        "single": lambda: _singles(repeats),
        # Loads that reach the knees of the torsional curve move the output by far more than the base does.
        "knee": lambda: [
            ("single", {"effects": ("torsional_windup",), "severity": s}) for s in (8.0,) * 4 + (25.0,) * 2
        ],
        "pair": lambda: _pairs(rng, pairs),
        "decoy": lambda: _decoys(rng),
        "unknown": lambda: _unknowns(),
        "orientation": lambda: _orientations(),
        "scale": lambda: [("scale", {"reading": r, "size": "small"}) for r in SCALES for _ in range(4)],
        "long": lambda: [("long", {"reading": "long and clean", "size": "long"})] * 5,
        "coarse": lambda: [
            ("coarse", {"reading": r, "size": "small"}) for r in (*BITS, "rows missing") for _ in range(4)
        ],
        "swing": lambda: [
            ("swing", {"effects": ("resonance",), "severity": s, "whole_motion": True}) for s in (0.5, 0.5, 1.0, 1.0)
        ],
    }
    wanted = []
    for family in FAMILIES:
        made = makers[family]()
        kept = made if share >= 1 else [made[i] for i in rng.permutation(len(made))[: max(1, round(share * len(made)))]]
        seeds = rng.integers(2**31, size=len(kept))
        if family in families:
            wanted += [Spec(name, int(s), **more) for (name, more), s in zip(kept, seeds, strict=True)]
    return [wanted[i] for i in rng.permutation(len(wanted))]


def _singles(repeats):
    return [
        ("single", {"effects": (effect,), "severity": severity})
        for effect in CATALOGUE
        for severity in SEVERITIES
        for _ in range(repeats)
    ]


def _pairs(rng, count):
    allowed = [pair for pair in combinations(CATALOGUE, 2) if set(pair) not in ONE_IN_THE_OTHER]
    drawn = rng.choice(len(allowed), count, replace=False)
    return [("pair", {"effects": allowed[i], "severity": (0.5, 1.0)[rank % 2]}) for rank, i in enumerate(drawn)]


def _decoys(rng):
    effects = list(CATALOGUE)
    made = []
    for trouble in TROUBLES:
        made += [("decoy", {"trouble": trouble})] * 4
        for effect in rng.choice(effects, 3, replace=False):
            made.append(("decoy", {"trouble": trouble, "effects": (str(effect),), "severity": 0.5}))
    return made


def _orientations():
    made = [("orientation", {"reading": r, "size": "small"}) for r in ORIENTATIONS for _ in range(4)]
    return made + [
        ("orientation", {"reading": ORIENTATIONS[0], "effects": (effect,), "severity": 0.5})
        for effect in MIRRORED_EFFECTS
    ]


def _unknowns():
    return [
        ("unknown", {"outside": kind, "severity": severity})
        for kind in KINDS
        for severity in (0.25, 0.5, 0.5, 1.0, 1.0)
    ]
