"""Write blind cases: `python -m hdopt.bench.generate --out DIR --seed S [--cases N] [--families nothing,single,...]`.

DIR/cases/<id>/ holds the recordings and case.json (what a test engineer knows: the files, and the drive by its shipped
name or as a study file with its nominal geometry). The truth goes to DIR/sealed/keys.jsonl, one line a case, and its
checksum to DIR/keys.sha256: whoever answers must not open `sealed` before the answers are written to
DIR/answers/<id>.json.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any  # Any: values of JSON; sizes of cases

import pyarrow as pa
import pyarrow.csv

from hdopt.bench.cases import Spec, generate
from hdopt.bench.gears import CSF, GEARS, study_text
from hdopt.bench.registry import lines, sha
from hdopt.bench.suite import FAMILIES, FULL, plan


def write_case(numbered: tuple[int, Spec], folder: Path) -> dict[str, Any]:
    """Recordings of one numbered spec as CSV files below `folder`; its key as a dictionary."""
    number, spec = numbered
    case, key = generate(spec, f"case-{number:04d}")
    place = Path(folder) / case.id
    place.mkdir(parents=True, exist_ok=True)
    names = []
    for rank, table in enumerate(case.recordings, start=1):
        names.append(f"recording-{rank}.csv")
        pyarrow.csv.write_csv(pa.Table.from_pandas(table, preserve_index=False), place / names[-1])
    drive = CSF.name
    if spec.gear != CSF.name:
        drive = "drive.toml"
        (place / drive).write_text(study_text(GEARS[spec.gear]))
    (place / "case.json").write_text(json.dumps({"id": case.id, "drive": drive, "recordings": names}) + "\n")
    return key.to_dict()


def write(
    out: str | Path,
    seed: int,
    families: Sequence[str] = (),
    workers: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
    **sizes: Any,
) -> str:
    """Write the cases that `seed` draws below `out`, by `workers` processes; returns the checksum of their keys.

    `families` and `sizes` as in `suite.plan`; `progress` is told how many are done.
    """
    out = Path(out)
    if (out / "cases").exists():
        raise FileExistsError(
            f"{out / 'cases'} exists already: answers there would mix with new cases; choose another --out"
        )
    specs = list(enumerate(plan(seed, families, **sizes), start=1))
    keys = []
    make = partial(write_case, folder=out / "cases")
    if workers > 1:
        with ProcessPoolExecutor(workers) as pool:
            for key in pool.map(make, specs, chunksize=4):
                keys.append(key)
                progress(len(keys), len(specs))
    else:
        for spec in specs:
            keys.append(make(spec))
            progress(len(keys), len(specs))
    text = lines(keys)
    sealed = out / "sealed"
    sealed.mkdir()
    (sealed / "keys.jsonl").write_text(text)
    checksum = sha(text)
    (out / "keys.sha256").write_text(checksum + "\n")
    return checksum


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the cases that the command line's `arguments` ask for (those of this process if None)."""
    parser = argparse.ArgumentParser(prog="python -m hdopt.bench.generate", description=__doc__)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--seed", required=True, type=int)
    parser.add_argument("--families", default="", help=f"these alone, of {', '.join(FAMILIES)}")
    parser.add_argument("--cases", type=int, default=FULL, help="how many; every family keeps its share")
    parser.add_argument("--gears", default=",".join(GEARS), help="drives to draw from")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args(arguments)

    def progress(done: int, total: int) -> None:
        if sys.stderr.isatty():
            print(f"\r{done}/{total}", end="\n" if done == total else "", file=sys.stderr)

    checksum = write(
        options.out,
        options.seed,
        tuple(filter(None, options.families.split(","))),
        options.workers,
        progress,
        cases=options.cases,
        gears=tuple(options.gears.split(",")),
    )
    print(f"cases in {options.out / 'cases'}; keys sealed, sha256 {checksum}")


if __name__ == "__main__":
    main()
