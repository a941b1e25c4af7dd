"""Have every case answered by the command line: `python -m hdopt.bench.answer --dir DIR -- hdopt diagnose`.

`COMMAND REC... --drive NAME --json FILE` writes each answer to DIR/answers/<id>.json; answers that exist are kept, so
that a run can be continued. With `--minutes` no case is begun after that time. DIR/answers.json says how many were
begun, how long it took, all sittings of one program together, and which program answered. Nothing here opens
DIR/sealed.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from hdopt.bench.registry import hashes


def answer(folder: Path, out: Path, command: Sequence[str], limit_s: float = 300) -> str:
    """Run `command` on the case in `folder`, for `limit_s` at most, its answer into `out`; "" or why there is none."""
    case = json.loads((folder / "case.json").read_text())
    target = out / f"{case['id']}.json"
    if target.exists():
        return ""
    draft = target.with_suffix(".part")
    files = [str(folder / name) for name in case["recordings"]]
    drive = str(folder / case["drive"]) if (folder / case["drive"]).exists() else case["drive"]
    try:
        done = subprocess.run(
            [*command, *files, "--drive", drive, "--json", str(draft)],
            capture_output=True,
            text=True,
            timeout=limit_s,
        )
    except subprocess.TimeoutExpired:
        return f"{case['id']}: no answer within {limit_s} s"
    if done.returncode or not draft.exists():
        said = (done.stderr.strip().splitlines() or ["nothing said"])[-1]
        return f"{case['id']}: exit status {done.returncode}: {said}"
    draft.rename(target)
    return ""


def _told_before(file: Path, program: str) -> dict[str, float]:
    """What `file` says of earlier sittings of the same `program`: how many cases were begun, and how long it took."""
    told = json.loads(file.read_text()) if file.exists() else {}
    same = told.get("program") == program
    return {"begun": told["begun"] if same else 0, "seconds": told["seconds"] if same else 0.0}


def main(arguments: Sequence[str] | None = None) -> int:
    """Answer the cases that `arguments` name; status 1 where one that was begun has no answer."""
    parser = argparse.ArgumentParser(prog="python -m hdopt.bench.answer", description=__doc__)
    parser.add_argument("--dir", required=True, type=Path)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no case after this time")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for one case")
    parser.add_argument("command", nargs="+", help="after --")
    options = parser.parse_args(arguments)
    out = options.dir / "answers"
    out.mkdir(exist_ok=True)
    folders = sorted(path.parent for path in (options.dir / "cases").glob("*/case.json"))
    begun_at, program = time.monotonic(), hashes()["program"]

    def in_time(folder: Path) -> str | None:
        if time.monotonic() - begun_at > 60 * options.minutes:
            return None
        return answer(folder, out, options.command, options.limit)

    with ThreadPoolExecutor(options.workers) as pool:
        said = [problem for problem in pool.map(in_time, folders) if problem is not None]
    if hashes()["program"] != program:
        print("the program changed while it answered: these answers are of no single program", file=sys.stderr)
        return 1
    before = _told_before(options.dir / "answers.json", program)
    seconds = before["seconds"] + time.monotonic() - begun_at
    told = {"begun": max(before["begun"], len(said)), "seconds": seconds, "program": program}
    (options.dir / "answers.json").write_text(json.dumps(told) + "\n")
    problems = [problem for problem in said if problem]
    for problem in problems:
        print(problem, file=sys.stderr)
    print(f"{len(said) - len(problems)} of {len(said)} cases answered in {out}")
    return 1 if problems else 0


if __name__ == "__main__":
    raise SystemExit(main())
