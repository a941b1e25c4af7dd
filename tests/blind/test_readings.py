"""How a bench counts and samples: every reading does what its name says, and hides nothing of its own."""

import numpy as np
import pytest

from hdopt.bench.cases import Spec, generate, simulate
from hdopt.bench.geometry import ARCMIN, RATIO
from hdopt.bench.hidden_load import Resonance
from hdopt.bench.motion import Run
from hdopt.bench.readings import INPUT, OUTPUT, READINGS, SCALES
from hdopt.bench.suite import FAMILIES, plan


def read(reading, **more):
    return simulate(Spec("orientation", 3, size="brief", reading=reading, **more))


def error(table, ratio=RATIO):
    wave = 60 * (table[INPUT] / ratio - table[OUTPUT]).to_numpy()
    return wave - wave.mean()


@pytest.fixture(scope="module")
def plain():
    return read("").tables[0]


def test_both_angles_mirrored_turn_the_error_round_and_the_drive_the_other_way(plain):
    table = read("both angles mirrored").tables[0]
    assert np.array_equal(table[INPUT], -plain[INPUT])
    assert error(table) == pytest.approx(-error(plain), abs=1e-9)


@pytest.mark.parametrize(("reading", "column"), [("output mirrored", OUTPUT), ("input mirrored", INPUT)])
def test_one_angle_mirrored_turns_the_ratio_round(plain, reading, column):
    table = read(reading).tables[0]
    assert np.array_equal(table[column], -plain[column])
    assert error(table, -RATIO).std() == pytest.approx(error(plain).std())


@pytest.mark.parametrize("reading", SCALES)
def test_a_scale_is_off_by_what_its_name_says(plain, reading):
    table = read(reading).tables[0]
    slope = np.polyfit(table[INPUT], table[OUTPUT], 1)[0] * RATIO
    kind, size = reading.split()[0], float(reading.removesuffix(" %").split()[-1])
    off = size - 1 if kind == "gain" else size / 100
    # The drive's own error over 82 turns tilts the line by parts in 1e5.
    assert abs(slope - 1) == pytest.approx(off, rel=0.02, abs=2e-5)


def test_rows_are_missing_and_steps_are_coarse(plain):
    fewer = read("rows missing").tables[0]
    assert len(fewer) == pytest.approx(0.8 * len(plain), rel=0.05)
    for bits in (12, 14):
        angles = read(f"{bits}-bit output").tables[0][OUTPUT]
        steps = np.diff(np.unique(angles))
        assert steps.min() == pytest.approx(360 / 2**bits, rel=1e-3)


def test_a_long_clean_record_is_long_and_clean():
    found = simulate(Spec("long", 4, size="long", reading="long and clean"))
    assert sum(len(table) for table in found.tables) > 95_000
    assert found.noise_rms / ARCMIN == pytest.approx(0.005, rel=0.2)


@pytest.mark.parametrize("whole_motion", [True, False])
def test_a_swing_with_all_motion_lags_while_the_speed_changes(whole_motion):
    """At a constant acceleration a the spring is wound by a/w^2; a swing with the error alone knows nothing of it."""
    time, acceleration = np.arange(40_000) * 1e-4, 300.0
    run = Run(time, 0.5 * acceleration * time**2, acceleration * time, np.zeros_like(time), np.zeros_like(time))
    swing = Resonance(0.1, False, top_hz=8.0, whole_motion=whole_motion, scale=0.25)
    lag = swing.lag(run, np.zeros_like(time))
    wound = acceleration / RATIO / (2 * np.pi * 16.0) ** 2
    assert lag[-1] == pytest.approx(wound if whole_motion else 0.0, rel=1e-3, abs=1e-12)


def test_families_are_in_the_plan_and_unknown_readings_are_refused():
    specs = plan(0, families=("orientation", "scale", "long", "coarse", "swing"))
    assert {s.family for s in specs} == {"orientation", "scale", "long", "coarse", "swing"} <= set(FAMILIES)
    assert {s.reading for s in specs} == set(READINGS)
    assert any(s.effects for s in specs if s.family == "orientation")
    with pytest.raises(ValueError, match="unknown reading 'sideways'; the bench knows both angles mirrored"):
        generate(Spec("nothing", 0, reading="sideways"))
