"""What an acceptance sheet says of figures that were not measured: nothing, in every form, and no limit is met."""

import json

import numpy as np
import pandas as pd
import pytest

from hdopt.cli import main
from hdopt.recordings.decision import LIMIT_NAMES
from hdopt.recordings.read import recording_from_table
from hdopt.report.html import render
from hdopt.report.sections.inspection import batch_report, inspection_report
from hdopt.workflow.inspect import inspect
from hdopt.workflow.inspect_many import inspect_many

RATIO = 80.0
LIMITS = dict.fromkeys(LIMIT_NAMES, 1.0)
OF_TURNS = [name for name in LIMIT_NAMES if name != "hysteresis_loss"]
NULL = [
    "rms_arcmin", "return_error_arcmin", "repeatability_arcmin", "steepest_slope_arcmin_per_deg",
    "steepest_slope_arcsec_per_s", "drift_arcmin", "uncertainty_arcmin", "gauge_arcmin",
]  # fmt: skip
SWEEP = np.concatenate([np.linspace(a, b, 300) for a, b in ((-20, 20), (20, -20))])
LOOP = np.repeat([1.0, -1.0], 300)


def swept(seed, size=100.0, tremble_deg=0.0):
    """A torque sweep whose error spans `size` arcmin; the input's count stands, or trembles by so much, or is missing
    (None)."""
    rng = np.random.default_rng(seed)
    error = size * SWEEP / 40 + rng.normal(0, size / 1000, len(SWEEP))
    table = pd.DataFrame({"torque": SWEEP, "error": error})
    columns = "torque=torque:Nm,error=error:arcmin"
    if tremble_deg is not None:
        table["input"] = 30 + tremble_deg * rng.random(len(SWEEP))
        columns += ",input=input:deg"
    return recording_from_table(table, RATIO, columns, f"sweep {seed}")


def turned(seed, turns=3.0, size=1.0):
    """An error of `size` arcmin over so many turns of the input."""
    angle = np.linspace(0, 360 * turns, 600)
    error = size * np.sin(2 * np.radians(angle)) + np.random.default_rng(seed).normal(0, 0.01, len(angle))
    return recording_from_table(
        pd.DataFrame({"input": angle, "error": error}), RATIO, "input=input:deg,error=error:arcmin", f"turned {seed}"
    )


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("tremble_deg", [None, 0.0, 5.0])
def test_what_needs_a_moving_input_is_not_measured(seed, tremble_deg):
    """Would catch a figure that is 0 for want of a recording, whatever its limit: rms and slope of any sweep were 0 and
    met 1 arcmin."""
    found = inspect(swept(seed, 10.0**seed, tremble_deg), None, LIMITS)
    content = found.to_dict()
    assert content["peak_to_peak_arcmin"] == {
        "one_turn": None,
        "recording": None,
        "beat": None,
        "makers_figure": "beat",
    }
    assert {key: content[key] for key in NULL} == dict.fromkeys(NULL)
    verdicts = {one.name: (one.value, one.verdict, one.note) for one in found.limits}
    assert all(verdicts[name] == (None, "not decidable", "the input is locked") for name in OF_TURNS)
    assert verdicts["hysteresis_loss"][0] is not None and not content["orders"]
    figures = found.to_frame().set_index("figure")["value"]
    assert figures.isna().all()


@pytest.mark.parametrize("seed", range(3))
def test_a_locked_recording_leaves_the_figures_of_those_that_turn_alone(seed):
    """Would catch a sweep that enters a mean, a largest value or a mounting's scatter as 0."""
    runs = [turned(10 * seed + k, size=1 + seed) for k in range(3)]
    alone = inspect(runs, None, LIMITS, mountings=["a", "a", "b"])
    beside = inspect([swept(seed), *runs], None, LIMITS, mountings=["a", "a", "a", "b"])
    both = [found.to_dict() for found in (alone, beside)]
    for key in ("peak_to_peak_arcmin", *NULL):
        assert both[0][key] == both[1][key]
    assert alone.gauge is not None and alone.drift is not None
    assert [d for d in alone.limits if d.name != "hysteresis_loss"] == [
        d for d in beside.limits if d.name != "hysteresis_loss"
    ]


@pytest.mark.parametrize("deg", [7.5, 7.9])
def test_less_than_five_cells_have_no_slope(deg):
    """Cells are 2 deg wide. Would catch a slope of 0, and a limit that it meets, of an input that turned less than a
    slope is taken over."""
    found = inspect(turned(1, deg / 360), None, {"slope": 1.0, "one_turn": 1.0, "recording": 1.0})
    slope, one_turn, recording = found.limits
    assert (slope.value, slope.verdict) == (None, "not decidable") and "10 deg" in slope.note
    assert (one_turn.value, one_turn.verdict) == (None, "not decidable") and "no whole input turn" in one_turn.note
    assert recording.met is True and found.slope_arcsec_per_s is None


def test_a_loss_is_known_to_its_readings_scatter():
    """Would catch a guard band of 0: the loss of a noisy loop varies from sweep to sweep by what is stated."""
    found = [inspect(swept(seed), None, {"hysteresis_loss": 1.0}) for seed in range(40)]
    seen = [one.torsion.hysteresis_loss_arcmin for one in found]
    # A width has no sign: of a loop of none its rms is what a width's standard deviation is. 40 of it: +-11 %, twice.
    assert np.sqrt(np.mean(np.square(seen))) == pytest.approx(found[0].limits[0].uncertainty, rel=0.3)


def status(*words):
    """The exit status of the command."""
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    return ended.value.code or 0


def test_the_command_says_so_in_every_form(tmp_path, capsys):
    """Would catch '0 arcmin' in the text, the page or a batch, and an exit status that passes or fails such a limit."""
    for k in range(2):
        table = pd.DataFrame({"t": np.arange(len(SWEEP)) * 0.01, "error": SWEEP * 10 + k + 3 * LOOP, "torque": SWEEP})
        table.to_csv(tmp_path / f"{k}.csv", index=False)
    names = [str(tmp_path / f"{k}.csv") for k in range(2)]
    common = ["--drive", "none", "--ratio", "80", "--columns", "time=t:s,error=error:arcmin,torque=torque:Nm"]
    assert status("inspect", names[0], *common, "--limit", "rms=1arcmin,slope=1arcmin/deg", "--check") == 0
    said = capsys.readouterr().out
    assert "none, the input is locked" in said and " 0 arcmin" not in said and "drift over the recording" not in said
    assert "rms: not decidable, the input is locked" in said and "slope: not decidable, the input is locked" in said
    each = [*common, "--each", "--limit", "peak_to_peak=1arcmin", "--check"]
    assert status("inspect", *names, *each) == 0
    said = capsys.readouterr().out
    assert said.count("none, the input is locked (not decidable)") == 2
    assert status("inspect", *names, *each, "--json", "-") == 0
    drives = json.loads(capsys.readouterr().out)["drives"]
    assert [(d["peak_to_peak"], d["one_turn"], d["rms"]) for d in drives] == [(None, None, None)] * 2


def test_pages_show_no_figure_that_was_not_measured():
    """Would catch '0.000 arcmin' on the sheet's page, and a batch's plot or outliers that count a drive without one."""
    page = render(inspection_report(inspect(swept(1), None, LIMITS)))
    assert "0.000 arcmin" not in page and "none, the input is locked" in page
    values = [1.0, 1.1, 0.9, 1.05, 0.95]
    batch = inspect_many([swept(1), *(turned(k, size=v) for k, v in enumerate(values)), turned(9, size=30.0)])
    assert [drive.name for drive in batch.drives if drive.outlier] == ["turned 9"]
    assert batch.drives[0].peak_to_peak is None and "turned 9" in render(batch_report(batch))
