"""What a compensation is judged by: held-out rows, their sign and seed, peaks as well as squares, the form's part."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hdopt.compensation.surface import Crossing, Harmonics, nothing
from hdopt.compensation.teeth import Teeth
from hdopt.compensation.writers import written
from hdopt.compensation.zones import formed
from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from hdopt.workflow import compensate as module
from hdopt.workflow import compensation_trials as trials_module
from hdopt.workflow.compensate import compensation_of
from hdopt.workflow.compensation_samples import Samples

RATIO, TURN, NOISE, PER_TURN = 80.0, 2 * np.pi, 0.01, 20
SWINGS = Harmonics(np.array([2]), np.array([0]), np.array([0.3]), np.zeros(1), -0.07, Crossing(20.0, 0.0, True))


def recorded(seed, turns=81, size=0.3):
    theta = np.arange(round(turns * PER_TURN)) * TURN / PER_TURN
    error = size * np.sin(2 * theta) + np.random.default_rng(seed).normal(0, NOISE, len(theta))
    frame = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / RATIO - error / 60}
    return recording_from_table(pd.DataFrame(frame), RATIO)


def facts_of(text):
    """Names and values of a CSV file's comment lines, as a reader takes them apart."""
    return dict(line[2:].split(": ", 1) for line in text.splitlines() if line.startswith("# "))


def test_csv_says_how_the_return_error_crosses():
    """A controller that has the CSV alone needs the travel, the shape and where the path stood at the start."""
    said = facts_of(written(SWINGS, "csv", {}))
    assert float(said["half_return_arcmin"]) == -0.07
    assert float(said["return_crossing_output_deg"]) == 20.0
    assert said["return_crosses"] == "in a straight line"
    assert float(said["return_path_at_start"]) == 0.0


def test_every_file_and_the_answer_say_half_the_return_error(tmp_path):
    """One that said it whole would be added twice over."""
    content = json.loads(written(SWINGS, "json", {}))
    assert content["half_return_arcmin"] == -0.07
    assert content["return_crossing_output_deg"] == 20.0
    assert (content["return_crosses"], content["return_path_at_start"]) == ("in a straight line", 0.0)
    answer = replace(compensation_of([recorded(1)], None, 64, 1), found=SWINGS).to_dict(None)["return"]
    assert answer == {
        "half_arcmin": -0.07, "crossing_output_deg": 20.0, "crosses": "in a straight line", "path_at_start": 0.0
    }  # fmt: skip


@pytest.mark.parametrize(("peak", "worth"), [(1.1, False), (0.9, True)])
def test_squares_that_fall_while_the_peaks_rise_are_not_worth_a_file(monkeypatch, peak, worth):
    """Every row at half its error, but one a tenth above the largest there was: a servo feels that one."""

    def one_peak(split, *_):
        rows, _fold = split
        left = 0.5 * (rows.error - rows.error.mean())
        highest = int(np.argmax(rows.error))
        left[highest] = peak * float(np.ptp(rows.error)) + left.min()
        return {"harmonics": left}

    monkeypatch.setattr(module, "tried", one_peak)
    made = compensation_of([recorded(1)], None, 64, 1)
    assert made.evidence > module.SURE
    assert made.worth is worth


def test_what_is_expected_is_what_was_held_out_where_others_met_the_same_angles(monkeypatch):
    """Held out nothing falls, on the fit's own rows all of it: what is expected is the former, of a recording whose
    angles no other met the latter."""

    def nothing_falls(split, *_):
        return {"harmonics": split[0].error - split[0].error.mean()}

    monkeypatch.setattr(module, "tried", nothing_falls)
    met = compensation_of([recorded(1), recorded(2)], None, 64, 1)
    alone = compensation_of([recorded(1)], None, 64, 1)
    assert met.predicted == pytest.approx(met.before, rel=0.1)
    assert met.predicted > 0.6 > 0.2 > alone.predicted


def test_the_seed_reaches_the_fits_and_the_draws_and_the_held_out_parts_keep_the_sign(monkeypatch):
    """Held out, a part that chose another sign would judge a model that is not written."""
    asked, begun = [], np.random.default_rng

    def model_of(rows, drive, seed, sign=None):
        asked.append((len(rows), drive, seed, sign))
        return SimpleNamespace(sign=-1.0)

    def tried(split, _terms, _paths, fit, _samples):
        rows, fold = split
        for k in range(int(fold.max()) + 1):
            assert fit(rows.rows(fold != k)).sign == -1.0
        return {"model": rows.error - rows.error.mean()}

    seeds, run, drive = [], recorded(1), object()
    monkeypatch.setattr(module, "model_of", model_of)
    monkeypatch.setattr(module, "tried", tried)
    monkeypatch.setattr(module, "candidates", lambda *_: {"model": (nothing(), 0.0)})
    monkeypatch.setattr(module.np.random, "default_rng", lambda seed: seeds.append(seed) or begun(seed))
    compensation_of([run], drive, 64, 7)
    whole, *held = asked
    assert whole[1:] == (drive, 7, None)
    assert len(held) == 4
    assert {one[1:] for one in held} == {(drive, 7, -1.0)}
    assert all(one[0] < whole[0] for one in held)
    assert seeds == [7]


def test_sixty_four_coefficients_are_taken_up_to_a_twentieth_of_what_is_left():
    """A raised tooth that 64 terms hold but in part: a table from where that part is a twentieth of what is left."""
    model = CartesianModel.of(load_study(drive="csf-25-80").drive)
    errors = to_cartesian(DriveErrors(axis_eccentricity=0.006, wg_eccentricity=0.003), model.half_width)
    around = np.arange(4096) * (TURN / 4096)
    tooth = 2.5e-3 * np.maximum(1 - np.abs(around - 2.0) / (2 * TURN / 160), 0)
    teeth = replace(Teeth.bare(model, errors, 1.0), cs=np.zeros(4096), fs=tooth)
    off = formed(teeth, nothing(), 64, 1.0)[1]
    assert off > 0.001
    assert hasattr(formed(teeth, nothing(), None, off / 0.052)[0], "values")
    assert not hasattr(formed(teeth, nothing(), None, off / 0.048)[0], "values")


@pytest.mark.parametrize(("turns", "judged"), [(20, False), (21, True)])
def test_more_than_a_quarter_of_an_output_turn_can_be_judged(turns, judged):
    """Stretches of N/8 = 10 input turns, of which the third may be begun."""
    made = compensation_of([recorded(1, turns)], None, 64, 1)
    assert (made.stretches, made.judged) == ((3, True) if judged else (2, False))


def at_speed(speed, seed, noise):
    """There and back over the output's turn at a `speed` of 60 r/min, with `noise` (arcmin) that grows backward."""
    one = np.arange(81 * PER_TURN) * TURN / PER_TURN
    theta = np.r_[one, one[::-1]]
    way = np.r_[np.ones(len(one)), -np.ones(len(one))]
    error = 0.3 * np.sin(2 * theta) + np.random.default_rng(seed).normal(0, noise, len(theta)) * np.where(way > 0, 1, 2)
    angles = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / RATIO - error / 60}
    frame = pd.DataFrame({"time_s": np.arange(len(theta)) / PER_TURN / speed, **angles})
    return recording_from_table(frame, RATIO)


def normal_range(noise, count):
    """What `count` normal values span in the mean: twice sqrt(2 ln n), less its second term (Cramer 1946, 28.6)."""
    most = np.sqrt(2 * np.log(count))
    return 2 * noise * (most - (np.log(np.log(count)) + np.log(4 * np.pi)) / (2 * most) + 0.5772 / most)


def test_what_is_expected_is_said_of_each_direction_and_speed_with_its_interval(monkeypatch):
    """Noise twice as large backward, three times as large at twice the speed; two runs of each. Of one recording the
    extremes vary by 6 % about their mean, of four less."""
    runs = [at_speed(speed, 3 * speed + k, NOISE * (1 if speed == 1 else 3)) for speed in (2, 1) for k in (0, 1)]
    waves = replace(SWINGS, cos=np.zeros(1), sin=np.array([0.3]), back=0.0)
    held_out = {"harmonics": waves}
    monkeypatch.setattr(
        module,
        "tried",
        lambda split, *_: {
            name: split[0].error - one.at(split[0].theta, split[0].theta / RATIO) for name, one in held_out.items()
        },
    )
    monkeypatch.setattr(module, "candidates", lambda *_: {"harmonics": (waves, 0.0)})
    told = compensation_of(runs, None, 64, 1).to_dict(None)
    count, fast = 81 * PER_TURN, 3 * NOISE
    forward = (normal_range(NOISE, count) + normal_range(fast, count)) / 2
    ways = told["expected_by_direction"]
    assert ways["forward"]["expected"] == pytest.approx(forward, rel=0.1)
    assert ways["backward"]["expected"] == pytest.approx(2 * forward, rel=0.1)
    slow, quick = told["expected_by_speed"]
    assert (slow["speed_rpm"], quick["speed_rpm"]) == (pytest.approx(60), pytest.approx(120))
    assert slow["expected"] == pytest.approx(normal_range(2 * NOISE, count), rel=0.1)
    assert quick["expected"] == pytest.approx(3 * slow["expected"], rel=0.1)
    for one in (*ways.values(), slow, quick):
        assert 0.7 * one["expected"] < one["low"] < one["expected"] < one["high"] < 1.3 * one["expected"]
    assert compensation_of(runs[:2], None, 64, 1).speeds == {}


def test_a_way_that_a_part_does_not_show_is_judged_by_what_it_falls_back_to(monkeypatch):
    """A damaged tooth that the rows of one part do not show: not a number there, it was chosen and then refused."""
    rows = gather([recorded(1)])
    fold = np.arange(len(rows)) % 4
    begun = iter(range(4))

    def some(train, *_):
        made = {"model, teeth and harmonics": (nothing(), 0.0)}
        return made if next(begun) == 2 else made | {"a damaged tooth": (SWINGS, 0.0)}

    monkeypatch.setattr(trials_module, "candidates", some)
    tried = trials_module.tried((rows, fold), 64, {}, lambda _: None, Samples(rows, np.arange(len(rows))))
    assert not np.isnan(tried["a damaged tooth"]).any()
    same = tried["a damaged tooth"] == tried["model, teeth and harmonics"]
    assert same[fold == 2].all() and not same[fold != 2].any()


def test_what_the_whole_record_does_not_show_is_not_chosen(monkeypatch):
    """Parts that show a damaged tooth where the whole does not: nothing could be written."""

    def both(split, *_):
        left = split[0].error - split[0].error.mean()
        return {"harmonics": 0.5 * left, "a damaged tooth": 0.1 * left}

    monkeypatch.setattr(module, "tried", both)
    assert compensation_of([recorded(1)], None, 64, 1).method == "harmonics"
