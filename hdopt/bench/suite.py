"""Which cases a proof is made of. The order is shuffled, so that a case's name says nothing of what is in it.

The full proof has a thousand cases over four drives; `cases` draws a part of it that keeps the families' shares.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, cycle, islice
from typing import Any, TypeAlias  # Any: fields of a case, which are of several types

import numpy as np

from hdopt.bench.cases import CATALOGUE, ONE_IN_THE_OTHER, TROUBLES, Spec
from hdopt.bench.gears import BUILT, GEARS
from hdopt.bench.hidden_outside import ALL_KINDS
from hdopt.bench.readings import BITS, ORIENTATIONS, SCALES

FULL = 1000
SEVERITIES = (0.1, 0.25, 0.5, 1.0)
# Physics that the other orientation of both angles must not hide or double.
MIRRORED_EFFECTS = ("hysteresis", "output_coupling", "encoder_input_eccentricity", "cs_tooth_harmonics")
# What a change of speed within a record shows, or must not hide.
STEPPED_EFFECTS = ("resonance", "channel_delay", "hysteresis", "lost_motion")
# What can be as large as asked for in a record of a few turns.
TURNS_EFFECTS = ("cs_tooth_harmonics", "hysteresis", "lost_motion", "circular_spline_lobing")
HUMS = (0.3, 1.0, 3.0)


def plan(
    seed: int,
    families: Sequence[str] = (),
    cases: int = FULL,
    gears: Sequence[str] = tuple(GEARS),
    share: float = 1.0,
) -> list[Spec]:
    """Specs of a proof: `cases` of the thousand that `seed` draws, or the part `share` of those, on `gears`.

    `families` keeps these alone (empty: all). Every family keeps its share of the cases, and one case at least.
    """
    known = tuple(_families(np.random.default_rng(0)))
    for family in families:
        if family not in known:
            raise ValueError(f"unknown family {family!r}; there are {', '.join(known)}")
    for gear in gears:
        if gear not in GEARS:
            raise ValueError(f"unknown gear {gear!r}; there are {', '.join(GEARS)}")
    rng = np.random.default_rng(seed)
    wanted: list[Spec] = []
    for family, made in _families(rng).items():
        count = max(1, round(len(made) * share * cases / FULL))
        kept = [made[i] for i in rng.permutation(len(made))[:count]]
        drives = rng.permutation(list(islice(cycle(gears), count)))
        seeds = rng.integers(2**31, size=count)
        if not families or family in families:
            wanted += [
                Spec(family, int(s), **{"gear": str(gear), **more})
                for more, gear, s in zip(kept, drives, seeds, strict=True)
            ]
    return [wanted[i] for i in rng.permutation(len(wanted))]


Asked: TypeAlias = dict[str, Any]
"""Fields of a `Spec`, which are of several types."""


def _families(rng: np.random.Generator) -> dict[str, list[Asked]]:
    """Name -> what is asked of each case, in the full proof; what is drawn comes from `rng`."""
    return {
        "nothing": [{}] * 150,
        "single": _singles(4),
        # Loads that reach the knees of the torsional curve move the output by far more than the base does.
        "knee": [{"effects": ("torsional_windup",), "severity": s} for s in (8.0,) * 5 + (25.0,) * 3],
        "pair": _sets(rng, 2, 100),
        "triple": _sets(rng, 3, 60),
        "decoy": _decoys(rng),
        "unknown": _unknowns(rng, 150),
        "orientation": _orientations(),
        "scale": [{"reading": r, "size": "small"} for r in SCALES for _ in range(5)],
        "long": [{"reading": "long and clean", "size": "long"}] * 10,
        "coarse": [{"reading": r, "size": "small"} for r in (*BITS, "rows missing") for _ in range(8)],
        "hum": [{"hum": hum, "size": "small"} for hum in HUMS for _ in range(4)],
        "built": _built(rng),
        "speed steps": _speed_steps(),
        "turns": _turns(rng),
        "swing": [
            {"effects": ("resonance",), "severity": s, "whole_motion": True} for s in (0.5, 1.0) for _ in range(4)
        ],
    }


def _singles(repeats: int) -> list[Asked]:
    return [
        {"effects": (effect,), "severity": severity}
        for effect in CATALOGUE
        for severity in SEVERITIES
        for _ in range(repeats)
    ]


def _sets(rng: np.random.Generator, size: int, count: int) -> list[Asked]:
    """`count` sets of `size` effects, a quarter, half or all of the drive's own error each."""
    allowed = [
        found for found in combinations(CATALOGUE, size) if not any(both <= set(found) for both in ONE_IN_THE_OTHER)
    ]
    drawn = rng.choice(len(allowed), count, replace=False)
    return [{"effects": allowed[i], "severity": (0.25, 0.5, 1.0)[rank % 3]} for rank, i in enumerate(drawn)]


def _decoys(rng: np.random.Generator) -> list[Asked]:
    made: list[Asked] = []
    for trouble in TROUBLES:
        made += [{"trouble": trouble, "size": "small"}] * 4
        for effect in rng.choice(list(CATALOGUE), 3, replace=False):
            made.append({"trouble": trouble, "effects": (str(effect),), "severity": 0.5})
    return made


def _orientations() -> list[Asked]:
    made: list[Asked] = [{"reading": r, "size": "small"} for r in ORIENTATIONS for _ in range(12)]
    return made + [
        {"reading": ORIENTATIONS[0], "effects": (effect,), "severity": s}
        for effect in MIRRORED_EFFECTS
        for s in (0.25, 0.5, 0.5, 1.0)
    ]


def _unknowns(rng: np.random.Generator, count: int) -> list[Asked]:
    """`count` outsiders: every form once before any comes again, in an order drawn anew."""
    forms = [str(kind) for _ in range(count // len(ALL_KINDS) + 1) for kind in rng.permutation(ALL_KINDS)]
    return [{"outside": kind, "severity": (0.25, 0.5, 1.0)[rank % 3]} for rank, kind in enumerate(forms[:count])]


def _built(rng: np.random.Generator) -> list[Asked]:
    made: list[Asked] = [{"built": kind, "size": "small"} for kind in BUILT for _ in range(14)]
    effects = rng.choice(list(CATALOGUE), 15, replace=False)
    return made + [
        {"built": BUILT[rank % 3], "effects": (str(effect),), "severity": 0.5} for rank, effect in enumerate(effects)
    ]


def _speed_steps() -> list[Asked]:
    made: list[Asked] = [{"speed_steps": True, "size": "small"}] * 8
    return made + [
        {"speed_steps": True, "effects": (effect,), "severity": s} for effect in STEPPED_EFFECTS for s in (0.5, 1.0)
    ]


def _turns(rng: np.random.Generator) -> list[Asked]:
    """Records of 3 to 400 input turns."""
    turns = np.exp(rng.uniform(np.log(3), np.log(400), 23))
    made: list[Asked] = [{"turns": float(t)} for t in turns[:13]]
    return made + [
        {"turns": float(t), "effects": (TURNS_EFFECTS[rank % 4],), "severity": (0.5, 1.0)[rank % 2]}
        for rank, t in enumerate(turns[13:])
    ]


FAMILIES = tuple(_families(np.random.default_rng(0)))
