"""Recordings: three formats, column mappings, and every fault of real files, each with a file that has it."""

import numpy as np
import pandas as pd
import pytest

from hdopt.errors import HdoptError
from hdopt.recordings.passes import conditions, find_passes, resample_in_angle, synchronous_average
from hdopt.recordings.read import parse_columns, read_recording, recording_from_table

RATIO = 80.0
TURN = 2 * np.pi


def ke_arcmin(theta):
    return 0.3 * np.sin(2 * theta + 0.4)


@pytest.fixture
def table():
    """Four turns forward and back at 100 samples a turn, 10 r/min, with encoder noise."""
    rng = np.random.default_rng(3)
    theta = np.r_[np.arange(400), 399 - np.arange(400)] * TURN / 100 + 0.3
    time = np.arange(800) * 0.06
    output = theta / RATIO - np.radians(ke_arcmin(theta) / 60) + np.radians(rng.normal(0, 1e-4, 800))
    return pd.DataFrame(
        {"time_s": time, "input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(output), "note": "x"}
    )


def read(table, tmp_path, **options):
    path = tmp_path / "bench.csv"
    table.to_csv(path, index=False)
    return read_recording(path, RATIO, **options)


def error_is_right(recording, tolerance=0.05):
    """The error against the truth, up to the encoder noise of 0.006 arcmin and an offset."""
    off = recording.error_arcmin - ke_arcmin(recording.input_angle)
    return np.ptp(off - off.mean()) < tolerance


def test_sound_file_passes_without_a_warning(table, tmp_path):
    recording = read(table, tmp_path)
    assert recording.warnings == ()
    assert len(recording) == 800
    assert error_is_right(recording)


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mat"])
def test_formats_give_the_same_recording(table, tmp_path, suffix):
    path = tmp_path / f"bench{suffix}"
    if suffix == ".csv":
        table.to_csv(path, index=False)
    elif suffix == ".parquet":
        table.to_parquet(path)
    else:
        from scipy.io import savemat

        savemat(path, {name: table[name].to_numpy() for name in table if name != "note"})
    np.testing.assert_allclose(read_recording(path, RATIO).error_arcmin, read(table, tmp_path).error_arcmin, atol=1e-6)


def test_mapping_converts_units_and_signs_and_drops_the_rest(table, tmp_path):
    other = pd.DataFrame(
        {
            "t": table.time_s * 1e3,
            "motor": np.radians(table.input_angle_deg),
            "load": -np.radians(table.output_angle_deg),
            "input_angle_deg": "not looked at",
        }
    )
    recording = read(other, tmp_path, columns="time=t:ms,input=motor:rad,output=load:-rad")
    assert recording.warnings == ()
    np.testing.assert_allclose(recording.error_arcmin, read(table, tmp_path).error_arcmin, atol=1e-6)


def test_only_the_error_recorded(table, tmp_path):
    theta = np.radians(table.input_angle_deg)
    other = pd.DataFrame({"wg": theta, "ra": ke_arcmin(theta) * 60})
    recording = read(other, tmp_path, columns="input=wg:rad,error=ra:arcsec")
    np.testing.assert_allclose(recording.error_arcmin, ke_arcmin(theta), atol=1e-6)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ("input=a:deg", "must name either output= or error="),
        ("imput=a:deg,output=b:deg", "did you mean 'input'"),
        ("input=a:grd,output=b:deg", "unknown unit of input"),
        ("input,output=b:deg", "write CHANNEL=NAME:UNIT"),
    ],
)
def test_bad_mapping_says_what_to_write(columns, message):
    with pytest.raises(HdoptError, match=message):
        parse_columns(columns)


def test_unmapped_column_is_named(table, tmp_path):
    with pytest.raises(HdoptError, match="did you mean 'output_angle_deg'"):
        read(table, tmp_path, columns="input=input_angle_deg:deg,output=output_angle:deg")


def test_nan_rows_are_dropped(table, tmp_path):
    table.loc[100:109, "output_angle_deg"] = np.nan
    recording = read(table, tmp_path)
    assert "10 rows with missing values dropped" in recording.warnings[0]
    assert len(recording) == 790
    assert error_is_right(recording)


def test_mostly_nan_is_refused(table, tmp_path):
    table.loc[:500, "output_angle_deg"] = np.nan
    with pytest.raises(HdoptError, match="more than half is lost"):
        read(table, tmp_path)


def test_text_among_the_numbers_counts_as_missing(table, tmp_path):
    table = table.astype({"output_angle_deg": object})
    table.loc[5, "output_angle_deg"] = "overrun"
    assert any("1 row with missing values" in said for said in read(table, tmp_path).warnings)


def test_repeated_rows_are_dropped(table, tmp_path):
    recording = read(pd.concat([table[:300], table[280:300], table[300:]]).sort_values("time_s"), tmp_path)
    assert "20 repeated rows dropped" in recording.warnings[0]
    assert len(recording) == 800


def test_gap_starts_a_new_segment(table, tmp_path):
    recording = read(table.drop(index=range(200, 260)), tmp_path)
    assert "1 gap" in recording.warnings[0]
    assert recording.segment[-1] == 1
    assert error_is_right(recording)


def test_wrapped_angles_are_unwrapped_over_a_gap_too(table, tmp_path):
    table["input_angle_deg"] %= 360
    recording = read(table.drop(index=range(150, 290)), tmp_path)
    assert any("unwrapped" in warning for warning in recording.warnings)
    assert any("whole input turns" in warning for warning in recording.warnings)
    assert error_is_right(recording)


def test_too_fast_a_wrap_is_refused(table, tmp_path):
    table = table[::47].reset_index(drop=True)
    table = pd.concat([table.assign(time_s=table.time_s + k * 60) for k in range(5)], ignore_index=True)
    table["input_angle_deg"] %= 360
    with pytest.raises(HdoptError, match="turns cannot be counted"):
        read(table, tmp_path)


def test_output_counted_backward_is_turned(table, tmp_path):
    table["output_angle_deg"] *= -1
    recording = read(table, tmp_path)
    assert "sign has been turned around" in recording.warnings[0]
    assert error_is_right(recording)


def test_backward_glitches_are_dropped(table, tmp_path):
    table.loc[[50, 333], "output_angle_deg"] -= 0.2
    recording = read(table, tmp_path)
    assert "2 samples far from their neighbours" in recording.warnings[0]
    assert error_is_right(recording)


def test_wrong_ratio_is_refused_with_the_one_found(table, tmp_path):
    table.to_csv(tmp_path / "bench.csv", index=False)
    with pytest.raises(HdoptError, match=r"ratio of (79\.9|80)\d*.*ratio given is 100"):
        read_recording(tmp_path / "bench.csv", 100.0)


def test_mixed_units_are_named(table, tmp_path):
    with pytest.raises(HdoptError, match="degrees and the other in radians"):
        read(table, tmp_path, columns="input=input_angle_deg:deg,output=output_angle_deg:rad")


def test_exchanged_columns_are_named(table, tmp_path):
    with pytest.raises(HdoptError, match="exchanged"):
        read(table, tmp_path, columns="input=output_angle_deg:deg,output=input_angle_deg:deg")


def test_clock_jitter_is_told(table, tmp_path):
    table["time_s"] += np.random.default_rng(0).normal(0, 0.01, len(table))
    assert any("clock jitters" in warning for warning in read(table, tmp_path).warnings)


def test_rows_out_of_order_are_sorted(table, tmp_path):
    order = np.arange(len(table))
    order[[400, 401]] = [401, 400]
    recording = read(table.iloc[order], tmp_path)
    assert "sorted" in recording.warnings[0]
    assert error_is_right(recording)


def test_restarted_clock_is_refused(table, tmp_path):
    table.loc[400:, "time_s"] -= table.time_s[400]
    with pytest.raises(HdoptError, match="clock starts anew"):
        read(table, tmp_path)


@pytest.mark.parametrize("apart", [1, 3, 30, 300])
def test_a_few_swapped_stamps_are_no_clock_that_starts_anew(table, tmp_path, apart):
    """Three pairs of rows written in each other's place, near or far: after the first of a pair every row is earlier
    than it. Fault caught: the latest stamp so far taken for where the clock stood.
    """
    order = np.arange(len(table))
    for row in (60, 150, 400):
        order[[row, row + apart]] = order[[row + apart, row]]
    recording = read(table.iloc[order], tmp_path)
    assert "rows were out of order" in recording.warnings[0]
    assert error_is_right(recording)
    stamped = read(table.assign(time_s=table.time_s.to_numpy()[order]), tmp_path)
    assert "time stamps were out of order" in stamped.warnings[0]
    # Rows put where the wrong stamps say would be reversals that never were.
    for one in (recording, stamped):
        np.testing.assert_allclose(one.input_angle, np.radians(table.input_angle_deg), atol=1e-9)
        assert np.all(np.diff(one.time) > 0)
        assert find_passes(one.input_angle).count == 2


def test_quantised_encoder_is_told(table, tmp_path):
    table["output_angle_deg"] = (table.output_angle_deg / 0.05).round() * 0.05
    recording = read(table, tmp_path)
    assert any("steps of 3 arcmin" in warning for warning in recording.warnings)
    assert recording.quantum_arcmin == pytest.approx(3.0)


def test_short_record(table, tmp_path):
    with pytest.raises(HdoptError, match="at least 50 are needed"):
        read(table[:30], tmp_path)
    assert any("input turns" in warning for warning in read(table[:120], tmp_path).warnings)


def test_input_that_stands_still_is_refused(table, tmp_path):
    table["input_angle_deg"] = 5.0
    with pytest.raises(HdoptError, match="never changes"):
        read(table, tmp_path)


def test_unreadable_files(tmp_path):
    with pytest.raises(HdoptError, match="no file"):
        read_recording(tmp_path / "none.csv", RATIO)
    (tmp_path / "bench.xlsx").write_text("x")
    with pytest.raises(HdoptError, match="are read from"):
        read_recording(tmp_path / "bench.xlsx", RATIO)
    (tmp_path / "bench.parquet").write_text("x")
    with pytest.raises(HdoptError, match="cannot be read as"):
        read_recording(tmp_path / "bench.parquet", RATIO)
    (tmp_path / "empty.csv").write_text("time_s,input_angle_deg,output_angle_deg\n")
    with pytest.raises(HdoptError, match="holds no rows"):
        read_recording(tmp_path / "empty.csv", RATIO)


def test_passes_survive_encoder_noise():
    angle = np.r_[np.linspace(0, 20, 2000), np.linspace(20, 5, 1500), np.linspace(5, 30, 2500)]
    passes = find_passes(angle + np.random.default_rng(1).normal(0, 0.003, len(angle)))
    assert passes.count == 3
    assert [passes.direction[i] for i in (100, 2500, 5000)] == [1, -1, 1]
    assert passes.since_reversal[3400] == pytest.approx(14.0, abs=0.1)
    assert passes.first[1000] and not passes.first[2100]


def test_conditions_and_averages(table):
    recording = recording_from_table(table, RATIO)
    found = conditions(recording)
    assert [c.direction for c in found] == [1, -1]
    assert found[0].speed == pytest.approx(TURN / 100 / 0.06, rel=0.01)
    angle, mean, _ = synchronous_average(recording.input_angle, recording.error_arcmin, TURN, 50)
    np.testing.assert_allclose(mean, ke_arcmin(angle), atol=0.03)
    grid, error, _ = resample_in_angle(recording, 50)
    assert np.allclose(np.mod(grid / (TURN / 50), 1), 0.5)
    np.testing.assert_allclose(error, ke_arcmin(grid), atol=0.05)


@pytest.mark.parametrize("ratio", [0.0, -80.0, np.nan])
def test_impossible_ratio(table, ratio):
    with pytest.raises(HdoptError, match="above 0"):
        recording_from_table(table, ratio)
