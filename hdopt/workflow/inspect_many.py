"""Many drives of one type, a recording each: one table, the performance against the limit, outliers named."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError
from hdopt.recordings.capability import outliers, performance
from hdopt.recordings.recording import Recording
from hdopt.recordings.sheet import Batch, Unit
from hdopt.workflow.inspect import inspect


def inspect_many(
    paths: Sequence[Path],
    read: Callable[[Path], Recording],
    drive: Drive | None,
    limits: Mapping[str, float],
    seed: int = 1,
) -> Batch:
    """Inspect each of `paths` as a drive of its own, on the engine in force.

    `read` turns a path into a recording; `drive` and `limits` as for `inspect`; `seed` for fits and intervals. A file
    that cannot be read is a row that says so. Raises `HdoptError` where none can be read.
    """
    from hdopt.parallel.engine import engine_from

    work = partial(_unit, read=read, drive=drive, limits=dict(limits), seed=seed)
    units = list(engine_from(None).map(work, list(paths)))
    sound = [unit for unit in units if not unit.error]
    if not sound:
        raise HdoptError(f"none of {len(units)} recordings can be read; the first: {units[0].error[:200]}")
    values = [unit.peak_to_peak for unit in sound]
    far = {sound[k].name for k in outliers(values)}
    limit = limits.get("peak_to_peak")
    return Batch(
        tuple(replace(unit, outlier=unit.name in far and not unit.error) for unit in units),
        limit,
        None if limit is None else performance(values, limit, seed),
    )


def _unit(
    path: Path, read: Callable[[Path], Recording], drive: Drive | None, limits: dict[str, float], seed: int
) -> Unit:
    try:
        sheet = inspect([read(path)], drive, limits, seed=seed)
    except HdoptError as error:
        return Unit(path.name, error=str(error))
    verdict = next((d.verdict for d in sheet.limits if d.name == "peak_to_peak"), "")
    return Unit(
        path.name,
        sheet.recording_peak_to_peak if sheet.beat is None else sheet.beat.value,
        "recording" if sheet.beat is None else "beat",
        float(sheet.one_turn.max()) if len(sheet.one_turn) else 0.0,
        sheet.rms,
        None if sheet.returned is None else sheet.returned.median,
        verdict,
        sheet.missed,
    )
