"""Whole cases: size, repeatability, what goes out and what stays behind."""

import json
from itertools import combinations

import numpy as np
import pandas as pd
import pytest

from hdopt.bench import cases
from hdopt.bench.cases import CATALOGUE, TROUBLES, Spec, generate, simulate
from hdopt.bench.evidence import OneOf, Witness
from hdopt.bench.gears import BUILT, GEARS, study_text
from hdopt.bench.generate import write
from hdopt.bench.geometry import RATIO
from hdopt.bench.hidden_drive import Lobing, LongWave
from hdopt.bench.hidden_outside import ALL_KINDS
from hdopt.bench.marking import IDS
from hdopt.bench.outside_forms import FORMS
from hdopt.bench.registry import sha
from hdopt.bench.score import read
from hdopt.bench.signal_chain import hidden_wave
from hdopt.bench.suite import FAMILIES, SEVERITIES, plan


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


def test_nothing_is_drawn_anew_because_a_rival_could_explain_it():
    """Catches screening: before, such draws were repeated until the records could decide."""
    for spec in (Spec("unknown", 8, outside="power of time", severity=0.25), Spec("single", 1, ("hysteresis",), 0.1)):
        _, key = generate(spec)
        assert key.redrawn == 0
    _, faint = generate(Spec("single", 5, ("tooth_mesh",), 0.002))
    assert faint.margin < 1 and not faint.detectable and faint.redrawn == 0


def test_what_cannot_be_so_large_is_taken_as_it_is(monkeypatch):
    """An encoder's error has a largest size; before, such a case ended the run."""
    monkeypatch.setattr(cases, "ATTEMPTS", 1)
    _, key = generate(Spec("single", 4, ("encoder_interpolation",), 30.0, size="brief"))
    assert 0 < key.hidden_rms_arcmin < 30 * key.base_rms_arcmin


def test_outsiders_are_drawn_anew_from_many_forms():
    """Catches a fixed list of outsiders: forms and parameters differ from seed to seed."""
    forms = [{s.outside for s in plan(seed, ("unknown",), cases=150)} for seed in (1, 2)]
    assert forms[0] != forms[1] and len(ALL_KINDS) >= 40
    assert {s.outside for s in plan(1, ("unknown",))} == set(ALL_KINDS)
    families = {form.family for form in FORMS.values()}
    assert families >= {"power", "product", "modulation", "pulse", "gain", "creep", "drag", "band"}


@pytest.mark.parametrize("reading", ["pitch errors", "cam harmonics", "varying k_e", "hum"])
def test_what_a_drive_has_besides_stands_in_its_key(reading):
    more = {"hum": 3.0} if reading == "hum" else {"built": reading}
    case, key = generate(Spec("built", 6, size="brief", **more))
    _, plain = generate(Spec("built", 6, size="brief"))
    assert key.effects == () and key.beside_rms_arcmin > 0 == plain.beside_rms_arcmin
    assert key.beside_true == (("cs_tooth_harmonics", "fs_tooth_harmonics") if reading == "pitch errors" else ())
    if reading == "hum":  # in units of the noise of neighbouring samples
        assert key.beside_rms_arcmin == pytest.approx(3 * plain.noise_rms_arcmin, rel=0.35)
        assert key.beside_detectable
    assert centred(case.recordings).std() == pytest.approx(
        np.hypot(plain.base_rms_arcmin, np.hypot(key.beside_rms_arcmin, key.noise_rms_arcmin)), rel=0.2
    )


@pytest.mark.parametrize("gear", GEARS)
def test_every_drive_of_the_bench_runs_at_its_ratio(gear):
    case, key = generate(Spec("single", 3, ("encoder_output_eccentricity",), 1.0, gear=gear))
    assert key.gear == gear
    for table in case.recordings:
        slope = np.polyfit(table["input_angle_deg"], table["output_angle_deg"], 1)[0]
        assert 1 / slope == pytest.approx(GEARS[gear].ratio, rel=1e-3)
        assert np.ptp(table["input_angle_deg"]) / 360 > 0.5 * GEARS[gear].ratio


def test_speed_steps_and_turns_are_in_the_motion():
    found = simulate(Spec("speed steps", 4, speed_steps=True, size="brief"))
    speed = np.abs(found.setups[0].run.speed)
    levels = {round(level, 1) for level in np.unique(np.round(speed / speed.max(), 1))}
    assert {0.3, 0.5, 1.0} <= levels
    for turns in (4.0, 300.0):
        run = simulate(Spec("turns", 2, turns=turns)).setups[0].run
        travelled = np.abs(np.diff(run.theta)).sum() / (2 * np.pi)
        assert 0.7 * turns < travelled < 3.5 * turns + 40  # there and back, short strokes before


def test_a_lone_wave_of_the_teeth_is_a_lobe_whatever_the_noise():
    """Catches what run-001 showed: linear columns called the two apart, as more of them follow the change of zones."""
    rng = np.random.default_rng(0)
    drawn = [LongWave.draw(rng, on="cs") for _ in range(40)]
    lone = [wave for wave in drawn if wave.variant == "harmonics" and len(wave.truth()) == 2]
    assert lone and all(wave.same_as == ("circular_spline_lobing",) for wave in lone)
    assert not any(wave.same_as for wave in drawn if wave.variant != "harmonics")
    setup = simulate(Spec("nothing", 2, size="brief")).setups[0]
    (teeth, order) = next((wave, int(max(wave.truth()).split("_")[1])) for wave in lone)
    wave = hidden_wave(setup, [teeth])
    phases = 2 * np.pi * np.arange(48) / 48
    lobes = [
        hidden_wave(
            setup,
            [Lobing(order, phase).scaled(teeth.truth()[f"order_{order}_amplitude"].value / np.tan(np.deg2rad(12)))],
        )
        for phase in phases
    ]
    assert min(np.std(wave - lobe) for lobe in lobes) < 0.1 * np.std(wave)  # 48 phases: half a step is 0.065


def test_evidence_finds_what_cannot_be_told_apart():
    _, lobing = generate(Spec("single", 1, ("circular_spline_lobing",), 0.5))
    assert "cs_tooth_harmonics" in lobing.rivals and not lobing.separable
    joint = [generate(Spec("single", seed, ("output_coupling",), 0.5))[1] for seed in range(2)]
    assert all("encoder_output_eccentricity" in k.rivals for k in joint if k.variants == ("output",))
    _, lines = generate(Spec("single", 4, ("encoder_interpolation",), 0.1))
    assert lines.parameters["encoder_interpolation"]["lines"]["value"] == 500 and lines.rivals == ("bearing_pass",)
    _, delay = generate(Spec("single", 1, ("channel_delay",), 1.0))
    assert delay.separable


def test_no_entry_has_one_rival_twice():
    """Would catch a parameter that lands in another's place: rivals of five frequencies were one."""
    drawn = simulate(Spec("single", 233, ("resonance",), 0.5, size="brief"))
    rivals = Witness(drawn.setups, drawn.plans, np.random.default_rng(0)).rivals()
    assert "resonance" in rivals
    for name, columns in rivals.items():
        shapes = [np.ravel(c) / np.std(c) for c in columns if not isinstance(c, OneOf)]
        for first, second in combinations(shapes, 2):
            assert first.shape != second.shape or np.std(first - second) > 1e-3, name


def test_the_proof_has_every_case_that_it_must_have():
    specs = plan(0)
    assert len(specs) == 1000
    assert sum(not s.effects and not s.outside for s in specs) >= 300
    assert sum(len(s.effects) == 2 for s in specs) >= 100 and sum(len(s.effects) == 3 for s in specs) >= 60
    assert {s.built for s in specs} == {"", *BUILT} and {s.gear for s in specs} == set(GEARS)
    assert all(abs(sum(s.gear == g for s in specs) - 250) < 10 for g in GEARS)
    ratios = [GEARS[g].ratio for g in GEARS]
    assert (min(ratios), max(ratios)) == (30, 160)
    assert min(s.turns for s in specs if s.turns) < 10 and max(s.turns for s in specs) > 200
    for part in (40, 200):
        assert len(plan(0, cases=part)) == pytest.approx(part, abs=6)
        assert {s.family for s in plan(0, cases=part)} == set(FAMILIES)
    single = {(s.effects[0], s.severity) for s in specs if s.family == "single"}
    assert {(effect, severity) for effect in CATALOGUE for severity in SEVERITIES} <= single
    unknown = [s.outside for s in specs if s.family == "unknown"]
    assert len(unknown) >= 150 and len(set(unknown)) >= 30
    assert {s.trouble for s in specs if s.family == "decoy"} == set(TROUBLES)
    assert len({s.seed for s in specs}) == len(specs)
    assert tuple(CATALOGUE) == tuple(IDS)
    assert plan(0) == specs and plan(1) != specs
    with pytest.raises(ValueError, match="unknown family 'pears'"):
        plan(0, families=("pears",))
    with pytest.raises(ValueError, match="unknown effect 'gremlins'"):
        generate(Spec("single", 0, ("gremlins",), 0.5))
    with pytest.raises(ValueError, match="unknown gear 'hd-9'; the bench knows csf-25-80"):
        generate(Spec("single", 0, gear="hd-9"))
    with pytest.raises(ValueError, match="no such physics: 'magic'"):
        generate(Spec("unknown", 0, outside="magic", severity=0.5))


def test_written_cases_hint_at_nothing(tmp_path):
    checksum = write(tmp_path, 7, ("nothing", "single", "decoy", "orientation", "scale"), cases=8)
    answers, keys = read(tmp_path)
    assert answers == {} and len(keys) >= 5
    assert sha((tmp_path / "sealed" / "keys.jsonl").read_text()) == checksum
    for key in keys:
        folder = tmp_path / "cases" / key["id"]
        told = json.loads((folder / "case.json").read_text())
        drive = key["gear"] if key["gear"] == "csf-25-80" else "drive.toml"
        assert told == {"id": key["id"], "drive": drive, "recordings": told["recordings"]}
        expected = {"case.json", *told["recordings"]} | ({drive} if drive.endswith("toml") else set())
        assert {path.name for path in folder.iterdir()} == expected
        if drive.endswith("toml"):
            assert (folder / drive).read_text() == study_text(GEARS[key["gear"]])  # nominal: no errors, nothing built
        assert len(told["recordings"]) == key["conditions"]["recordings"]
        assert pd.read_csv(folder / told["recordings"][0]).columns[0] == "time_s"
    with pytest.raises(FileExistsError, match="choose another --out"):
        write(tmp_path, 8)
