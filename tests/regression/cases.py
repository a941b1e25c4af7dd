"""Short recordings of the bench: made anew from their seeds, answered by `hdopt diagnose`, only answers kept."""

from __future__ import annotations

import fcntl
import json
import tempfile
from pathlib import Path

from hdopt.bench.cases import Spec, simulate
from tests.regression.golden import compact, hdopt

# Seeds are the first, from a hundred, at which the physics can be so large in a record of at most 8000 rows.
SINGLES = {
    "cs_tooth_harmonics": {0.5: 100},
    "fs_tooth_harmonics": {1.0: 510},
    "tooth_mesh": {0.5: 120},
    "torsional_windup": {0.5: 130, 1.0: 530},
    "hysteresis": {0.5: 140, 1.0: 540},
    "lost_motion": {1.0: 550},
    "encoder_input_eccentricity": {0.5: 160, 1.0: 561},
    "encoder_output_eccentricity": {0.5: 170},
    "encoder_interpolation": {0.5: 180, 1.0: 581},
    "output_coupling": {0.5: 190},
    "bearing_pass": {0.5: 200, 1.0: 600},
    "circular_spline_lobing": {0.5: 210},
    "thermal_drift": {0.5: 220},
    "resonance": {0.5: 233},
    "local_tooth_defect": {1.0: 642},
    "channel_delay": {0.5: 250, 1.0: 650},
}
"""Effect -> its cases: size in units of the drive's own error -> seed.

Both sizes where they are answered by different rules or excuses (`tests/unit/test_named_cases.py`), and where both are
quick; else one of them. A second size of one effect goes the way of the first, through the same candidates, with
another wave. What thresholds do at faint sizes is asked number by number in
`tests/unit/test_diagnosis_numbers.py`, and case by case in a run of the proof (docs/proof.md).
"""

OUTSIDE = (
    ("belt order", 1000, 0.5),
    ("auxiliary gear", 1010, 0.5),
    ("hub slip", 1520, 1.0),
    ("one-off bump", 1530, 1.0),
    ("modulated order", 1540, 1.0),
    ("mains", 1550, 1.0),
    ("floor vibration", 1560, 1.0),
    ("slow wave", 1570, 1.0),
    ("stick-slip", 1580, 1.0),
)
NOTHING = (2000, 2001, 2002, 2003, 2005, 2006, 2007, 2008, 2009, 2011, 2015)
"""Seeds without hidden physics: each kind of motion that the bench draws is among them (one way and back, to and fro,
short strokes first, two and three speeds), and 2011, in which the search finds most to look at.
"""

DRAWN_WITH = {"encoder_interpolation 0.5": ("--seed", "0")}
"""Options of a case that draws its starts with another seed than the default: one that was answered otherwise with it,
720 lines of the output encoder as 9 of the input's."""

# A fit stands once a step drops its objective by less than 1e-5, which is sqrt(2e-5) = 0.4 % of a standard error of a
# parameter; another order of summation moved the smallest amplitudes by 0.2 % and phases by 0.01 deg. Names are exact.
FITTED = 0.01


def specs() -> dict[str, Spec]:
    """Name -> what the case is to be."""
    named = {}
    for effect, seeds in SINGLES.items():
        for severity, seed in seeds.items():
            named[f"{effect} {severity}"] = Spec("single", seed, (effect,), severity, size="brief")
    for kind, seed, severity in OUTSIDE:
        named[f"{kind} {severity}"] = Spec("unknown", seed, (), severity, kind, size="brief")
    for seed in NOTHING:
        named[f"nothing {seed}"] = Spec("nothing", seed, size="brief")
    return named


SPECS = specs()


def diagnosed(name: str, kept_in: Path | None = None) -> dict:
    """The JSON of `hdopt diagnose` on the case `name`. `kept_in` is a folder of answers given in this session: who asks
    first answers, who asks meanwhile waits."""
    if kept_in is None:
        return answered(name)
    kept = kept_in / f"{name}.json"
    with open(kept.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not kept.exists():
            draft = kept.with_suffix(".draft")
            draft.write_text(json.dumps(answered(name)))
            draft.rename(kept)
    return json.loads(kept.read_text())


def answered(name: str, options: tuple[str, ...] | None = None) -> dict:
    """The same, whatever was answered before, with these `options` of the command (None: its own)."""
    options = DRAWN_WITH.get(name, ()) if options is None else options
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for rank, table in enumerate(simulate(SPECS[name]).tables):
            files.append(str(Path(folder) / f"recording-{rank}.csv"))
            table.to_csv(files[-1], index=False)
        status, result = hdopt("diagnose", *files, *options)
    assert status == 0, f"{name}: exit status {status}"
    return result


def answer(name: str, kept_in: Path | None = None) -> dict:
    """What is kept of a diagnosis: verdict, sets, parameters, held-out errors."""
    said = diagnosed(name, kept_in)
    effects = [
        {
            "id": effect["id"],
            "confidence": effect["confidence"],
            "parameters": {key: parameter["value"] for key, parameter in effect["parameters"].items()},
        }
        for effect in said["effects"]
    ]
    fit = {key: value for key, value in said["fit"].items() if key != "false_alarm_p"}
    kept = {"verdict": said["verdict"], "effects": effects, "ambiguous_with": said["ambiguous_with"], "fit": fit}
    return compact(kept)
