"""One table for recordings at several speeds: what grows with the speed, what each speed has of its own, its files."""

import csv
import ctypes
import json
import re
import shutil
import subprocess
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hdopt.cli import main
from hdopt.compensation.of_speed import OfSpeed, lag_of, shows_lag
from hdopt.compensation.pulse import Pulse
from hdopt.compensation.surface import Crossing, Harmonics, surface_of
from hdopt.compensation.writers import written
from hdopt.compensation.zones import Zones
from hdopt.recordings.read import recording_from_table
from hdopt.workflow.compensate import compensate
from hdopt.workflow.compensation_speeds import WORTH, _pays

RATIO, TURN, NOISE, PER_TURN = 80.0, 2 * np.pi, 0.01, 40


def frame(error, rpm, seed, turns=50, back=True):
    """`turns` of the input there and, with `back`, back at `rpm`; `error(theta, signed rpm)` and noise."""
    one = np.arange(turns * PER_TURN) * TURN / PER_TURN
    theta = np.r_[one, one[::-1]] if back else one
    signed = rpm * np.r_[np.ones(len(one)), -np.ones(len(theta) - len(one))]
    noisy = error(theta, signed) + np.random.default_rng(seed).normal(0, NOISE, len(theta))
    return pd.DataFrame(
        {
            "time_s": np.arange(len(theta)) / PER_TURN * 60 / rpm,
            "input_angle_deg": np.degrees(theta),
            "output_angle_deg": np.degrees(theta) / RATIO - noisy / 60,
        }
    )


def recorded(*arguments, **options):
    return recording_from_table(frame(*arguments, **options), RATIO)


def left_of(made, error, rpm, **options):
    """What `made` leaves of a fresh run at `rpm`, rms; its rows at the turning points are of no speed."""
    fresh = recorded(error, rpm, 9, **options)
    way = np.sign(np.gradient(fresh.input_angle))
    said = made.found.at(fresh.input_angle, fresh.input_angle / RATIO, way, rpm * way)
    inside = np.abs(np.gradient(fresh.input_angle)) > 0.9 * TURN / PER_TURN
    return float(np.std((fresh.error_arcmin - said)[inside]))


def delayed(theta, rpm):
    """Friction's half of a return error, and a delay that adds 0.1 arcmin at 100 r/min."""
    return 0.3 * np.sin(2 * theta) + 0.05 * np.sign(rpm) + 0.001 * rpm


def test_a_delay_is_held_at_every_speed():
    """Recorded at 50 and 150 r/min, tried at 250: would catch a return error halfway between both speeds, a lag that
    forgets its sign backward, and one in another unit."""
    made = compensate([recorded(delayed, rpm, seed) for seed, rpm in enumerate((150, 50))])
    assert made.found.lag == pytest.approx(0.001, rel=0.02)
    assert made.found.back == pytest.approx(0.05, abs=0.002)
    assert not made.found.own
    for rpm in (50, 100, 250):
        assert left_of(made, delayed, rpm) < 1.1 * NOISE


@pytest.mark.parametrize("many", [(100, 100), (100, 104)])
def test_one_speed_has_no_lag(many):
    """All of the return error would be called one, or none, by chance."""
    made = compensate([recorded(delayed, rpm, seed) for seed, rpm in enumerate(many)])
    assert not isinstance(made.found, OfSpeed)


def test_noise_has_no_lag():
    rng = np.random.default_rng(1)
    rpm = np.repeat([100.0, 50, -50, -100], 500)
    columns = np.column_stack([np.ones(2000), np.sign(rpm)])
    assert {lag_of(rng.normal(size=2000), columns, rpm, 1.0) for _ in range(50)} == {0.0}
    assert lag_of(rng.normal(size=2000) + 0.01 * rpm, columns, rpm, 1.0) == pytest.approx(0.01, rel=0.2)


def test_starts_and_stops_are_no_second_speed():
    ramp = np.linspace(1, 100, 30)
    steady = np.r_[ramp, np.full(500, 100.0), -ramp, np.full(500, -100.0)]
    assert not shows_lag(steady)
    assert shows_lag(np.r_[steady, steady / 2])
    assert not shows_lag(np.abs(np.r_[steady, steady / 2]))


def swinging(theta, rpm):
    """A load on a spring: its order is larger and further behind in time the faster it turns."""
    return (0.2 + 0.001 * np.abs(rpm)) * np.sin(2 * theta - 0.004 * rpm) + 0.1 * np.sin(3 * theta)


def test_a_load_that_swings_is_held_at_each_recorded_speed():
    """Behind in time is behind in angle one way and ahead the other: would catch a part of each speed that forgets the
    direction, one speed's part at another, and one table for all."""
    made = compensate([recorded(swinging, rpm, seed, turns=82) for seed, rpm in enumerate((200, 100))])
    assert made.found.speeds == pytest.approx((-200, -100, 100, 200), rel=0.01)
    assert made.worth and "each speed" in made.method
    assert made.predicted < 10 * NOISE
    for rpm in (100, 200):
        assert left_of(made, swinging, rpm) < 1.15 * NOISE
    assert [*made.speeds] == pytest.approx([100, 200], rel=0.01)
    assert all(one.expected < 10 * NOISE for one in made.speeds.values())


@pytest.mark.parametrize("grows", [0.0, 0.3])
def test_an_error_that_grows_with_speed_is_written_for_each(grows):
    """Would catch one table for two speeds, halfway between them; and a table of each where one is as good."""

    def error(theta, rpm):
        return (0.2 + grows * (rpm / 100 - 1)) * np.sin(2 * theta)

    runs = [recorded(error, rpm, seed, turns=90, back=False) for seed, rpm in enumerate((100, 200, 102, 200))]
    made = compensate(runs)
    assert isinstance(made.found, OfSpeed) == bool(grows)
    if grows:
        assert made.found.speeds == pytest.approx((100, 200), rel=0.02)
        assert max(left_of(made, error, rpm, turns=90, back=False) for rpm in (100, 200)) < 1.1 * NOISE


@pytest.mark.parametrize(("taken", "pays"), [(0.04, False), (0.06, True)])
def test_terms_of_a_speed_take_a_twentieth_of_what_is_left_or_none_are_written(taken, pays):
    """A fall of 4 % that is the same in every stretch is sure, and not worth a table of each speed."""
    rows = SimpleNamespace(block=np.arange(400) // 4)
    before = np.tile([1.0, -1.0], 200)
    assert _pays(rows, before, (1 - taken) * before) is pays


def test_a_fall_in_one_stretch_of_ten_is_chance():
    """A tenth of the squares of all, from one stretch alone: would catch a fall that is weighed without its scatter."""
    rows = SimpleNamespace(block=np.arange(400) // 4)
    before = np.tile([1.0, -1.0], 200)
    after = np.where(np.arange(400) < 40, 0.0, before)
    assert np.std(after) < (1 - WORTH) * np.std(before)
    assert not _pays(rows, before, after)


RNG = np.random.default_rng(4)


def terms(count, back=0.0, crossing=Crossing()):
    return Harmonics(
        RNG.integers(0, 9, count), RNG.integers(-8, 9, count), *RNG.normal(0, 0.1, (2, count)), back, crossing
    )


SUM = terms(9, -0.07, Crossing(20.0))
OWN = terms(3), terms(0), terms(2)
KINDS = {
    "terms": OfSpeed(SUM, 0.002, (-50.0, 40.0, 90.0), OWN),
    "zones": OfSpeed(Zones(terms(4), terms(4), terms(2, 0.03), -1.0), -0.001, (-50.0, 40.0, 90.0), OWN),
    "a damaged tooth": OfSpeed(
        Zones(
            terms(4),
            terms(4),
            terms(2, 0.03),
            -1.0,
            (Pulse(0, 0, 1.0, 0.01, -0.02, 0.5, -0.4), Pulse(1, 1, -2.0, 0.0, 0.1, 0.9, 0.6)),
        ),
        -0.001,
        (-50.0, 40.0, 90.0),
        OWN,
    ),
    "table": OfSpeed(surface_of([SUM], back=0.05), 0.002, (-50.0, 40.0, 90.0), OWN),
    "lag alone": OfSpeed(SUM, 0.002),
    "one speed": OfSpeed(SUM, 0.0, (60.0,), OWN[:1]),
}


def asked():
    rng = np.random.default_rng(5)
    rpm = np.r_[rng.uniform(-120, 120, 60), -50, 40, 90]
    return rng.uniform(-20, 500, 63), rng.uniform(-20, 20, 63), rng.uniform(-1, 1, 63), rpm


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("kind", KINDS)
def test_c_code_of_the_speed_computes_the_same(tmp_path, kind):
    (tmp_path / "c.c").write_text(written(KINDS[kind], "c", {}))
    build = [
        "cc",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Wno-type-limits",
        "-shared",
        "-fPIC",
        "-o",
        "c.so",
        "c.c",
        "-lm",
    ]
    subprocess.run(build, cwd=tmp_path, check=True)
    error = ctypes.CDLL(str(tmp_path / "c.so")).hdopt_error_arcmin
    error.restype, error.argtypes = ctypes.c_double, [ctypes.c_double] * 4
    given = asked()
    theirs = [error(*one) for one in zip(*given, strict=True)]
    np.testing.assert_allclose(theirs, KINDS[kind].at(*given), atol=1e-6)


def share(rpm, speed, speeds):
    """How much of what `speed` has of its own counts at `rpm`, by the sentence in the file."""
    place = sorted(speeds).index(speed)
    if rpm <= speed:
        before = sorted(speeds)[place - 1] if place else None
        return 1.0 if before is None else max(0.0, (rpm - before) / (speed - before))
    after = sorted(speeds)[place + 1] if place + 1 < len(speeds) else None
    return 1.0 if after is None else max(0.0, (after - rpm) / (after - speed))


def wave(term, a, b):
    phase = float(term["k"]) * a + float(term["j"]) * b
    return float(term["cos_arcmin"]) * np.cos(phase) + float(term["sin_arcmin"]) * np.sin(phase)


@pytest.mark.parametrize("form", ["csv", "json"])
@pytest.mark.parametrize("kind", ["terms", "zones", "a damaged tooth"])
def test_csv_and_json_read_back_compute_the_same(kind, form):
    """Read as the head says, by other code than the writer's."""
    text = written(KINDS[kind], form, {})
    if form == "json":
        said = json.loads(text)
        back, lag, common = said["half_return_arcmin"], said["lag_arcmin_per_input_rpm"], said["terms"]
        own = [(one["speed_input_rpm"], term) for one in said["speeds"] for term in one["terms"]]
        speeds = [one["speed_input_rpm"] for one in said["speeds"]]
        pulses = [list(one.values()) for one in said.get("pulses", [])]
    else:
        facts = dict(line[2:].split(": ", 1) for line in text.splitlines() if line.startswith("# "))
        back, lag = float(facts["half_return_arcmin"]), float(facts["lag_arcmin_per_input_rpm"])
        speeds = [float(one) for one in facts["speeds_input_rpm"].split()]
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        read = list(csv.DictReader([lines[0].replace("k_input", "k").replace("j_output", "j"), *lines[1:]]))
        common = [one for one in read if not one["speed_input_rpm"]]
        own = [(float(one["speed_input_rpm"]), one) for one in read if one["speed_input_rpm"]]
        pulses = [[*map(float, line[9:].split(","))] for line in text.splitlines() if line.startswith("# pulse: ")]
    ours = KINDS[kind].at(*asked())
    for a, b, path, rpm, mine in zip(*asked(), ours, strict=True):
        sums = [0.0, 0.0, 0.0]
        for term in common:
            sums[int(term.get("sum") or 0)] += wave(term, a, b)
        for pulse in pulses:
            off = a + pulse[1] * b - pulse[2] - pulse[3] * np.cos(b) - pulse[4] * np.sin(b)
            off = abs((off + np.pi) % TURN - np.pi)
            sums[int(pulse[0])] += pulse[6] * max(0.0, 1 - off / pulse[5])
        value = sums[0] + min(sums[1], sums[2]) + path * back + lag * rpm
        value += sum(share(rpm, speed, speeds) * wave(term, a, b) for speed, term in own)
        assert value == pytest.approx(mine, abs=1e-9)


def test_a_table_with_terms_of_each_speed_says_them_in_its_head():
    text = written(KINDS["table"], "csv", {})
    of_speed = [line for line in text.splitlines() if line.startswith("# of_speed: ")]
    assert [float(line.split(": ")[1].split(",")[0]) for line in of_speed] == [-50.0] * 3 + [90.0] * 2
    assert "falls in a straight line" in text


def test_the_command_says_what_depends_on_the_speed(tmp_path, capsys):
    for n, rpm in enumerate((150, 50)):
        frame(delayed, rpm, n).to_csv(tmp_path / f"{rpm}.csv", index=False)
    files = [str(tmp_path / f"{rpm}.csv") for rpm in (150, 50)]
    told = tmp_path / "t.json"
    with pytest.raises(SystemExit) as end:
        main(
            ["compensate", *files, "--drive", "none", "--ratio", "80", "-o", str(tmp_path / "t.c"), "--json", str(told)]
        )
    assert end.value.code == 0
    said = capsys.readouterr().out
    grows = re.search(r"grows with the speed by ([\d.]+) arcmin for each r/min of the input", said)
    assert float(grows[1]) == pytest.approx(0.001, rel=0.02)
    assert "at 50 r/min: expect" in said and "at 150 r/min: expect" in said
    content = json.loads(told.read_text())
    assert content["of_speed"] == {"lag_arcmin_per_rpm": pytest.approx(0.001, rel=0.02), "speeds": []}
    head = (tmp_path / "t.c").read_text()
    assert "peak_to_peak_expected_at_50_rpm: " in head and "double input_rpm" in head
