"""Every fault that real recordings have, in every format: repaired with a warning that says so, or refused."""

import re
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

from hdopt.cli import main
from hdopt.errors import HdoptError
from hdopt.recordings.read import read_recording

TURN = 2 * np.pi
RATIO = 80.0
ROWS = 1200


def ke_arcmin(theta):
    return 0.3 * np.sin(2 * theta + 0.4)


def sound(rows=ROWS):
    """Six turns forward and back at 100 samples a turn, 10 r/min, with encoder noise of 0.006 arcmin."""
    theta = np.r_[np.arange(rows // 2), rows // 2 - 1 - np.arange(rows // 2)] * TURN / 100 + 0.3
    noise = np.random.default_rng(3).normal(0, 1e-4, rows)
    return pd.DataFrame(
        {
            "time_s": np.arange(rows) * 0.06,
            "input_angle_deg": np.degrees(theta),
            "output_angle_deg": np.degrees(theta) / RATIO - ke_arcmin(theta) / 60 + noise,
        }
    )


def changed(column, rows, value):
    """A fault that writes `value`(old) into some rows of a column."""

    def fault(table):
        table.loc[rows, column] = value(table.loc[rows, column])
        return table

    return fault


def with_gap(table):
    return table.drop(index=range(200, 260))


def with_rows_missing(table):
    return table.drop(index=np.random.default_rng(1).choice(np.arange(1, ROWS - 1), 40, replace=False))


def with_rows_repeated(table):
    return pd.concat([table, table[300:320]]).sort_values("time_s", kind="stable")


def wrapped(table):
    return table.assign(input_angle_deg=table.input_angle_deg % 360)


def both_wrapped(table):
    return table.assign(
        input_angle_deg=table.input_angle_deg % 360, output_angle_deg=(table.output_angle_deg + 345) % 360
    )


def jittered(table):
    return table.assign(time_s=table.time_s + np.random.default_rng(0).normal(0, 0.01, ROWS))


def quantised(table):
    return table.assign(output_angle_deg=(table.output_angle_deg / 0.05).round() * 0.05)


@dataclass(frozen=True)
class Fault:
    """A fault, what the tool says of it, and how far (arcmin) the error may then be from the truth; None: refused."""

    apply: object
    says: str
    within: float | None = 0.05
    ratio: float = RATIO


FAULTS = {
    "gap": Fault(with_gap, "1 gap"),
    "missing rows": Fault(with_rows_missing, ""),
    "repeated rows": Fault(with_rows_repeated, "20 repeated rows dropped"),
    "NaN": Fault(changed("output_angle_deg", slice(100, 109), lambda old: old * np.nan), "10 rows with missing values"),
    "mostly NaN": Fault(changed("output_angle_deg", slice(0, 700), lambda old: old * np.nan), "more than half", None),
    "input wrapped": Fault(wrapped, "the input angle was wrapped"),
    "both wrapped": Fault(both_wrapped, "the output angle was wrapped"),
    "input jumps backward": Fault(
        changed("input_angle_deg", [50, 933], lambda old: old - 20), "2 samples far from their neighbours"
    ),
    "output jumps backward": Fault(
        changed("output_angle_deg", [50, 933], lambda old: old - 0.2), "2 samples far from their neighbours"
    ),
    "wrong ratio": Fault(lambda table: table, r"ratio of (79\.9|80)\d*.*ratio given is 100", None, 100.0),
    "ratio off by one": Fault(lambda table: sound(4000), r"ratio of (79\.9|80)\d*.*ratio given is 81", None, 81.0),
    "wrong sign of the output": Fault(
        changed("output_angle_deg", slice(None), lambda old: -old), "sign has been turned around"
    ),
    "wrong sign of the input": Fault(
        changed("input_angle_deg", slice(None), lambda old: -old), "sign has been turned around", None
    ),
    "clock jitter": Fault(jittered, "the clock jitters"),
    "quantised encoder": Fault(quantised, "steps of 3 arcmin", 3.2),
    "short record": Fault(lambda table: table[:120], "input turns; little can be told"),
    "too short a record": Fault(lambda table: table[:30], "at least 50 are needed", None),
}


def write(table, path):
    """`table` in the format that the suffix names."""
    if path.suffix == ".csv":
        table.to_csv(path, index=False)
    elif path.suffix == ".parquet":
        table.to_parquet(path, index=False)
    else:
        from scipy.io import savemat

        savemat(path, {name: table[name].to_numpy() for name in table})
    return path


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mat"])
@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_repaired_or_refused(tmp_path, name, suffix):
    fault = FAULTS[name]
    path = write(fault.apply(sound()), tmp_path / f"bench{suffix}")
    refused = fault.within is None and "sign" not in name
    if refused:
        with pytest.raises(HdoptError, match=fault.says):
            read_recording(path, fault.ratio)
        return
    recording = read_recording(path, fault.ratio)
    if fault.says:
        assert any(fault.says in warning for warning in recording.warnings)
    else:
        assert recording.warnings == ()
    # An input counted backward turns the drive about: the error is that of the other direction.
    truth = ke_arcmin(recording.input_angle) if fault.within else -ke_arcmin(-recording.input_angle)
    off = recording.error_arcmin - truth
    assert np.ptp(off) < (fault.within or 0.05)


@pytest.mark.parametrize(
    "name", [name for name, fault in FAULTS.items() if fault.within is None and "sign" not in name]
)
def test_command_refuses_with_one_sentence(tmp_path, capsys, name):
    path = write(FAULTS[name].apply(sound()), tmp_path / "bench.csv")
    with pytest.raises(SystemExit) as end:
        main(["diagnose", str(path), "--drive", "none", "--ratio", str(FAULTS[name].ratio)])
    assert end.value.code == 2
    said = capsys.readouterr().err.strip().splitlines()
    # An option that the message quotes stands before the file.
    assert len(said) == 1 and re.match(r"hdopt: (--ratio [\d.]+: )?bench\.csv: ", said[0])
