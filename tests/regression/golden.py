"""Golden files: how answers are run, made compact, stored and compared."""

from __future__ import annotations

import contextlib
import io
import json
import math
from pathlib import Path

FOLDER = Path(__file__).parent / "golden"

# Ten digits are kept, so that rounding them (5e-11) stays far below the closest comparison, 1e-9.
DIGITS = 10

UNCOMPARED = (
    *("seconds", "elapsed_s", "duration_s", "wall_s", "file", "files", "report", "version", "output", "plots"),
    *(
        "provenance",
        "fingerprint",
        "evaluations",
        "iterations",
        "optimality_gap",
        "optimality_gap_reason",
        "optimality_residual",
    ),
)
"""Keys with times, paths, hashes of files and an optimiser's last steps, which belong to a machine and not to the
answer.
"""


def hdopt(*arguments: str) -> tuple[int, dict | None]:
    """Exit status of `hdopt ARGUMENTS --json -`, run in this process, and its JSON (None where it gave none)."""
    from hdopt.cli import main

    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        try:
            main([*arguments, "--json", "-"])
        except SystemExit as stop:
            status = stop.code
    text = out.getvalue()
    return status, json.loads(text) if status in (0, 1) and text.lstrip().startswith(("{", "[")) else None


def compact(value):
    """`value` with numbers rounded to `DIGITS` and without the keys that are not compared."""
    if isinstance(value, dict):
        return {key: compact(kept) for key, kept in value.items() if key not in UNCOMPARED}
    if isinstance(value, list):
        return [compact(part) for part in value]
    if isinstance(value, float) and math.isfinite(value):
        return float(f"{value:.{DIGITS}g}")
    return value


def differences(golden, now, relative, where=""):
    """What of `golden` is not in `now`, a line each. Keys that were added since are no difference.

    Numbers may differ by `relative` of the larger one; below `relative` of one unit (mm, arcmin, ...) they are equal.
    """
    if isinstance(golden, dict):
        golden = {key: kept for key, kept in golden.items() if key not in UNCOMPARED}
        if not isinstance(now, dict):
            return [f"{where}: {type(now).__name__}, was a table"]
        lines = []
        for key, kept in golden.items():
            place = f"{where}.{key}" if where else key
            lines += [f"{place}: gone"] if key not in now else differences(kept, now[key], relative, place)
        return lines
    if isinstance(golden, list):
        if not isinstance(now, list) or len(now) != len(golden):
            return [f"{where}: {len(now) if isinstance(now, list) else now!r} entries, were {len(golden)}"]
        pairs = enumerate(zip(golden, now, strict=True))
        return [line for i, (old, new) in pairs for line in differences(old, new, relative, f"{where}[{i}]")]
    numbers = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in (golden, now))
    if numbers and math.isclose(golden, now, rel_tol=relative, abs_tol=relative):
        return []
    return [] if golden == now else [f"{where}: {now!r}, was {golden!r}"]


def stored(group):
    """The golden answers of `group` ("commands" or "cases")."""
    return json.loads((FOLDER / f"{group}.json").read_text())


def store(group, answers):
    """Write the golden answers of `group`, one line each, so that a change shows as the lines it moved."""
    lines = [f"{json.dumps(name)}: {json.dumps(answer)}" for name, answer in sorted(answers.items())]
    (FOLDER / f"{group}.json").write_text("{\n" + ",\n".join(lines) + "\n}\n")
