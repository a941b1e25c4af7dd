"""Where a result comes from: enough to repeat it, and to see why a repetition differs."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from typing import TYPE_CHECKING, Any  # Any: values of JSON

from hdopt.files import files_of_work

if TYPE_CHECKING:
    from hdopt.study import Study

LIBRARIES = ("numpy", "scipy", "numba", "pandas", "cvxpy", "highspy", "nlopt", "SALib", "openturns", "cadquery")
"""Libraries that numbers come from."""


def provenance(study: Study | None = None, seed: int | None = None, command: str | None = None) -> dict[str, Any]:
    """Version, command, study and hash, hashes of the files read, seed, library versions, machine, start, wall time.

    Files are those that the piece of work in `hdopt.files.watching_files` has read so far; none outside of it. With
    SOURCE_DATE_EPOCH set, start and wall time are left out: two runs then give the same bytes.
    """
    work = files_of_work()
    known: dict[str, Any] = {"hdopt": own_version()}
    if command:
        known["command"] = command
    if study is not None:
        known |= {"study": study.name, "study_sha256": study.sha256}
    elif work is not None and work.facts.get("study_sha256"):
        known |= {key: work.facts[key] for key in ("study", "study_sha256")}
    known["inputs"] = {} if work is None else {path.name: digest for path, digest in sorted(work.inputs.items())}
    if seed is not None:
        known["seed"] = seed
    known["libraries"] = dict(_versions())
    known["machine"] = {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "cores": os.cpu_count(),
    }
    if work is not None and not os.environ.get("SOURCE_DATE_EPOCH"):
        known["started"] = datetime.fromtimestamp(work.began, UTC).isoformat(timespec="seconds")
        known["wall_time_s"] = round(time.time() - work.began, 3)
    return known


@cache
def own_version() -> str:
    """hdopt's, as it is installed; read from its file once a process, which takes as long as reading a study."""
    return metadata.version("hdopt")


@cache
def _versions() -> Mapping[str, str]:
    """By library; read from its files once a process."""
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found
