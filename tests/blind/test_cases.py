"""Whole cases: size, repeatability, what goes out and what stays behind."""

import json

import numpy as np
import pandas as pd
import pytest

from hdopt.bench.cases import CATALOGUE, TROUBLES, Spec, generate
from hdopt.bench.generate import write
from hdopt.bench.geometry import RATIO
from hdopt.bench.hidden_outside import KINDS
from hdopt.bench.marking import IDS
from hdopt.bench.score import read
from hdopt.bench.suite import SEVERITIES, plan


def centred(tables):
    error = [60 * (t["input_angle_deg"] / RATIO - t["output_angle_deg"]) for t in tables]
    return np.concatenate([e - e.mean() for e in error])


@pytest.mark.parametrize("effect", CATALOGUE)
def test_hidden_rms_is_the_severity(effect):
    for severity in (0.1, 1.0):
        case, key = generate(Spec("single", 11, (effect,), severity))
        # Two per cent: the search stops at half of one, the zone switch may hold it there.
        assert key.part_rms_arcmin[effect] == pytest.approx(severity * key.base_rms_arcmin, rel=0.02)
        assert key.hidden_rms_arcmin == pytest.approx(key.part_rms_arcmin[effect])
        assert key.parameters[effect]
        assert all(np.isfinite(p["value"]) for p in key.parameters[effect].values())
        assert effect not in key.rivals
        for table in case.recordings:
            assert np.isfinite(table.to_numpy()).all()


def test_no_severity_is_the_base():
    with_effect, key = generate(Spec("single", 5, ("hysteresis",), 0.0))
    assert key.hidden_rms_arcmin == 0.0 and key.parameters == {} and not key.detectable
    assert centred(with_effect.recordings).std() == pytest.approx(
        np.hypot(key.base_rms_arcmin, key.noise_rms_arcmin), rel=0.05
    )


def test_the_same_seed_gives_the_same_numbers_and_another_others():
    spec = Spec("pair", 3, ("hysteresis", "lost_motion"), 0.5)
    (first, key), (second, again) = generate(spec), generate(spec)
    assert key == again
    for one, two in zip(first.recordings, second.recordings, strict=True):
        pd.testing.assert_frame_equal(one, two)
    other, _ = generate(Spec("pair", 4, ("hysteresis", "lost_motion"), 0.5))
    assert len(other.recordings[0]) != len(first.recordings[0])


def test_recordings_are_what_the_contract_says():
    for seed in range(6):
        case, key = generate(Spec("nothing", seed))
        for table in case.recordings:
            assert list(table.columns[:3]) == ["time_s", "input_angle_deg", "output_angle_deg"]
            assert set(table.columns[3:]) <= {"torque_Nm", "temperature_C"}
            assert (np.diff(table["time_s"]) > 0).all()
            slope = np.polyfit(table["input_angle_deg"], table["output_angle_deg"], 1)[0]
            assert slope == pytest.approx(1 / RATIO, rel=1e-3)  # the output counts in the input's direction
        assert centred(case.recordings).std() == pytest.approx(
            np.hypot(key.base_rms_arcmin, key.noise_rms_arcmin), rel=0.05
        )


@pytest.mark.parametrize("trouble", TROUBLES)
def test_decoys(trouble):
    case, key = generate(Spec("decoy", 2, trouble=trouble))
    table = case.recordings[0]
    if trouble == "gaps":
        step = np.diff(table["time_s"])
        assert step.max() > 20 * np.median(step) and table["output_angle_deg"].isna().any()
    if trouble == "short":
        assert np.ptp(table["input_angle_deg"]) < 21 * 360
    if trouble == "one way":
        case, key = generate(Spec("decoy", 2, ("lost_motion",), 0.5, trouble=trouble))
        moving = np.diff(case.recordings[0]["input_angle_deg"])
        assert len(case.recordings) == 1 and (moving.min() > -0.1 or moving.max() < 0.1)
        assert not key.detectable and key.hidden_rms_arcmin < 0.05 * key.base_rms_arcmin
    if trouble == "ripple":
        speed = np.gradient(table["input_angle_deg"], table["time_s"])
        inner = np.abs(speed[len(speed) // 20 : len(speed) // 5])
        assert inner.std() > 0.02 * inner.mean()
    assert key.hidden_rms_arcmin == 0 or trouble == "one way"


@pytest.mark.parametrize("kind", KINDS)
def test_unknowns_are_seen_and_are_no_rival_of_the_catalogue(kind):
    _, key = generate(Spec("unknown", 8, outside=kind, severity=0.5))
    assert key.detectable and not key.rivals and key.effects == () and key.outside == kind
    assert key.hidden_rms_arcmin == pytest.approx(0.5 * key.base_rms_arcmin, rel=0.02)


def test_evidence_finds_what_cannot_be_told_apart():
    _, lobing = generate(Spec("single", 1, ("circular_spline_lobing",), 0.5))
    assert "cs_tooth_harmonics" in lobing.rivals and not lobing.separable
    joint = [generate(Spec("single", seed, ("output_coupling",), 0.5))[1] for seed in range(2)]
    assert all("encoder_output_eccentricity" in k.rivals for k in joint if k.variants == ("output",))
    _, lines = generate(Spec("single", 4, ("encoder_interpolation",), 0.1))
    assert lines.parameters["encoder_interpolation"]["lines"]["value"] == 500 and lines.rivals == ("bearing_pass",)
    _, delay = generate(Spec("single", 1, ("channel_delay",), 1.0))
    assert delay.separable


def test_the_proof_has_every_case_that_it_must_have():
    specs = plan(0)
    single = {(s.effects[0], s.severity) for s in specs if s.family == "single"}
    assert {(effect, severity) for effect in CATALOGUE for severity in SEVERITIES} <= single
    assert sum(s.family == "nothing" for s in specs) >= 300
    unknown = [s.outside for s in specs if s.family == "unknown"]
    assert len(unknown) >= 40 and len(set(unknown)) >= 5
    assert {s.trouble for s in specs if s.family == "decoy"} == set(TROUBLES)
    assert len({s.seed for s in specs}) == len(specs)
    assert tuple(CATALOGUE) == tuple(IDS)
    assert plan(0) == specs and plan(1) != specs
    with pytest.raises(ValueError, match="unknown family 'pears'"):
        plan(0, families=("pears",))
    with pytest.raises(ValueError, match="unknown effect 'gremlins'"):
        generate(Spec("single", 0, ("gremlins",), 0.5))


def test_written_cases_hint_at_nothing(tmp_path):
    write(tmp_path, 7, ("nothing", "single", "pair", "decoy", "unknown", "scale"), share=0.01)
    answers, keys = read(tmp_path)
    assert answers == {} and len(keys) >= 5
    for key in keys:
        folder = tmp_path / "cases" / key["id"]
        told = json.loads((folder / "case.json").read_text())
        assert told == {"id": key["id"], "drive": "csf-25-80", "recordings": told["recordings"]}
        assert sorted(path.name for path in folder.iterdir()) == ["case.json", *told["recordings"]]
        assert len(told["recordings"]) == key["conditions"]["recordings"]
        assert pd.read_csv(folder / told["recordings"][0]).columns[0] == "time_s"
    with pytest.raises(FileExistsError, match="choose another --out"):
        write(tmp_path, 8)
