"""From "simulation and recording differ" to "this physics was left out": the public call."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hdopt.errors import HdoptError

if TYPE_CHECKING:
    from hdopt.diagnosis.settings import DiagnosisSettings
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis
    from hdopt.drive.geometry import Drive
    from hdopt.recordings.read import Recording


def diagnose(
    recordings: Sequence[Recording | str | Path] | Recording | str | Path,
    drive: Drive | None = None,
    ratio: float | None = None,
    columns: str | None = None,
    seed: int = 1,
    nuisance: Sequence[str] = (),
    settings: DiagnosisSettings | None = None,
) -> Diagnosis:
    """Say whether the model of `drive` explains the recordings, and if not, what physics was left out.

    `recordings`: files, or `hdopt.recordings.read.Recording`s, of one drive, fitted jointly; `columns` says which
    column of a file is what (as `--columns`). `drive` None diagnoses a gear of `ratio` without a harmonic-drive model.
    `nuisance` ("drift", "time-warp") is fitted beside every model and never named: for recordings without a sensor at
    the input. The same `seed` gives the same answer. `settings` are the thresholds (None: as shipped).

    Raises `HdoptError` where there is no recording, the ratio is unknown or contradicts the drive's, or a recording
    cannot be used.
    """
    from hdopt.diagnosis.numerical import RATIO_DIGITS
    from hdopt.diagnosis.pipeline import gather_evidence
    from hdopt.diagnosis.settings import DEFAULT
    from hdopt.diagnosis.verdict.draw import draw_verdict
    from hdopt.kinematics.cartesian import CartesianModel
    from hdopt.parallel.workers import one_linear_algebra_thread
    from hdopt.recordings.read import Recording, read_recording

    if isinstance(recordings, Recording | str | Path):
        recordings = [recordings]
    if not recordings:
        raise HdoptError("no recordings were given; give at least one file")
    if drive is not None:
        if ratio is not None and abs(ratio - drive.geometry.ratio) > RATIO_DIGITS:
            raise HdoptError(
                f"the ratio given is {ratio:g}, the drive's is {drive.geometry.ratio:g}; leave --ratio out, or give "
                "--drive none with it"
            )
        ratio = drive.geometry.ratio
    if ratio is None:
        raise HdoptError("the ratio is not known; give --drive NAME, or --drive none with --ratio X")
    read = [r if isinstance(r, Recording) else read_recording(r, ratio, columns) for r in recordings]
    if any(abs(r.ratio - ratio) > RATIO_DIGITS for r in read):
        raise HdoptError("the recordings were read with different ratios; all must be of one drive")
    # Many small matrices: threads of the linear algebra would only wait for each other.
    base = None if drive is None else CartesianModel.of(drive)
    with one_linear_algebra_thread():
        evidence = gather_evidence(read, base, seed, nuisance, settings or DEFAULT)
        return draw_verdict(evidence, tuple(w for r in read for w in r.warnings))
