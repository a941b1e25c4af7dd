"""A gear given with `--drive none` has no splines and no wave generator: no answer speaks of them as its parts."""

import json
import re
from html import unescape

import numpy as np
import pandas as pd
import pytest

from hdopt.cli import main
from hdopt.recordings.read import recording_from_table
from hdopt.report.html import render
from hdopt.report.sections.inspection import inspection_report
from hdopt.study import load_study
from hdopt.workflow.inspect import inspect

RATIO = 80.0
PARTS = re.compile(
    r"wave.generator|flexspline|circular.spline|splines?\b|\bFS\b|\bCS\b|\bE1\b|\bE2\b|driving zone|lobe", re.I
)


@pytest.fixture(scope="module")
def table():
    """A gear's error over two turns of its output, there and back."""
    one = np.arange(160 * 40) * 2 * np.pi / 40
    theta = np.r_[one, one[::-1]]
    error = 0.3 * np.sin(2 * theta) + 0.2 * np.cos(theta / RATIO) + 0.1 * np.repeat([1, -1], len(one))
    error += np.random.default_rng(1).normal(0, 0.01, len(theta))
    return pd.DataFrame(
        {
            "time_s": np.arange(len(theta)) * 0.01,
            "input_angle_deg": np.degrees(theta),
            "output_angle_deg": np.degrees(theta) / RATIO - error / 60,
        }
    )


def page_of(table, drive):
    """Words of the sheet's page: what stands between tags and in labels, without the scripts."""
    found = inspect(recording_from_table(table, RATIO), drive)
    page = re.sub(r"<(script|style)\b.*?</\1>", " ", render(inspection_report(found)), flags=re.S)
    return unescape(page), found


def test_orders_and_page_speak_of_no_parts_that_it_does_not_have(table):
    """Would catch 'FS teeth against E1' as the origin of once an output turn, and a caption that looks for a flexspline
    in a planetary gear; and a harmonic drive that loses its own words."""
    page, found = page_of(table, None)
    assert not PARTS.search(page), PARTS.search(page)
    origins = {line.symbol: line.origin for line in found.orders}
    assert origins["1/N"] == "once an output turn" and len(origins) == 9
    own, sheet = page_of(table, load_study(drive="csf-25-80").drive)
    assert "the flexspline's" in own and any("FS teeth" in line.origin for line in sheet.orders)


@pytest.mark.parametrize("command", ["inspect", "compensate"])
def test_commands_speak_of_no_parts_that_it_does_not_have(table, command, tmp_path, capsys):
    """Would catch such a word in the text, the JSON or the written file."""
    table.to_csv(tmp_path / "run.csv", index=False)
    more = ["-o", str(tmp_path / "t.c")] if command == "compensate" else []
    call = [command, str(tmp_path / "run.csv"), "--drive", "none", "--ratio", "80", *more]
    for extra in ([], ["--json", str(tmp_path / "answer.json")]):
        with pytest.raises(SystemExit) as ended:
            main([*call, *extra])
        assert not ended.value.code
    said = capsys.readouterr().out + json.dumps(json.loads((tmp_path / "answer.json").read_text())["warnings"])
    said += (tmp_path / "answer.json").read_text()
    if more:
        said += (tmp_path / "t.c").read_text()
        assert "the gear was taken apart" in said
    assert not PARTS.search(said), PARTS.search(said)


def test_a_ratio_off_by_one_does_not_make_a_gear_a_strain_wave_one(table):
    """Would catch a refusal that tells the owner of any gear that its circular spline is the output."""
    with pytest.raises(
        Exception, match="of a strain wave gear the circular spline is the output here, or the nameplate"
    ):
        recording_from_table(table, RATIO - 1)
    with pytest.raises(Exception, match="of a strain wave gear the ratio given is that of the circular spline"):
        recording_from_table(table, RATIO + 1)
