"""Files as benches write them, each made by its format's own library, read back as one and the same recording."""

import gzip
import json
import re
from datetime import UTC, datetime, timedelta

import numpy as np
import pandas as pd
import pytest

from hdopt.cli import main
from hdopt.errors import HdoptError
from hdopt.recordings.bench import Bench, bench_text, load_bench
from hdopt.recordings.columns import Column
from hdopt.recordings.read import read_channels, read_recording
from hdopt.workflow.recorded_drive import recorded_drive

RATIO, TURN, ROWS, RATE = 80.0, 2 * np.pi, 800, 50.0
START = datetime(2026, 11, 22, 9, 59, 58, 250_000, tzinfo=UTC)
WITHIN_ARCMIN = 1e-3
"""Texts hold nine digits of a degree, 6e-8 arcmin; whole nanoseconds move nothing."""


def ke_arcmin(theta):
    return 0.3 * np.sin(2 * theta + 0.4)


@pytest.fixture(scope="module")
def truth():
    """Time s, input rad, output rad of four turns forward and back."""
    theta = np.r_[np.arange(ROWS // 2), ROWS // 2 - 1 - np.arange(ROWS // 2)] * TURN / 100 + 0.3
    return np.arange(ROWS) / RATE, theta, theta / RATIO - np.radians(ke_arcmin(theta) / 60)


def same(recording, truth, within=WITHIN_ARCMIN):
    time, theta, _ = truth
    assert len(recording) == len(theta)
    np.testing.assert_allclose(recording.input_angle, theta, atol=1e-6)
    np.testing.assert_allclose(recording.error_arcmin, ke_arcmin(theta), atol=within)
    if recording.time is not None:
        np.testing.assert_allclose(recording.time - recording.time[0], time, atol=1e-6)


def with_comma(value):
    return f"{value:.9f}".replace(".", ",")


def text_of(truth, separator=";", decimal=",", head=("Zeit", "Motor [deg]", "Abtrieb [deg]"), times=None):
    write = with_comma if decimal == "," else "{:.9f}".format
    lines = [separator.join(head)] if head else []
    for i, (t, a, b) in enumerate(zip(truth[0], np.degrees(truth[1]), np.degrees(truth[2]), strict=True)):
        lines.append(separator.join((times[i] if times else write(t), write(a), write(b))))
    return "\n".join(lines) + "\n"


def iso(t):
    return (START + timedelta(seconds=float(t))).isoformat(timespec="milliseconds").replace("+00:00", "Z")


GERMAN = "time=Zeit:s,input=Motor [deg],output=Abtrieb [deg]"
TEXTS = {
    "semicolon and decimal comma": (lambda t: text_of(t).encode(), GERMAN),
    "tab": (lambda t: text_of(t, "\t", ".").encode(), GERMAN),
    "quoted, comma as both": (lambda t: text_of(t, '","').replace("\n", '"\n"').join(('"', "")).encode()[:-1], GERMAN),
    "byte order mark": (lambda t: text_of(t).encode("utf-8-sig"), GERMAN),
    "utf-16": (lambda t: text_of(t).encode("utf-16"), GERMAN),
    "cp1252": (lambda t: text_of(t, head=("Zeit [s]", "Motor [°]", "Abtrieb [°]")).encode("cp1252"), None),
    "comments and preamble": (lambda t: ("# rig 3\n% 22.11.2026\nBench;7\n\n" + text_of(t)).encode(), GERMAN),
    "row of units": (
        lambda t: (
            text_of(t, head=("Zeit", "Motor", "Abtrieb")).replace("Abtrieb\n", "Abtrieb\ns;deg;deg\n", 1).encode()
        ),
        "time=Zeit,input=Motor,output=Abtrieb",
    ),
    "no header": (lambda t: text_of(t, head=()).encode(), "time=1:s,input=2:deg,output=3:deg"),
    "gzip": (lambda t: gzip.compress(text_of(t).encode()), GERMAN),
    "ISO times": (lambda t: text_of(t, times=[iso(x) for x in t[0]]).encode(), GERMAN),
    "ISO times with a decimal comma": (
        lambda t: text_of(t, times=[iso(x).replace(".", ",") for x in t[0]]).encode(),
        GERMAN,
    ),
    "day.month.year": (
        lambda t: text_of(
            t, times=[(START + timedelta(seconds=float(x))).strftime("%d.%m.%Y %H:%M:%S.%f") for x in t[0]]
        ).encode(),
        GERMAN,
    ),
}


@pytest.mark.parametrize("kind", TEXTS)
def test_text_as_people_have_it(truth, tmp_path, kind):
    content, columns = TEXTS[kind]
    path = tmp_path / ("bench.csv.gz" if kind == "gzip" else "bench.csv")
    path.write_bytes(content(truth))
    recording = read_recording(path, RATIO, columns)
    assert recording.warnings == ()
    same(recording, truth)


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_dates_of_any_resolution_are_seconds(truth, tmp_path, unit):
    """Milliseconds read as seconds would make a delay of 5 ms one of 5 s."""
    stamps = (np.datetime64("2026-11-22T09:59:58", "ns") + (truth[0] * 1e9).astype("timedelta64[ns]")).astype(
        f"datetime64[{unit}]"
    )
    rows = slice(None, None, 50) if unit == "s" else slice(None)
    theta = np.linspace(0, 30, ROWS)[rows] if unit == "s" else truth[1]
    table = pd.DataFrame({"t": stamps[rows], "a": theta, "b": theta / RATIO})
    if unit == "s":
        table = pd.concat([table.assign(t=table.t + np.timedelta64(16 * k, "s")) for k in range(4)]).iloc[:64]
        table["a"], table["b"] = np.linspace(0, 30, 64), np.linspace(0, 30, 64) / RATIO
    table.to_parquet(tmp_path / "bench.parquet", index=False)
    recording = read_recording(tmp_path / "bench.parquet", RATIO, "time=t,input=a:rad,output=b:rad")
    assert recording.time[-1] - recording.time[0] == pytest.approx(63.0 if unit == "s" else truth[0][-1], abs=2e-3)
    assert any("dates" in said for said in recording.understood)


@pytest.mark.parametrize(
    ("name", "taken"), [("time", True), ("Zeit [ms]", True), ("date", False), ("time_of_day", False)]
)
def test_a_clock_of_another_name_beside_the_default_angles_is_taken(truth, tmp_path, name, taken):
    """Would catch a recording read without its clock because its angles alone bear the default names."""
    time, theta, output = truth
    clock = {
        "time": pd.Timestamp("2025-01-01") + pd.to_timedelta(time, unit="s"),
        "Zeit [ms]": 1000 * time,
        "date": "2025-01-01",
        "time_of_day": time,  # of no unit: without it the file can be read, so nothing is asked
    }[name]
    angles = pd.DataFrame({"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(output)})
    angles.assign(**{name: clock}).to_parquet(tmp_path / "r.parquet")
    found = read_recording(tmp_path / "r.parquet", RATIO)
    assert (found.time is not None) == taken
    if taken:
        np.testing.assert_allclose(found.time - found.time[0], time - time[0], atol=1e-6)


def lines_of(truth, ending=""):
    time, theta, output = truth
    rows = zip(time, np.degrees(theta), np.degrees(output), strict=True)
    return ["time_s,input_angle_deg,output_angle_deg", *(f"{t:.6f},{a:.9f},{b:.12f}{ending}" for t, a, b in rows)]


def test_lines_with_too_many_fields_are_counted_and_said(truth, tmp_path, recwarn):
    """Would catch rows lost without a word, and the warning of a library on the terminal."""
    lines = lines_of(truth)
    lines[40] += ",7"
    lines[90] += ",8,9"
    (tmp_path / "r.csv").write_text("\n".join(lines))
    found = read_recording(tmp_path / "r.csv", RATIO)
    told = "2 lines with more fields than the header names left out, the first .* in line 41; does a decimal comma"
    assert any(re.search(told, said) for said in found.warnings)
    assert len(found) == ROWS - 2 and not recwarn.list


def test_a_separator_at_the_end_of_each_line_is_no_field(truth, tmp_path, recwarn):
    (tmp_path / "r.csv").write_text("\n".join(lines_of(truth, ",")))
    assert len(read_recording(tmp_path / "r.csv", RATIO)) == ROWS
    assert not recwarn.list


def test_fields_that_the_header_does_not_name_are_never_dropped_unseen(truth, tmp_path, recwarn):
    """Would catch a field cut off each row because every line ends with a separator and one of them in a number."""
    lines = lines_of(truth, ",")
    lines[60] += "5"
    (tmp_path / "r.csv").write_text("\n".join(lines))
    with pytest.raises(HdoptError, match=r"r\.csv: its rows have more fields than the 3 that its header names"):
        read_recording(tmp_path / "r.csv", RATIO)
    assert not recwarn.list


def test_counts_gear_and_turns(truth, tmp_path):
    """An encoder of 16384 counts behind a gear of 3 on the input, the output in turns, both beyond one overflow."""
    time, theta, output = truth
    table = pd.DataFrame({"t": time, "enc": theta / TURN * 16384 * 3, "out": output / TURN})
    table.to_csv(tmp_path / "bench.csv", index=False, float_format="%.12f")
    columns = "time=t:s,input=enc:counts/16384/gear3,output=out:turn"
    same(read_recording(tmp_path / "bench.csv", RATIO, columns), truth)
    table = table.assign(out=-output * 1e3)
    table.to_csv(tmp_path / "bench.csv", index=False, float_format="%.12f")
    recording = read_recording(tmp_path / "bench.csv", RATIO, columns.replace("out:turn", "out:-mrad"))
    same(recording, truth)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ("input=a:counts,output=b:deg", "write input=NAME:counts/16384"),
        ("input=a:counts/0,output=b:deg", "counts per turn '0'; give a finite number above 0"),
        ("input=a:deg/gearx,output=b:deg", "gear 'x'"),
        ("input=a b,output=b:deg", r'--columns "input=a b:UNIT" '),
        ("input=a,output=b:deg", r"no unit is stated for input; give it with --columns input=a:UNIT"),
        ("input=a,output=b:deg,time=t:iso", r"dates and times of day have none: write time=NAME"),
        ("input=a,output=b:deg,time=t:ISO-8601", r"dates and times of day have none: write time=NAME"),
        ("input=a:deg,output=b:deg,torque=a", r"torque=a:UNIT \(torque: Nm, Nmm, Ncm, kNm\)"),
    ],
)
def test_units_that_do_not_do(tmp_path, columns, message):
    pd.DataFrame(dict.fromkeys(("a", "b", "a b"), np.arange(100))).to_csv(tmp_path / "x.csv", index=False)
    with pytest.raises(HdoptError, match=message):
        read_recording(tmp_path / "x.csv", RATIO, columns)


def test_hdf5_and_matlab_73(truth, tmp_path):
    h5py = pytest.importorskip("h5py")
    for name, shape in (("bench.h5", (-1,)), ("bench.mat", (1, -1))):
        with h5py.File(tmp_path / name, "w", userblock_size=512) as file:
            for key, values in zip(("t", "rig/motor", "rig/load"), truth, strict=True):
                file.create_dataset(key, data=values.reshape(shape)).attrs["unit"] = "s" if key == "t" else "rad"
        if name.endswith(".mat"):
            raw = bytearray((tmp_path / name).read_bytes())
            raw[:128] = b"MATLAB 7.3 MAT-file".ljust(116) + b"\0" * 8 + b"\x00\x02IM"
            (tmp_path / name).write_bytes(raw)
        recording = read_recording(tmp_path / name, RATIO, "time=t,input=rig/motor,output=/rig/load")
        same(recording, truth)
        assert any("input is in rad, as the file says" in said for said in recording.understood)
    with pytest.raises(HdoptError, match=r"unknown column for input 'nope'; the file has .*rig/motor"):
        read_recording(tmp_path / "bench.h5", RATIO, "input=nope:deg,output=x:deg")
    told = r"for output '/rig/laod'; did you mean 'rig/load'\? the file has rig/load, .*rig/motor"
    with pytest.raises(HdoptError, match=told):
        read_recording(tmp_path / "bench.h5", RATIO, "input=/rig/motor,output=/rig/laod")


@pytest.mark.parametrize("along", [0, 1])
def test_columns_of_an_array_are_channels(truth, tmp_path, along):
    """Would catch arrays of several columns left out without a word, and rows taken for columns."""
    h5py = pytest.importorskip("h5py")
    from scipy.io import savemat

    array = np.stack(truth, axis=along)
    with h5py.File(tmp_path / "bench.h5", "w") as file:
        file["rig/all"] = array
    savemat(tmp_path / "bench.mat", {"rig": {"all": array}, "note": 3.0})
    same(
        read_recording(tmp_path / "bench.h5", RATIO, "time=/rig/all[0]:s,input=rig/all[1]:rad,output=/rig/all[2]:rad"),
        truth,
    )
    same(
        read_recording(tmp_path / "bench.mat", RATIO, "time=rig.all[0]:s,input=rig.all[1]:rad,output=rig.all[2]:rad"),
        truth,
    )
    with pytest.raises(HdoptError, match=r"for input '/rig/all'; did you mean 'rig/all\[0\]'\? the file has"):
        read_recording(tmp_path / "bench.h5", RATIO, "input=/rig/all:rad,output=rig/all[2]:rad")


def test_tdms_channels_of_different_rates(truth, tmp_path):
    """The output at a tenth of the input's rate, started 0.1 s later: brought onto the slower clock, and said so."""
    nptdms = pytest.importorskip("nptdms")
    fine = np.arange(8000) / 1000
    theta = 3.0 * fine
    late = fine[100::10]
    output = np.interp(late, fine, theta) / RATIO - np.radians(ke_arcmin(3.0 * late) / 60)
    start = np.datetime64("2026-11-22T10:00:00", "us")
    with nptdms.TdmsWriter(tmp_path / "bench.tdms") as writer:
        for name, values, step, begin in (
            ("motor", theta, 1e-3, start),
            ("load", output, 1e-2, start + np.timedelta64(100, "ms")),
        ):
            properties = {"wf_increment": step, "wf_start_time": begin, "unit_string": "rad"}
            writer.write_segment([nptdms.ChannelObject("rig", name, values, properties)])
    recording = read_recording(tmp_path / "bench.tdms", RATIO, "input=rig/motor,output=load")
    np.testing.assert_allclose(recording.error_arcmin, ke_arcmin(recording.input_angle), atol=WITHIN_ARCMIN)
    assert len(recording) == len(late)
    assert any("interpolated linearly onto the clock of output (100 Hz)" in said for said in recording.understood)
    told = r"for output 'rig/laod'; did you mean 'load'\? the file has load, .*motor"
    with pytest.raises(HdoptError, match=told):
        read_recording(tmp_path / "bench.tdms", RATIO, "input=rig/motor,output=rig/laod")
    with pytest.raises(HdoptError, match=r"for input 'x'; the file has"):
        read_recording(tmp_path / "bench.tdms", RATIO, "input=x:rad,output=y:rad")


def test_ros2_bag_and_mcap(truth, tmp_path):
    rosbags = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    joint, header, stamp = (
        store.types[name]
        for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    empty = np.zeros(0)
    for plugin in (rosbags.StoragePlugin.SQLITE3, rosbags.StoragePlugin.MCAP):
        folder = tmp_path / plugin.name
        with rosbags.Writer(folder, version=9, storage_plugin=plugin) as writer:
            connection = writer.add_connection("/joint_states", joint.__msgtype__, typestore=store)
            for t, a, b in zip(*truth, strict=True):
                ns = round(t * 1e9) + 10**18
                message = joint(
                    header(stamp(ns // 10**9, ns % 10**9), ""), ["motor", "load"], np.array([a, b]), empty, empty
                )
                writer.write(connection, ns + 777, store.serialize_cdr(message, joint.__msgtype__))
        columns = "input=/joint_states.position[motor]:rad,output=/joint_states.position[load]:rad"
        same(read_recording(folder, RATIO, columns), truth)
    (file,) = (tmp_path / "MCAP").glob("*.mcap")
    same(read_recording(file, RATIO, columns), truth)


def test_mcap_with_json(truth, tmp_path):
    writers = pytest.importorskip("mcap.writer")
    with (tmp_path / "bench.mcap").open("wb") as stream:
        writer = writers.Writer(stream)
        writer.start()
        schema = writer.register_schema("angles", "jsonschema", b"{}")
        channel = writer.register_channel("/rig", "json", schema)
        for t, a, b in zip(*truth, strict=True):
            ns = round(t * 1e9)
            writer.add_message(channel, ns, json.dumps({"in": a, "enc": {"out": b}}).encode(), ns)
        writer.finish()
    same(read_recording(tmp_path / "bench.mcap", RATIO, "input=/rig.in:rad,output=/rig.enc.out:rad"), truth)
    with pytest.raises(HdoptError, match=r"unknown column for input '/rig/in'; did you mean '/rig\.in'"):
        read_recording(tmp_path / "bench.mcap", RATIO, "input=/rig/in:rad,output=/rig/enc/out:rad")


def test_mdf(truth, tmp_path):
    asammdf = pytest.importorskip("asammdf", reason="asammdf is an extra of its own")
    with asammdf.MDF(version="4.10") as file:
        signals = [
            asammdf.Signal(values, truth[0], unit="rad", name=name)
            for name, values in zip(("motor", "load"), truth[1:], strict=True)
        ]
        file.append(signals)
        file.save(tmp_path / "bench.mf4")
    same(read_recording(tmp_path / "bench.mf4", RATIO, "input=motor,output=load"), truth)


PHD2_HEAD = """PHD2 version 2.6.13 [Windows], Log version 2.5. Log enabled at 2026-11-22 20:00:00

Guiding Begins at 2026-11-22 20:01:00
Exposure = 500 ms
Pixel scale = 2.00 arc-sec/px, Binning = 1, Focal length = 300 mm
RA = 5.00 hr, Dec = 0.0 deg, Hour angle = 0.00 hr
Frame,Time,mount,dx,dy,RARawDistance,DECRawDistance,RAGuideDistance,DECGuideDistance,RADuration,RADirection,SNR
"""


def test_phd2_log_takes_corrections_back(tmp_path):
    """A drift of 0.1 arcsec a frame, corrected by 0.05 px each frame: unguided, the whole drift is back."""
    lines, sent, n = [], 0.0, 200
    for i in range(n):
        raw_px = 0.1 * i / 2 - sent
        lines.append(f'{i + 1},{0.5 * i:.3f},"Mount",0,0,{raw_px:.6f},0.0,0.05,0,10,W,30.0')
        sent += 0.05
        if i == 50:
            lines.append('52,25.25,"DROP",,,,,,,,,,"Star lost"')
    (tmp_path / "guide.txt").write_text(PHD2_HEAD + "\n".join(lines) + "\nGuiding Ends at 2026-11-22 20:05:00\n")
    channels = read_channels(tmp_path / "guide.txt", "time=time,input=output_sidereal_deg:deg,error=ra_unguided")
    np.testing.assert_allclose(np.degrees(channels.values["error"]) * 3600, 0.1 * np.arange(n), atol=1e-4)
    assert any("2 arcsec a pixel" in said for said in channels.understood)


def test_missing_library_says_what_to_install(truth, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "h5py", None)
    (tmp_path / "bench.h5").write_bytes(b"x")
    with pytest.raises(
        HdoptError, match=r"needs the library h5py, which is not installed; pip install 'hdopt\[formats\]'"
    ):
        read_recording(tmp_path / "bench.h5", RATIO, "input=a:deg,output=b:deg")


def test_bench_file_round_trip(truth, tmp_path):
    """Counts, a turned sign and a calibration said once; what was written is what is read."""
    columns = {
        "time": Column("t", "s"),
        "input": Column("enc", "counts/16384/gear3", -1.0, (), 0.01, 5.0),
        "output": Column("out", "rad", 1.0, ((0.0, 0.0), (90.0, 30.0), (270.0, -30.0))),
    }
    (tmp_path / "bench.toml").write_text(bench_text(columns, RATIO, "rig 3"))
    bench = load_bench(tmp_path / "bench.toml")
    assert bench.ratio == RATIO and bench.name == "rig 3"
    assert bench.columns["input"].unit.startswith("counts/16384") and bench.columns["input"].sign == -1
    assert bench.columns["output"] == columns["output"]
    time, theta, output = truth
    off = np.interp(np.mod(output, TURN), np.radians([0, 90, 270]), np.radians([0, 30 / 3600, -30 / 3600]), period=TURN)
    pd.DataFrame({"t": time, "enc": -theta / TURN * 16384 * 3, "out": output + off}).to_csv(
        tmp_path / "r.csv", index=False
    )
    recording = read_recording(tmp_path / "r.csv", RATIO, bench=bench)
    # The deviation is taken at the reading, not at the true angle: 30 arcsec x (30 arcsec a quarter turn) is nothing.
    same(recording, truth, 1e-3)
    assert recording.sensor_arcmin == pytest.approx(5 / 80 / 60)


def test_what_is_given_beside_a_bench_file_is_not_silently_stronger(truth, tmp_path):
    """Would catch a ratio, or columns with their calibration, that replace those of the bench without a word."""
    time, theta, output = truth
    for name, rows in (("r", slice(None)), ("s", slice(None, None, 2))):
        table = pd.DataFrame({"t": time[rows], "in": theta[rows], "out": output[rows]})
        table.to_csv(tmp_path / f"{name}.csv", index=False)
    columns = {
        "time": Column("t", "s"),
        "input": Column("in", "rad"),
        "output": Column("out", "rad", 1.0, ((0.0, 30.0),)),
    }
    (tmp_path / "bench.toml").write_text(bench_text(columns, 79.5))
    given = "time=t:s,input=in:rad,output=out:rad"
    both = [tmp_path / "r.csv", tmp_path / "s.csv"]
    first, second = recorded_drive("none", RATIO, given, tmp_path / "bench.toml").recordings(both)
    assert sum("the ratio is 80 as given with --ratio; the 79.5 of the bench file" in w for w in first.warnings) == 1
    assert sum("those of the bench file, with their signs, steps and calibration" in w for w in first.warnings) == 1
    assert not any("bench file" in warning for warning in second.warnings)
    (tmp_path / "bench.toml").write_text(bench_text(columns, RATIO))
    same_again = recorded_drive("none", RATIO, None, tmp_path / "bench.toml").recordings(both)
    assert not any("bench file" in warning for recording in same_again for warning in recording.warnings)
    with pytest.raises(HdoptError, match="the bench file's ratio is 81, that of the drive csf-25-80 is"):
        recorded_drive("csf-25-80", None, None, Bench("", 81.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ratoi = 3", r"b.toml, line 1: unknown key 'ratoi'; did you mean 'ratio'"),
        ("[columns.input]\nunit = 'deg'", "needs column = "),
        ("[columns.input]\ncolumn = 'a'\nsign = 2", "sign is 2; give 1 or -1"),
        ("[columns.input]\ncolumn = 'a'\ncounts_per_turn = -1", "give a finite number above 0"),
        ("[columns.input]\ncolumn = 'a'\ncalibration = [[10, 1], [5, 1]]", "its angles rising"),
        ("[columns.input", "cannot be read as TOML"),
        ("ratio = 0", "ratio is 0; give a finite number above 0"),
        ("ratio = -80.0", "ratio is -80.0; give a finite number above 0"),
        ("ratio = true", "ratio is True; give a finite number above 0"),
        ("[columns.input]\ncolumn = 'a'\nstep_deg = -0.1", "step_deg is -0.1; give a finite number, 0 or above"),
        (
            "[columns.input]\ncolumn = 'a'\ncalibration = [[0, 1], [360, 2]]",
            "runs from 0 to 360 deg; keep to 0 to below",
        ),
        (
            "[columns.input]\ncolumn = 'a'\ncalibration = [[-1, 1], [90, 2]]",
            "runs from -1 to 90 deg; keep to 0 to below",
        ),
        ("ratio = 1" + 400 * "0", "ratio is 10000.*; give a finite number above 0"),
        ("ratio = 1" + 5000 * "0", "cannot be read as TOML"),
        ("ratio = " + 2000 * "[" + 2000 * "]", "b.toml"),
        ("name = 3", "name is 3; give a text in quotes"),
        ("[columns.input]\ncolumn = 'a'\nunit = 3", "unit is 3; give a text in quotes"),
        ("[columns.input]\ncolumn = 'a'\nsign = true", "sign is True; give 1 or -1"),
        ("[columns.input]\ncolumn = 'a'\nunit = 'deg'\ncounts_per_turn = 4096", "unit 'deg' and counts_per_turn"),
    ],
)
def test_bench_file_is_checked(tmp_path, text, message):
    """Each with the file's name, in three lines at most; would catch a key that another silently overrides, a truth
    value for a number, and a number too long for the machine.
    """
    (tmp_path / "b.toml").write_text(text)
    with pytest.raises(HdoptError, match=message) as refused:
        load_bench(tmp_path / "b.toml")
    assert str(refused.value).startswith("b.toml")
    assert re.search(r"\bline \d+", str(refused.value)), refused.value
    assert len(str(refused.value)) < 400


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("name = 'b'\n# of the lab\nratio = -80", 3),
        ("ratio = 80\n\n[columns.input]\ncolumn = 'a'\nsign = 2", 5),
        ("ratio = 80\n[columns.output]\nunit = 'deg'", 2),  # the key is missing: its table
        ("ratio = 80\n[columns.output]\ncolumn = 'b'\ncolour = 'red'", 4),
    ],
)
def test_a_bench_file_is_refused_with_its_line(tmp_path, text, line):
    (tmp_path / "b.toml").write_text(text)
    with pytest.raises(HdoptError, match=rf"^b\.toml, line {line}: "):
        load_bench(tmp_path / "b.toml")


def test_a_bench_file_may_begin_with_a_byte_order_mark(tmp_path):
    """As Windows' editor writes it."""
    (tmp_path / "b.toml").write_bytes(b"\xef\xbb\xbfratio = 80.0\n")
    assert load_bench(tmp_path / "b.toml").ratio == 80.0


def test_a_column_name_that_stands_twice_is_told(truth, tmp_path):
    """Asked which, where nobody says; told, where a name is said. Fault caught: the first taken without a word."""
    time, theta, output = truth
    rows = "".join(f"{t:.6f},{a:.9f},{b:.12f},0.5\n" for t, a, b in zip(time, theta, output, strict=True))
    (tmp_path / "r.csv").write_text("time_s,input_angle_rad,output_angle_rad,output_angle_rad\n" + rows)
    with pytest.raises(HdoptError, match="not plain: output: output_angle_rad or output_angle_rad.1"):
        read_recording(tmp_path / "r.csv", RATIO)
    columns = "time=time_s:s,input=input_angle_rad:rad,output=output_angle_rad:rad"
    recording = read_recording(tmp_path / "r.csv", RATIO, columns)
    assert any("'output_angle_rad' more than once: the first is meant" in note for note in recording.understood)
    same(recording, truth, 1e-3)


@pytest.mark.parametrize(("given", "true"), [(120.0, 121.0), (121.0, 120.0), (80.0, 81.0), (160.0, 161.0)])
def test_a_ratio_off_by_one_is_refused(given, true):
    from hdopt.recordings.read import recording_from_table

    theta = np.arange(2000) * TURN / 100
    table = pd.DataFrame({"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / true})
    with pytest.raises(
        HdoptError, match=rf"ratio of {true:.0f}(\.0+)?, the ratio given is {given:.0f}; this is N [+-] 1"
    ):
        recording_from_table(table, given)


def test_a_gain_is_told_and_a_short_record_says_what_it_cannot_tell():
    from hdopt.recordings.read import recording_from_table

    theta = np.arange(4000) * TURN / 100
    output = np.degrees(theta / RATIO) * 1.0005 - ke_arcmin(theta) / 60
    table = pd.DataFrame({"input_angle_deg": np.degrees(theta), "output_angle_deg": output})
    assert any("moves +0.05% against input/80" in w for w in recording_from_table(table, RATIO).warnings)
    short = table[:60].assign(output_angle_deg=np.degrees(theta[:60]) / RATIO - ke_arcmin(theta[:60]) / 6)
    assert any("too short to tell it from 81" in said for said in recording_from_table(short, RATIO).understood)


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (lambda theta: 0 * theta, "the same number throughout"),
        (lambda theta: theta, "follows the input angle: it is an angle, not an error"),
        (lambda theta: theta / RATIO, "follows the input angle"),
    ],
)
def test_an_error_column_that_is_none_is_refused(error, message):
    from hdopt.recordings.read import recording_from_table

    theta = np.arange(2000) * TURN / 100
    table = pd.DataFrame({"a": theta, "e": error(theta)})
    with pytest.raises(HdoptError, match=message):
        recording_from_table(table, RATIO, "input=a:rad,error=e:rad")


def test_what_is_not_plain_is_asked_for_in_one_message(tmp_path):
    table = pd.DataFrame({"motor_enc_1": np.arange(100), "motor_enc_2": np.arange(100), "load_deg": np.arange(100)})
    table.to_csv(tmp_path / "x.csv", index=False)
    with pytest.raises(HdoptError) as error:
        read_recording(tmp_path / "x.csv", RATIO)
    assert "input: motor_enc_1 or motor_enc_2" in str(error.value)
    assert "--columns input=NAME:UNIT" in str(error.value)
    assert len(str(error.value).splitlines()) <= 3


def test_swapped_stamps_are_sorted_and_a_long_counter_is_counted_on(truth):
    from hdopt.recordings.read import recording_from_table

    time, theta, output = truth
    wrapped = np.mod(theta, 3 * TURN)
    table = pd.DataFrame(
        {"time_s": time, "input_angle_deg": np.degrees(wrapped), "output_angle_deg": np.degrees(output)}
    )
    order = np.arange(ROWS)
    order[[0, 1, 3, 4, 400, 401]] = order[[1, 0, 4, 3, 401, 400]]
    recording = recording_from_table(table.iloc[order].reset_index(drop=True), RATIO)
    same(recording, truth)
    assert any("3 rows were out of order" in w for w in recording.warnings)
    assert any("runs over after 3 turns" in w for w in recording.warnings)


def test_a_clock_that_the_layout_left_out_is_said(truth, tmp_path):
    """Who must state the units of two columns and forgets the time is told; told nothing, much cannot be seen."""
    time, theta, output = truth
    start = pd.Timestamp("2026-05-03T09:00:00")
    stamps = [(start + pd.Timedelta(seconds=float(t))).isoformat() for t in time]
    table = pd.DataFrame({"Zeit": stamps, "Motor [Inc]": theta / TURN * 65536, "Abtrieb": output / TURN})
    table.to_csv(tmp_path / "r.csv", index=False, sep=";", decimal=",", float_format="%.12f")
    columns = "input=Motor [Inc]:counts/65536,output=Abtrieb:turn"
    said = read_recording(tmp_path / "r.csv", RATIO, columns).understood
    assert "r.csv: 'Zeit' is not read, although by its name it is the time: add time=Zeit to --columns" in said
    said = read_recording(tmp_path / "r.csv", RATIO, f"time=Zeit,{columns}").understood
    assert not any("is not read" in sentence for sentence in said)


def test_a_decimal_comma_in_a_limit_is_named():
    from hdopt.recordings.decision import parse_limits

    with pytest.raises(HdoptError, match=r"has a decimal comma; write a point"):
        parse_limits("peak_to_peak=1,5arcmin")


FIRST_LINE = b"time_s,input_angle_deg,output_angle_deg\n"
NUMBERS = b"".join(b"%d,%d,%.4f\n" % (k, 5 * k, 5 * k / 80) for k in range(9000))
NO_TEXT = {
    "a decoder's own words": (FIRST_LINE + bytes(range(128, 256)) * 30, 2, len(FIRST_LINE) + 1),
    "nothing but zeros": (bytes(5000), 1, 0),
    "characters of Windows": (b"\xfd\x05<`\xd5" + NUMBERS, 1, 1),
    "beyond the first lines": (FIRST_LINE + NUMBERS + b"\xe9\x8f", 9002, len(FIRST_LINE + NUMBERS)),
}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(("content", "line", "byte"), NO_TEXT.values(), ids=NO_TEXT)
def test_a_binary_file_is_called_no_text_file(tmp_path, content, line, byte, packed):
    """Faults caught: the words of a decoder, 'charmap' codec can't decode; a byte counted from where a piece of the
    file begins; 'holds no rows', or a request to choose among columns of garbage."""
    path = tmp_path / ("bin.csv.gz" if packed else "bin.csv")
    path.write_bytes(gzip.compress(content) if packed else content)
    said = rf"{path.name} is not a text file: line {line}, byte {byte} is no character; give a recording as text"
    with pytest.raises(HdoptError, match=said):
        read_recording(path, 80.0)


def test_zeros_that_a_power_cut_left_are_a_row_that_is_dropped(tmp_path):
    """Fault caught: a text file refused for its last bytes."""
    path = tmp_path / "cut.csv"
    path.write_bytes(FIRST_LINE + NUMBERS[:9000] + b"\n" + bytes(400))
    assert len(read_recording(path, 80.0)) > 500


def test_a_number_in_a_files_refusal_is_none_of_the_studys(tmp_path, capsys):
    """Fault caught: 'csf-25-80.toml, line 59, clearances.slot_1_width_mm: bin.csv is not a text file: ... byte 6'."""
    (tmp_path / "bin.csv").write_bytes(b"a,b,c,\x00")
    with pytest.raises(SystemExit) as ended:
        main(["inspect", str(tmp_path / "bin.csv"), "--drive", "csf-25-80"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith("hdopt: bin.csv is not a text file: line 1, byte 6 is no character")


@pytest.mark.parametrize("other", ["error_arcmin", "output_angle_rad", "load_deg"])
def test_the_input_of_the_default_layout_is_read_beside_any_output(tmp_path, other):
    """Fault caught: a file with one column of the default layout refused for the other, though the same columns under
    worse names are read."""
    angle = np.linspace(0, 20 * 360, 2000)
    size = {"error_arcmin": 0.3 * np.sin(np.radians(angle)), "output_angle_rad": np.radians(angle) / 80}
    pd.DataFrame({"input_angle_deg": angle, other: size.get(other, angle / 80)}).to_csv(tmp_path / "r.csv", index=False)
    found = read_recording(tmp_path / "r.csv", 80.0)
    assert np.ptp(found.input_angle) == pytest.approx(40 * np.pi)
    assert np.ptp(found.error_arcmin) == pytest.approx(0.6 if other == "error_arcmin" else 0.0, abs=1e-3)
