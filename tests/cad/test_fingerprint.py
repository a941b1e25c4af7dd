"""The fingerprint, which is the drawings' revision: it changes with all that they say and with nothing else."""

from __future__ import annotations

from dataclasses import replace

import pytest
from wave_generators import CLEARANCES, drive

from hdopt.drive.geometry import Structure
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions

BOUNDS = {
    "wg_eccentricity_mm": 0.0075,
    "wg_tilt_major_deg": 0.1,
    "wg_tilt_minor_deg": 0.1,
    "axis_eccentricity_mm": 0.015,
    "axis_tilt_y_deg": 0.2,
}
CONTRIBUTOR = {"runout": {"callout": "total_runout", "value_mm": 0.01, "feeds": "axis_eccentricity"}}


def fingerprint(made=None, options=None, bounds=BOUNDS, contributors=None) -> str:
    return make_job(made or drive(), options or ExportOptions(), "a study", bounds, contributors).identity.fingerprint


@pytest.mark.parametrize("key", BOUNDS)
def test_every_tolerance_that_a_sheet_shows_changes_it(key):
    assert fingerprint(bounds=BOUNDS | {key: 0.97 * BOUNDS[key]}) != fingerprint()


def test_sizes_options_clearances_and_contributors_change_it():
    others = [
        fingerprint(drive(width=9.5)),
        fingerprint(options=ExportOptions(chamfer_mm=0.2)),
        fingerprint(replace(drive(), clearances=replace(CLEARANCES, cross_slide=0.03))),
        fingerprint(contributors=CONTRIBUTOR),
        fingerprint(drive(structure=Structure.AUTOMATIC)),
    ]
    assert len({fingerprint(), *others}) == 1 + len(others)


def test_nothing_else_changes_it():
    """The teeth's tolerances stand on no sheet of the wave generator."""
    assert fingerprint(bounds=BOUNDS | {"cs_tooth_amplitude_mm": 0.002}) == fingerprint()
