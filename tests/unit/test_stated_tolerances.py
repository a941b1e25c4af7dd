"""What a study's [tolerances] allow, as a diagnosis asks it of a fitted drive."""

import pytest

from hdopt.diagnosis.settings import DEFAULT
from hdopt.study import load_study
from hdopt.workflow import diagnose as workflow
from hdopt.workflow.stated_tolerances import stated_tolerances, with_tolerances_of

SHIPPED = {
    "axis_eccentricity_mm": 0.015,
    "axis_tilt_x_deg": 0.2,
    "axis_tilt_y_deg": 0.2,
    "wg_eccentricity_mm": 0.0075,
    "wg_tilt_major_deg": 0.1,
    "wg_tilt_minor_deg": 0.1,
    "cs_tooth_amplitude_mm": 0.003,
    "fs_tooth_amplitude_mm": 0.003,
}
"""Bounds of the rows of [tolerances] in csf-25-80.toml."""


def test_bounds_of_the_shipped_study_are_those_of_its_file():
    """Faults caught: a lower bound taken, directions and phases taken for sizes."""
    assert stated_tolerances(load_study("csf-25-80")) == SHIPPED


@pytest.mark.parametrize(
    ("row", "largest"),
    [
        ({"distribution": "normal", "mean": 0.0, "std": 0.05}, 3 * 0.05),
        ({"distribution": "normal", "mean": -0.02, "std": 0.05}, 0.02 + 3 * 0.05),
        ({"distribution": "uniform", "lower": -0.3, "upper": 0.1}, 0.3),
        ({"distribution": "normal", "mean": 0.0, "std": 0.05, "lower": -0.04, "upper": 0.08}, 0.08),
    ],
)
def test_a_row_without_bounds_allows_what_six_deviations_keep(row, largest):
    """0.00135 and 0.99865 are three standard deviations to four digits."""
    study = load_study("csf-25-80").with_({"tolerances.axis_tilt_x_deg": row})
    assert stated_tolerances(study)["axis_tilt_x_deg"] == pytest.approx(largest, rel=1e-4)


def test_a_fixed_error_of_zero_and_errors_that_callouts_feed_are_left_out():
    study = load_study("csf-25-80").with_(
        {
            "tolerances.axis_tilt_x_deg": {"distribution": "fixed", "value": 0.0},
            "contributors": {"bore": {"callout": "coaxiality", "value_mm": 0.01, "feeds": "wg_eccentricity"}},
        }
    )
    assert SHIPPED.keys() - stated_tolerances(study).keys() == {"axis_tilt_x_deg", "wg_eccentricity_mm"}


def test_settings_stay_as_they_are_where_a_study_is_silent():
    assert with_tolerances_of(None, None) is DEFAULT
    study = load_study("csf-25-80")
    silent = study.with_({"tolerances": {}})
    assert with_tolerances_of(silent, None) is DEFAULT
    assert dict(with_tolerances_of(study, None).base.stated_tolerances) == SHIPPED


def test_a_diagnosis_gets_the_tolerances_of_its_study(monkeypatch):
    """Fault caught: a study whose tolerances never reach the fit."""
    given = []

    def diagnosed(read, drive, ratio, columns, seed, nuisance, settings):
        given.append(settings)

    monkeypatch.setattr(workflow, "diagnose_records", diagnosed)
    monkeypatch.setattr(workflow, "write_diagnosis", lambda *about: None)
    workflow.diagnose([], "csf-25-80")
    assert dict(given[0].base.stated_tolerances) == SHIPPED
