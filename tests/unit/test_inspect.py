"""`hdopt inspect`: every figure against a waveform whose figures are known, and its limits by the guard band."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hdopt.cli import main
from hdopt.drive.errors import DriveErrors
from hdopt.errors import HdoptError
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings import figures
from hdopt.recordings.capability import gauge, outliers, performance
from hdopt.recordings.decision import checked_limits, decide, parse_limits
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.sheet import Batch, Unit
from hdopt.recordings.stiffness import starting_torque_nm, torsion_of
from hdopt.report import Ruling
from hdopt.report.html import render
from hdopt.report.sections.inspection import batch_report, inspection_report
from hdopt.study import load_study
from hdopt.workflow.inspect import inspect

RATIO, TURN, NOISE = 80.0, 2 * np.pi, 0.004


def recorded(ke_arcmin, turns=6, per_turn=400, play=0.0, back=True, noise=NOISE, seed=1, **channels):
    """A recording forward (and back) of an error given as a function of the input angle; `play` is the return error."""
    one = np.arange(turns * per_turn) * TURN / per_turn
    theta = np.r_[one, one[::-1]] if back else one
    way = np.r_[np.ones(len(one)), -np.ones(len(one))][: len(theta)]
    error = ke_arcmin(theta) + way * play / 2 + np.random.default_rng(seed).normal(0, noise, len(theta))
    table = {"time_s": np.arange(len(theta)) * 0.01, "input_angle_deg": np.degrees(theta)}
    table["output_angle_deg"] = np.degrees(theta) / RATIO - error / 60
    return recording_from_table(pd.DataFrame(table | channels), RATIO)


def wave(theta):
    return 0.3 * np.sin(2 * theta + 0.4)


def test_figures_of_a_sine():
    """Peak-to-peak 0.6, rms 0.3/sqrt 2, return error 0.2, slope 0.6 arcmin per rad. Nine sigma of noise in the
    extremes; a line over 11 deg dims the slope of order 2 by 4 parts in 1000."""
    found = inspect([recorded(wave, play=0.2)])
    assert found.one_turn == pytest.approx(0.6, abs=9 * NOISE / math.sqrt(2))
    assert found.recording_peak_to_peak == pytest.approx(0.6, abs=9 * NOISE / math.sqrt(2))
    assert found.rms == pytest.approx(0.3 / math.sqrt(2), abs=2e-3)
    assert found.returned.median == pytest.approx(0.2, abs=1e-3)
    quiet = inspect([recorded(wave, noise=1e-4)])
    assert quiet.slope_per_deg == pytest.approx(0.6 * math.pi / 180, rel=0.01)
    assert found.slope_arcsec_per_s == pytest.approx(found.slope_per_deg * 60 * 0.9 / 0.01, rel=1e-3)
    assert {o.symbol: o.amplitude_arcmin for o in found.orders}["2"] == pytest.approx(0.3, abs=1e-3)
    assert found.beat is None
    assert found.drift == pytest.approx(0, abs=0.01)


def test_repeatability_is_the_noise_of_a_cell_and_needs_a_second_pass():
    per_cell = recorded(wave, per_turn=300)
    twice = [figures.cells_of(recorded(wave, seed=s, noise=0.03)) for s in (1, 2)]
    cell = 0.03 / math.sqrt(400 / round(TURN / twice[0].width))
    assert figures.repeatability(twice) == pytest.approx(cell, rel=0.1)
    assert figures.repeatability([figures.cells_of(per_cell)]) is None


def test_slipped_counts_are_found_where_they_are():
    slipped = recorded(lambda theta: wave(theta) + 0.5 * (theta > 20.0), back=False)
    ((place, size),) = figures.slips(figures.cells_of(slipped), 0.0)
    assert place == pytest.approx(20.0, abs=0.05) and size == pytest.approx(0.5, abs=0.1)
    assert figures.slips(figures.cells_of(recorded(wave)), 0.0) == []


def test_skew_is_told_from_play_by_two_speeds():
    delay, theta, time = 0.004, [0.0], [0.0]
    for speed in (5.0, -5.0, 2.0, -2.0, 8.0, -8.0):
        n = round(3 * TURN / abs(speed) / 0.005)
        theta = np.r_[theta, theta[-1] + speed * 0.005 * np.arange(1, n + 1)]
        time = np.r_[time, time[-1] + 0.005 * np.arange(1, n + 1)]
    late = np.interp(np.asarray(time) - delay, time, theta)
    play = np.where(np.gradient(theta) > 0, 0.1, -0.1)
    output = late / RATIO - np.radians((wave(late) + play) / 60)
    table = pd.DataFrame({"time_s": time, "input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(output)})
    found, doubt = figures.skew_s(recording_from_table(table, RATIO))
    assert found == pytest.approx(delay, abs=max(3 * doubt, 2e-4))
    assert figures.skew_s(recorded(wave)) is None


ERRORS = DriveErrors(
    axis_eccentricity=0.01,
    axis_eccentricity_direction=0.8,
    wg_eccentricity=0.005,
    wg_tilt_major=0.001,
    cs_tooth_amplitude=0.002,
    fs_tooth_amplitude=0.002,
)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_beat_of_a_short_record_and_the_orientation(mirrored):
    """From 50 of 80 turns the model gives the whole beat within its interval, whichever way the angles count."""
    drive = load_study(drive="csf-25-80").drive
    model = CartesianModel.of(drive)
    errors = to_cartesian(ERRORS, model.half_width)
    sign = -1.0 if mirrored else 1.0
    truth = np.ptp(model.evaluate(np.arange(80 * 360) * TURN / 360, errors)[0])
    found = inspect([recorded(lambda t: sign * model.evaluate(sign * t, errors)[0], 50, 60, back=False)], drive)
    assert found.beat.source == "model"
    assert found.beat.low <= truth <= found.beat.high
    assert found.beat.value == pytest.approx(truth, rel=0.03)
    way = found.to_dict()["orientation"]
    assert way["decided_by"] == "data"
    assert way["input"] == ("the other way round" if mirrored else "as counted")


@pytest.mark.parametrize(("turns", "known"), [(80, True), (79.9, False)])
def test_a_whole_output_turn_needs_no_sample_on_its_end(turns, known):
    """80 turns of 40 samples end a fortieth of a turn before the first sample's place; a tenth of a turn is missing."""
    theta = np.arange(round(turns * 40)) * TURN / 40
    table = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / RATIO - wave(theta) / 60}
    found = inspect([recording_from_table(pd.DataFrame(table | {"time_s": np.arange(len(theta)) * 0.01}), RATIO)])
    assert (found.beat is not None and found.beat.source == "measured") == known


def test_guard_band_of_iso_14253():
    """1.645 u on either side: 0.90 + 0.0823 is below 1, 0.93 is not decidable, 1.09 is above."""
    assert [decide("rms", v, 0.05, 1.0).verdict for v in (0.91, 0.93, 1.07, 1.09)] == [
        "met",
        "not decidable",
        "not decidable",
        "missed",
    ]
    assert decide("rms", None, 0.05, 1.0).met is None


@pytest.mark.parametrize(
    ("text", "message"),
    [("peak=1", "unknown figure in --limit 'peak'"), ("rms=x", "write NAME=NUMBERarcmin"), ("rms=0", "above 0")],
)
def test_bad_limits(text, message):
    with pytest.raises(HdoptError, match=message):
        parse_limits(text)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ("peak=1", "unknown figure in --limit 'peak'"),
        ({"peak2peak": 1.0}, "unknown figure among the limits 'peak2peak'; did you mean 'peak_to_peak'"),
        ({"rms": 0}, "the limit of rms is 0; give a number of arcmin above 0"),
        ({"rms": "1arcmin"}, "the limit of rms is '1arcmin'; give a number of arcmin above 0"),
    ],
)
def test_bad_limits_from_python_end_with_a_message(limits, message):
    """Would catch a limit from Python that is taken unread: words, an unknown name, a limit of 0."""
    with pytest.raises(HdoptError, match=message):
        checked_limits(limits)


def test_limits_in_words_are_those_by_name():
    assert checked_limits("rms=30arcsec, slope=2") == checked_limits({"rms": 0.5, "slope": 2})


def test_the_sheet_begins_with_its_verdicts():
    """Would catch a sheet whose decision stands only in a table, and raw keys among its words."""
    decisions = (
        decide("peak_to_peak", None, 0.1, 1.5, "the model does not explain the record"),
        decide("return_error", 0.4, 0.02, 0.5, "median"),
        decide("slope", 0.4, 0.01, 0.25),
    )
    table = pd.DataFrame({"input_angle_deg": np.arange(0.0, 1800.0, 4.0)})
    table["output_angle_deg"] = table["input_angle_deg"] / 80 + 0.001 * np.cos(np.radians(2 * table["input_angle_deg"]))
    sheet = replace(inspect(recording_from_table(table, 80.0)), limits=decisions, checks={"slipped_counts": "none"})
    page = inspection_report(sheet)
    rulings = [item for item in page.sections[0].items if isinstance(item, Ruling)]
    assert list(page.sections[0].items[:3]) == rulings
    assert [ruling.met for ruling in rulings] == [None, True, False]
    assert rulings[0].text == "Peak-to-peak, at most 1.5 arcmin: the model does not explain the record."
    assert rulings[1].text == "Return error (median) 0.4 arcmin, at most 0.5 arcmin: 0.1 to spare, guard band 0.033."
    assert rulings[2].text == "Slope 0.4 arcmin/deg, at most 0.25 arcmin/deg: 0.15 too much, guard band 0.016."
    html = render(page)
    assert "Not decidable." in html and html.index("Missed.") < html.index("Standard uncertainty")
    assert "slipped counts" in html and "<td>peak_to_peak" not in html


@pytest.mark.parametrize(
    ("ways", "said"),
    [((1.0, 1.0), "all of it turned forward"), ((-1.0, -1.0), "all of it turned backward"), ((1.0, -1.0), "colours")],
)
def test_the_first_figure_speaks_of_the_directions_that_were_recorded(ways, said):
    """Would catch the colours of two directions promised beside a recording of one."""
    from hdopt.recordings.figures import Cells
    from hdopt.report.sections import inspection

    n = 16
    angle, zero = np.linspace(0.0, 2 * np.pi, 2 * n), np.zeros(2 * n)
    half = np.repeat([0, 1], n)
    cells = Cells(angle, np.sin(angle), zero, np.repeat(ways, n), half, np.arange(2 * n), 0.1, 0.0)
    found = SimpleNamespace(cells=[cells], returned=None)
    figure = inspection._waveform(found).items[0]
    assert figure.caption.endswith(f"{said}.")
    assert len(figure.figure.data) == len(set(ways))


def test_torsion_of_a_known_spring():
    """K1 3e4, K2 5e4, K3 6e4 Nm/rad, knees 14 and 48 Nm, a loop of 0.8 arcmin."""
    torque = np.r_[np.linspace(0, 80, 400), np.linspace(80, -80, 800), np.linspace(-80, 80, 800)]
    size = np.abs(torque)
    bend = np.minimum(size, 14) / 3e4 + np.clip(size - 14, 0, 34) / 5e4 + np.maximum(size - 48, 0) / 6e4
    way = np.sign(np.gradient(torque))
    error = np.degrees(np.sign(torque) * bend) * 60 + 0.4 * way
    table = pd.DataFrame({"t": np.arange(2000) * 0.01, "e": error, "m": torque})
    found = torsion_of(recording_from_table(table, RATIO, "time=t:s,error=e:arcmin,torque=m:Nm"))
    assert found.stiffness == pytest.approx((3e4, 5e4, 6e4), rel=0.02)
    assert found.knees == pytest.approx((14, 48), abs=1.0)
    assert found.hysteresis_loss_arcmin == pytest.approx(0.8, rel=0.02)


def test_starting_torque_is_the_largest_before_it_turns():
    torque = np.r_[np.linspace(0, 7, 500), np.full(2300, 4.0)]
    found = recorded(wave, turns=7, back=False)
    theta = np.r_[np.zeros(500), found.input_angle[:2300] - found.input_angle[0]]
    table = pd.DataFrame(
        {"time_s": np.arange(2800) * 0.01, "input_angle_deg": np.degrees(theta), "torque_Nm": torque}
    ).assign(output_angle_deg=np.degrees(theta) / RATIO)
    assert starting_torque_nm(recording_from_table(table, RATIO)) == pytest.approx(7.0, abs=0.05)


def test_ppk_outliers_and_gauge():
    """Log-normal with a spread of 0.1 about 0.5: X99.865 = 0.5 e^0.3; a limit there is Ppk 1."""
    values = np.exp(np.log(0.5) + 0.1 * np.random.default_rng(3).standard_normal(400))
    found = performance(values, 0.5 * math.exp(0.3))
    assert found.low < 1.0 < found.high and found.ppk == pytest.approx(1.0, abs=0.12)
    assert performance(values[:7], 1.0) is None
    assert outliers([0.5, 0.51, 0.49, 0.5, 0.52, 0.48, 1.5]) == [6]
    rng = np.random.default_rng(5)
    readings = [
        (0.5 + m + rng.normal(0, 0.01), f"{k}") for k, m in enumerate(rng.normal(0, 0.05, 60)) for _ in range(4)
    ]
    both = gauge(*map(list, zip(*readings, strict=True)))
    assert both.repeatability == pytest.approx(0.01, rel=0.2)
    assert both.reproducibility == pytest.approx(0.05, rel=0.25)


def test_drives_without_any_scatter_have_no_ppk():
    """Would catch a Ppk of infinity, with an interval of no numbers, for one recording given eight times."""
    assert performance([0.8465] * 8, 1.0) is None


def write(tmp_path, name, recording):
    output = recording.input_angle / RATIO - np.radians(recording.error_arcmin / 60)
    pd.DataFrame(
        {
            "time_s": recording.time,
            "input_angle_deg": np.degrees(recording.input_angle),
            "output_angle_deg": np.degrees(output),
        }
    ).to_csv(tmp_path / name, index=False, float_format="%.9f")
    return str(tmp_path / name)


def run(*arguments):
    with pytest.raises(SystemExit) as end:
        main([*arguments])
    return end.value.code


def test_command_check_ends_with_1_for_missed_only(tmp_path, capsys):
    path = write(tmp_path, "a.csv", recorded(wave))
    gear = ("inspect", path, "--drive", "none", "--ratio", "80")
    assert run(*gear, "--limit", "recording=0.5arcmin", "--check") == 1
    assert run(*gear, "--limit", "recording=0.5arcmin") == 0
    assert run(*gear, "--limit", "recording=0.7arcmin,peak_to_peak=0.8arcmin", "--check") == 0
    assert "peak_to_peak: not decidable, too little of the beat was recorded" in capsys.readouterr().out


@pytest.mark.parametrize(("limit", "met"), [(0.4, False), (0.8, None)])
def test_a_beat_has_no_less_than_the_part_of_it_that_was_recorded(limit, met):
    """0.6 arcmin in six of 80 turns: missed where less is asked, whatever the rest holds; else the rest decides."""
    (decision,) = inspect([recorded(wave)], limits={"peak_to_peak": limit}).limits
    assert decision.met is met
    assert ("the whole beat has no less" in decision.note) is (met is False)


def test_command_writes_json_csv_report_and_bench(tmp_path, capsys):
    path = write(tmp_path, "a.csv", recorded(wave, play=0.1))
    files = {kind: str(tmp_path / f"out.{kind}") for kind in ("json", "csv", "html", "toml")}
    options = (
        "--json",
        files["json"],
        "--csv",
        files["csv"],
        "--report",
        files["html"],
        "--write-bench",
        files["toml"],
    )
    assert run("inspect", path, "--drive", "none", "--ratio", "80", "--serial", "<b>7", *options) == 0
    content = json.loads((tmp_path / "out.json").read_text())
    assert set(content["peak_to_peak_arcmin"]) >= {"one_turn", "recording", "beat"}
    assert {"rms_arcmin", "return_error_arcmin", "repeatability_arcmin", "steepest_slope_arcmin_per_deg"} < set(content)
    assert {"orders", "checks", "limits", "provenance"} < set(content)
    assert "return_error_median" in (tmp_path / "out.csv").read_text()
    assert "<b>7" not in (tmp_path / "out.html").read_text()
    capsys.readouterr()
    assert run("inspect", path, "--drive", "none", "--bench", files["toml"]) == 0
    assert "input_angle_deg" in capsys.readouterr().out


@pytest.mark.parametrize(("drive", "asks"), [("csf-25-80", False), ("none", True)])
def test_a_beat_not_known_asks_for_a_drive_only_where_none_was_given(drive, asks, tmp_path, capsys):
    angle = np.linspace(0.0, 4 * np.pi, 4000)
    error = np.radians(np.sin(2 * angle) / 60)
    file = tmp_path / "short.csv"
    pd.DataFrame({"input_angle_rad": angle, "output_angle_rad": angle / 80 + error}).to_csv(file, index=False)
    options = ["--drive", drive, *(["--ratio", "80"] if asks else [])]
    with pytest.raises(SystemExit):
        main(["inspect", str(file), *options])
    said = capsys.readouterr().out
    assert "full beat: not known; record a whole output turn, or a quarter of one" in said
    assert ("with --drive" in said) == asks
    assert "order 2 " in said and " 0.0000 arcmin" not in said


def test_many_drives_name_the_outlier(tmp_path, capsys):
    paths = [
        write(tmp_path, f"d{k}.csv", recorded(lambda t, a=a: a * np.sin(2 * t), turns=3, seed=k))
        for k, a in enumerate([0.30, 0.31, 0.29, 0.30, 0.305, 0.295, 0.315, 0.9])
    ]
    (tmp_path / "broken.csv").write_text("a,b\n1,2\n")
    out = str(tmp_path / "m.json")
    code = run(
        "inspect", *paths, str(tmp_path / "broken.csv"), "--each", "--drive", "none", "--ratio", "80", "--limit",
        "peak_to_peak=1arcmin", "--json", out, "--report", str(tmp_path / "m.html"),
    )  # fmt: skip
    assert code == 0
    content = json.loads((tmp_path / "m.json").read_text())
    assert content["outliers"] == ["d7.csv"]
    assert content["drives"][-1]["error"].startswith("broken.csv")
    assert content["performance"]["n"] == 8


@pytest.mark.parametrize(
    ("option", "value"), [("--mounting", "A"), ("--speed-rpm", "60"), ("--serial", "7"), ("--write-bench", "b.toml")]
)
def test_what_is_said_of_one_drive_is_refused_for_many(tmp_path, capsys, monkeypatch, option, value):
    """Would catch an option that is taken and forgotten: before, the bench file was silently not written."""
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path, "a.csv", recorded(wave))
    assert run("inspect", path, "--each", "--drive", "none", "--ratio", "80", option, value) == 2
    assert f"{option}: said of one drive" in capsys.readouterr().err


def each_on(engine, paths, tmp_path, capsys):
    code = run("inspect", *paths, "--each", "--drive", "none", "--ratio", "80", "--limit", "peak_to_peak=1arcmin",
               "--engine", engine, "--json", str(tmp_path / "m.json"))  # fmt: skip
    assert code == 0, capsys.readouterr().err
    content = json.loads((tmp_path / "m.json").read_text())
    return {key: value for key, value in content.items() if key != "provenance"}


def test_many_drives_are_the_same_on_a_dask_cluster(tmp_path, capsys):
    """Would catch a source or a sheet that cannot go to another machine, and a fault of one file that ends them all."""
    distributed = pytest.importorskip("distributed")
    paths = [
        write(tmp_path, f"d{k}.csv", recorded(lambda t, a=a: a * np.sin(2 * t), turns=3, seed=k))
        for k, a in enumerate([0.30, 0.31, 0.29])
    ]
    (tmp_path / "broken.csv").write_text("a,b\n1,2\n")
    paths.append(str(tmp_path / "broken.csv"))
    here = each_on("process", paths, tmp_path, capsys)
    assert len(here["drives"]) == 4 and here["drives"][-1]["error"].startswith("broken.csv")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        assert each_on(cluster.scheduler_address.replace("tcp", "dask", 1), paths, tmp_path, capsys) == here


def test_a_page_of_many_drives_gives_no_figures_to_what_was_not_read():
    """Would catch a peak-to-peak of 0 for a file that could not be read, which is the best of all drives."""
    drives = (Unit("a", 0.5, "beat", 0.4, 0.2, None, "met"), Unit("b", 1.5, "beat", 1.4, 0.6, None, "missed", True),
              Unit("c", error="c: holds no rows"))  # fmt: skip
    batch = Batch(drives, 1.0, None)
    assert batch.to_dict()["drives"][2]["peak_to_peak"] is None
    figures, _, table, unread = batch_report(batch).sections[0].items
    assert figures.values == {"Drives": "2", "Limit of the peak-to-peak": "1 arcmin", "Met": "1", "Missed": "1",
                              "Not read": "1"}  # fmt: skip
    assert list(table.frame["drive"]) == ["a", "b"] and list(unread.frame["why"]) == ["c: holds no rows"]


def test_many_drives_go_on_where_they_were_interrupted(tmp_path, capsys, monkeypatch):
    """Would catch drives inspected twice, and parts of a file that has changed since taken for its own."""
    import hdopt.workflow.inspect_many as many
    from hdopt.cli import common

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(common, "QUIET_S", 0.0)
    paths = [write(tmp_path, f"d{k}.csv", recorded(wave, turns=3, seed=k)) for k in range(4)]
    sheet, asked = many.acceptance_sheet, []

    def interrupted_at(count):
        def inspected(recordings, *others, **options):
            asked.append(recordings[0].name)
            if len(asked) == count:
                raise KeyboardInterrupt
            return sheet(recordings, *others, **options)

        return inspected

    gear = ("inspect", *paths, "--each", "--drive", "none", "--ratio", "80", "--engine", "process")
    monkeypatch.setattr(many, "acceptance_sheet", interrupted_at(3))
    assert run(*gear) == 130
    write(tmp_path, "d1.csv", recorded(wave, turns=3, seed=9))
    asked.clear()
    monkeypatch.setattr(many, "acceptance_sheet", interrupted_at(0))
    assert run(*gear, "--resume", "--json", str(tmp_path / "changed.json")) == 0
    assert asked == ["d0.csv", "d1.csv", "d2.csv", "d3.csv"], "another file is other work"
    asked.clear()
    monkeypatch.setattr(many, "acceptance_sheet", interrupted_at(3))
    assert run(*gear) == 130
    asked.clear()
    monkeypatch.setattr(many, "acceptance_sheet", interrupted_at(0))
    assert run(*gear, "--resume", "--json", str(tmp_path / "again.json")) == 0
    assert asked == ["d2.csv", "d3.csv"]
    found = [json.loads((tmp_path / f"{name}.json").read_text()) for name in ("changed", "again")]
    assert found[0]["drives"] == found[1]["drives"]
    assert {f"d{k}.csv" for k in range(4)} <= set(found[1]["provenance"]["inputs"])
    assert run("inspect", paths[0], "--drive", "none", "--ratio", "80", "--resume") == 2


def test_a_figure_is_limited_once(tmp_path, capsys):
    """Fault caught: the last of two limits wins, and a drive meets what it misses."""
    with pytest.raises(HdoptError, match="gives peak_to_peak twice"):
        parse_limits("peak_to_peak=1arcmin,peak_to_peak=2arcmin")
    (tmp_path / "a.csv").write_text("")
    given = ["--limit", "peak_to_peak=1arcmin", "--limit", "peak_to_peak=2arcmin"]
    with pytest.raises(SystemExit, match="2"):
        main(["inspect", str(tmp_path / "a.csv"), *given])
    assert "gives peak_to_peak twice" in capsys.readouterr().err
