"""Have every case answered by the command line: `python -m hdopt.bench.answer --dir DIR -- hdopt diagnose`.

`COMMAND REC... --drive NAME --json FILE` writes each answer to DIR/answers/<id>.json; answers that exist are kept, so
that a run can be continued. Nothing here opens DIR/sealed.
"""

import argparse
import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


def answer(folder, out, command, limit_s=300):
    """Run `command` on the case in `folder`; returns "" or why there is no answer."""
    case = json.loads((folder / "case.json").read_text())
    target = out / f"{case['id']}.json"
    if target.exists():
        return ""
    draft = target.with_suffix(".part")
    files = [str(folder / name) for name in case["recordings"]]
    try:
        done = subprocess.run(
            [*command, *files, "--drive", case["drive"], "--json", str(draft)],
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


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m hdopt.bench.answer", description=__doc__)
    parser.add_argument("--dir", required=True, type=Path)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("command", nargs="+", help="after --")
    options = parser.parse_args(arguments)
    out = options.dir / "answers"
    out.mkdir(exist_ok=True)
    folders = sorted(path.parent for path in (options.dir / "cases").glob("*/case.json"))
    with ThreadPoolExecutor(options.workers) as pool:
        problems = [p for p in pool.map(lambda f: answer(f, out, options.command), folders) if p]
    for problem in problems:
        print(problem, file=sys.stderr)
    print(f"{len(folders) - len(problems)} of {len(folders)} cases answered in {out}")
    return 1 if problems else 0


if __name__ == "__main__":
    raise SystemExit(main())
