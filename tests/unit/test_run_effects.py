"""`hdopt run` of a study with effects."""

import json

import pytest
from effect_examples import toml

from hdopt.study import load_study
from hdopt.workflow.run import run_study, steps_of

EFFECTS = {
    "lost_motion": {"lost_motion_arcmin": 0.3, "crossing_arcmin": 0.3},
    "encoder_output_eccentricity": {"amplitude_arcmin": 0.1, "phase_deg": 20.0},
    "circular_spline_lobing": {"lobes": 6, "radial_amplitude_um": 8.0, "phase_deg": 10.0},
}


@pytest.fixture
def study_with(tmp_path):
    def load(effects, operation, steps=()):
        text = toml(effects, operation) + (f"[study]\nsteps = {json.dumps(steps)}\n" if steps else "")
        (tmp_path / "extended.toml").write_text(text)
        return load_study(tmp_path / "extended.toml")

    return load


def test_a_study_with_effects_asks_for_them_and_others_do_not(study_with):
    assert "effects" in steps_of(study_with(EFFECTS, {}))[1]
    assert "effects" not in steps_of(load_study())[1]


def test_a_run_shows_what_the_effects_add(study_with, tmp_path):
    study = study_with(EFFECTS, {"motion": "both", "include": "all"}, ["effects", "waveform", "orders", "lag"])
    result = run_study(study, tmp_path / "out")
    steps = json.loads((tmp_path / "out" / "results.json").read_text())["steps"]
    whole, base = (steps["effects"][key] for key in ("peak_to_peak_arcmin", "base_peak_to_peak_arcmin"))
    assert steps["waveform"]["peak_to_peak_arcmin"] == pytest.approx(whole)
    assert whole > base + 0.3
    assert [row["id"] for row in steps["effects"]["effects"]] == list(EFFECTS)
    # 8 um of radius at 12 deg are 1.7 um of arc: 0.092 arcmin where one zone drives throughout, up to twice as both do
    assert 0.09 < steps["orders"]["6"] < 0.2
    page = result.report.read_text()
    assert "What the base model leaves out" in page
    assert "the peak-to-peak is that of both directions together" in page
    assert (tmp_path / "out" / "effects-table.csv").is_file()


def test_effects_that_do_not_count_are_listed(study_with, tmp_path):
    study = study_with(EFFECTS, {"include": "none"}, ["effects"])
    page = run_study(study, tmp_path / "out").report.read_text()
    assert "No effect counts here" in page
    assert "Computed without lost_motion" in page
