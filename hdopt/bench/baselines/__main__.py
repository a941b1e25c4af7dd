"""Have the baselines answer: `python -m hdopt.bench.baselines --dir DIR`, into DIR/baselines/METHOD/<id>.json.

What a baseline is told is what a diagnosis is told: the recordings and the gear's ratio. Nothing here opens DIR/sealed.
"""

from __future__ import annotations

import argparse
import json
import tomllib
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from hdopt.bench.baselines import METHODS
from hdopt.bench.gears import CSF


def ratio_of(folder: Path, drive: str) -> float:
    """Ratio of the `drive` that case.json in `folder` names."""
    if drive == CSF.name:
        return CSF.ratio
    told = tomllib.loads((folder / drive).read_text())["drive"]
    return float(told["flexspline_teeth"] / (told["circular_spline_teeth"] - told["flexspline_teeth"]))


def main(arguments: Sequence[str] | None = None) -> None:
    """Answer the cases of the folder that `arguments` name; answers that exist are kept."""
    parser = argparse.ArgumentParser(prog="python -m hdopt.bench.baselines", description=__doc__)
    parser.add_argument("--dir", required=True, type=Path)
    options = parser.parse_args(arguments)
    begun = json.loads((options.dir / "answers.json").read_text())["begun"]
    for path in sorted((options.dir / "cases").glob("*/case.json"))[:begun]:
        case = json.loads(path.read_text())
        tables = [pd.read_csv(path.parent / name) for name in case["recordings"]]
        ratio = ratio_of(path.parent, case["drive"])
        for name, method in METHODS.items():
            target = options.dir / "baselines" / name / f"{case['id']}.json"
            target.parent.mkdir(parents=True, exist_ok=True)
            if not target.exists():
                target.write_text(json.dumps(method(tables, ratio)))
    print(f"{len(METHODS)} baselines answered {begun} cases in {options.dir / 'baselines'}")


if __name__ == "__main__":
    main()
