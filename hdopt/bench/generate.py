"""Write blind cases: `python -m hdopt.bench.generate --out DIR --seed S [--families nothing,single,...]`.

DIR/cases/<id>/ holds the recordings and case.json (what a test engineer knows: the drive and the files). The truth goes
to DIR/sealed/keys.json, and its checksum to DIR/keys.sha256: whoever answers must not open `sealed` before the answers
are written to DIR/answers/<id>.json.
"""

import argparse
import hashlib
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import pyarrow as pa
import pyarrow.csv

from hdopt.bench.cases import generate
from hdopt.bench.suite import FAMILIES, plan


def write_case(numbered, folder):
    """Recordings of one numbered spec as CSV files below `folder`; its key as a dictionary."""
    number, spec = numbered
    case, key = generate(spec, f"case-{number:04d}")
    place = Path(folder) / case.id
    place.mkdir(parents=True, exist_ok=True)
    names = []
    for rank, table in enumerate(case.recordings, start=1):
        names.append(f"recording-{rank}.csv")
        pyarrow.csv.write_csv(pa.Table.from_pandas(table, preserve_index=False), place / names[-1])
    (place / "case.json").write_text(json.dumps({"id": case.id, "drive": "csf-25-80", "recordings": names}) + "\n")
    return key.to_dict()


def write(out, seed, families=FAMILIES, workers=1, progress=lambda done, total: None, **sizes):
    """Write a whole proof below `out`; returns the checksum of its keys."""
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
    text = json.dumps({"schema": 1, "seed": seed, "keys": keys}, indent=1) + "\n"
    sealed = out / "sealed"
    sealed.mkdir()
    (sealed / "keys.json").write_text(text)
    checksum = hashlib.sha256(text.encode()).hexdigest()
    (out / "keys.sha256").write_text(checksum + "\n")
    return checksum


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m hdopt.bench.generate", description=__doc__)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--seed", required=True, type=int)
    parser.add_argument("--families", default=",".join(FAMILIES), help=f"of {', '.join(FAMILIES)}")
    parser.add_argument("--nothing", type=int, default=300, help="cases with nothing hidden")
    parser.add_argument("--repeats", type=int, default=2, help="cases of every effect at every severity")
    parser.add_argument("--pairs", type=int, default=40)
    parser.add_argument("--share", type=float, default=1.0, help="part of every family to keep")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args(arguments)

    def progress(done, total):
        if sys.stderr.isatty():
            print(f"\r{done}/{total}", end="\n" if done == total else "", file=sys.stderr)

    checksum = write(
        options.out,
        options.seed,
        tuple(options.families.split(",")),
        options.workers,
        progress,
        nothing=options.nothing,
        repeats=options.repeats,
        pairs=options.pairs,
        share=options.share,
    )
    print(f"cases in {options.out / 'cases'}; keys sealed, sha256 {checksum}")


if __name__ == "__main__":
    main()
