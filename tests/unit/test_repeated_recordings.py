"""A recording given twice counts once: refused where it is taken together with itself, no second drive in a batch."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from hdopt.cli import main
from hdopt.errors import HdoptError
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.repeats import refuse_repeats
from hdopt.workflow.compensate import compensate
from hdopt.workflow.diagnose import diagnose
from hdopt.workflow.inspect import inspect
from hdopt.workflow.inspect_many import inspect_many

RATIO = 80.0


def frame(seed, rows=900, noise=0.01, speed=1.0, size=0.3):
    angle = np.linspace(0, 360 * 30, rows)
    error = size * np.sin(2 * np.radians(angle)) + np.random.default_rng(seed).normal(0, noise, rows)
    return pd.DataFrame(
        {
            "time_s": np.arange(rows) * 0.01 / speed,
            "input_angle_deg": angle,
            "output_angle_deg": angle / RATIO - error / 60,
        }
    )


def recorded(table, name="run"):
    return recording_from_table(table, RATIO, name=name)


COPIES = {
    "itself": lambda table: table,
    "another zero of the clock": lambda table: table.assign(time_s=table["time_s"] + 1234.5),
    "no clock": lambda table: table.drop(columns="time_s"),
    "its first half": lambda table: table[:450],
    "its middle": lambda table: table[200:700],
}


@pytest.mark.parametrize("copy", COPIES.values(), ids=COPIES)
@pytest.mark.parametrize("seed", range(2))
def test_the_same_rows_are_refused_whatever_their_name(copy, seed):
    """Would catch a copy that passes under another name, from another zero of the clock, without one, or cut short;
    either may come first, beside others."""
    other, whole = recorded(frame(100 + seed), "other"), frame(seed)
    pair = [recorded(whole, "a"), recorded(copy(whole), "b")]
    for given in (pair, pair[::-1]):
        with pytest.raises(HdoptError, match=r"[ab] and [ab] \(recordings 2 and 3\).*leave one of them out"):
            refuse_repeats([other, *given])


DIFFERENT = {
    "other noise": lambda table: frame(7),
    "one sample": lambda table: table.assign(output_angle_deg=table["output_angle_deg"] + 1e-5 * (table.index == 800)),
    "another speed": lambda table: table.assign(time_s=table["time_s"] * 2),
    "a part of another": lambda table: frame(7)[:450],
}


@pytest.mark.parametrize("change", DIFFERENT.values(), ids=DIFFERENT)
def test_what_differs_is_another_recording(change):
    """Would catch a refusal of what only looks alike: the same motion with its own noise, or equal angles (without any
    noise, as computed ones are) at another speed."""
    refuse_repeats([recorded(frame(1)), recorded(change(frame(1)))])
    still = [recorded(frame(1, noise=0.0)), recorded(frame(1, noise=0.0, speed=2.0))]
    refuse_repeats(still)
    sweep = recorded(frame(1))
    warm = [replace(sweep, temperature=np.full(len(sweep), one)) for one in (20.0, 40.0)]
    refuse_repeats(warm)


@pytest.mark.parametrize("call", [inspect, compensate, diagnose])
def test_calls_refuse_them(call):
    """Would catch a command that takes recordings together without asking: repeatability 0 was met by one recording."""
    run = recorded(frame(1))
    with pytest.raises(HdoptError, match=r"run and run \(recordings 1 and 2\) hold the same rows"):
        call([run, run], None)


@pytest.mark.parametrize("command", ["inspect", "compensate", "diagnose"])
def test_commands_refuse_copies_under_other_names(command, tmp_path, capsys):
    """Would catch a message that does not say which two, or another exit status than that of unusable input."""
    for name in ("a.csv", "b.csv"):
        frame(1).to_csv(tmp_path / name, index=False)
    names = [str(tmp_path / name) for name in ("a.csv", "b.csv")]
    more = ["-o", str(tmp_path / "t.csv")] if command == "compensate" else []
    with pytest.raises(SystemExit) as ended:
        main([command, *names, "--drive", "none", "--ratio", "80", *more])
    said = capsys.readouterr().err
    assert ended.value.code == 2 and not (tmp_path / "t.csv").exists()
    assert "a.csv and b.csv (recordings 1 and 2) hold the same rows" in said and "leave one of them out" in said


def test_in_a_batch_a_recording_counts_for_one_drive():
    """Would catch a copy that enters Ppk as a drive of its own; two files that cannot be read are not each other's."""
    runs = [recorded(frame(k, size=0.3 + 0.01 * k), f"drive {k}") for k in range(8)]
    copy, bad = replace(runs[2], name="copy"), "no such file.csv"
    plain, batch = (inspect_many(some, None, {"peak_to_peak": 2.0}) for some in (runs, [*runs, copy, bad, bad]))
    assert batch.drives[8].peak_to_peak is None and "the same rows as drive 2" in batch.drives[8].error
    assert all(drive.error and "same rows" not in drive.error for drive in batch.drives[9:])
    assert batch.performance == plain.performance and batch.performance.n == 8
