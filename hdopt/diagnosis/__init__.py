"""From "simulation and recording differ" to "this physics was left out": the public call."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hdopt.errors import HdoptError

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict import Diagnosis
    from hdopt.drive import Drive
    from hdopt.recording import Recording


def diagnose(
    recordings: Sequence[Recording | str | Path] | Recording | str | Path,
    drive: Drive | None = None,
    ratio: float | None = None,
    columns: str | None = None,
    seed: int = 1,
    nuisance: Sequence[str] = (),
) -> Diagnosis:
    """Say whether the model of `drive` explains the recordings, and if not, what physics was left out.

    `recordings`: files, or `hdopt.recording.Recording`s, of one drive, fitted jointly. `drive` None diagnoses a gear of
    `ratio` without a harmonic-drive model. `nuisance` ("drift", "time-warp") is fitted beside every model and never
    named: for recordings without a sensor at the input. The same seed gives the same answer.
    """
    from threadpoolctl import threadpool_limits

    from hdopt.diagnosis.pipeline import gather_evidence
    from hdopt.diagnosis.verdict import draw_verdict
    from hdopt.kinematics.cartesian import CartesianModel
    from hdopt.recording import Recording, read_recording

    if isinstance(recordings, Recording | str | Path):
        recordings = [recordings]
    if not recordings:
        raise HdoptError("no recordings were given; give at least one file")
    if drive is not None:
        if ratio is not None and abs(ratio - drive.geometry.ratio) > 1e-9:
            raise HdoptError(
                f"the ratio given is {ratio:g}, the drive's is {drive.geometry.ratio:g}; leave --ratio out, or give "
                "--drive none with it"
            )
        ratio = drive.geometry.ratio
    if ratio is None:
        raise HdoptError("the ratio is not known; give --drive NAME, or --drive none with --ratio X")
    read = [r if isinstance(r, Recording) else read_recording(r, ratio, columns) for r in recordings]
    if any(abs(r.ratio - ratio) > 1e-9 for r in read):
        raise HdoptError("the recordings were read with different ratios; all must be of one drive")
    # Many small matrices: threads of the linear algebra would only wait for each other.
    with threadpool_limits(1, user_api="blas"):
        evidence = gather_evidence(read, None if drive is None else CartesianModel.of(drive), seed, nuisance)
        return draw_verdict(evidence, tuple(w for r in read for w in r.warnings))
