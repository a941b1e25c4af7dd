"""Bounds of allocated tolerances that a study does not give: what they are, and that it is said."""

import json

import pytest

from hdopt.allocation.convex import Item
from hdopt.allocation.cost import Reciprocal
from hdopt.cli import main
from hdopt.study import load_study
from hdopt.study.cost_bounds import assumed_lines
from hdopt.study.costs import ReciprocalRow
from hdopt.study.defaults import defaults_taken, used_by
from hdopt.workflow.allocation_bounds import assumed_bounds, at_assumed_bounds, bound_notes
from hdopt.workflow.check_study import check_study

REACH = (0.1, 3.0)


@pytest.mark.parametrize(
    ("given", "bounds"),
    [
        ({}, (0.02, 0.6)),
        ({"tightest": 0.1}, (0.1, 0.6)),
        ({"widest": 0.5}, (0.02, 0.5)),
        ({"tightest": 0.9}, (0.9, 2.7)),
        ({"widest": 0.01}, (0.001, 0.01)),
        ({"tightest": 0.9, "widest": 5.0}, (0.9, 5.0)),
        ({"tightest": 0.0}, (0.0, 0.6)),
    ],
)
def test_what_is_assumed_leaves_room_beside_what_is_given(given, bounds):
    """A tenth and three times a present tolerance of 0.2, or of a bound that is given beyond. Fault caught: bounds that
    cross ("may run from 0.9 to 0.6"), and a 0 that is given taken for none."""
    row = ReciprocalRow(model="reciprocal", b=1.0, **given)
    assert assumed_bounds(row, 0.2, REACH) == pytest.approx(bounds)


def drive_study(tmp_path, **costs):
    """A study of the shipped drive whose tolerances have these `costs`."""
    rows = "\n".join(f"[tolerances.{name}.cost]\n{cost}" for name, cost in costs.items())
    path = tmp_path / "drive.toml"
    path.write_text(f'drive = "csf-25-80"\n[study]\ntitle = "drive"\n{rows}\n', encoding="utf-8")
    return load_study(path)


SMOOTH = 'model = "reciprocal"\nb = 0.01'
LINES = 'model = "piecewise"\npoints = [[0.005, 3.0], [0.02, 1.0]]'


def test_the_default_lines_name_the_costs_without_a_bound(tmp_path):
    """Fault caught: a bound of a tenth or three times the present tolerance that is assumed without a word; and one
    said of a cost whose data end by themselves, or that gives it."""
    study = drive_study(
        tmp_path,
        axis_eccentricity_mm=f"{SMOOTH}\nwidest = 0.02",
        wg_eccentricity_mm=LINES,
        axis_tilt_y_deg=SMOOTH,
    )
    assert assumed_lines(study.sections) == (
        "cost.tightest is not given for axis_eccentricity_mm, axis_tilt_y_deg: 0.1 times the present tolerance",
        "cost.widest is not given for axis_tilt_y_deg: 3 times the present tolerance",
    )


@pytest.mark.parametrize("command", ["check", "run"])
def test_whatever_allocates_says_how_far_tolerances_may_go(command):
    """Before it does, and on the page of a run. Faults caught: said by `hdopt allocate` alone; said of a study that
    has costs and allocates nothing."""
    study = load_study("csf-25-80-tolerances")
    lines = defaults_taken(study.sections, used_by(command, study.sections) or tuple(study.sections), study.document)
    assert set(assumed_lines(study.sections)) <= set(lines)
    assert len(assumed_lines(study.sections)) == 2
    others = [name for name in study.sections if name != "allocate"]
    assert not set(assumed_lines(study.sections)) & set(defaults_taken(study.sections, others, study.document))
    assert set(assumed_lines(study.sections)) <= set(check_study(study).defaults)


def test_tolerances_at_an_assumed_bound_are_named_with_the_key_that_moves_it(tmp_path):
    """Bounds of 0.1 to 3 for each. Fault caught: a bound that is given, or the end of cost data, called assumed; a
    tolerance between its bounds named; the other key named."""
    names = ("axis_eccentricity_mm", "wg_eccentricity_mm", "axis_tilt_y_deg", "axis_tilt_x_deg", "wg_tilt_major_deg")
    costs = dict.fromkeys(names, SMOOTH) | {"wg_eccentricity_mm": LINES, "wg_tilt_major_deg": f"{SMOOTH}\nwidest = 3.0"}
    study = drive_study(tmp_path, **costs)
    items = [Item(name, Reciprocal(0.0, 1.0), 1.0, 0.1, 3.0) for name in names]
    tolerances = dict(zip(names, (2.9999, 3.0, 0.1, 1.0, 3.0), strict=True))
    at = at_assumed_bounds(study, items, tolerances)
    assert at == {"axis_eccentricity_mm": "cost.widest", "axis_tilt_y_deg": "cost.tightest"}
    assert list(bound_notes(at, items)) == [
        "axis_tilt_y_deg (0.1) stands at a bound that is assumed; cost.tightest moves it",
        "axis_eccentricity_mm (3) stands at a bound that is assumed; cost.widest moves it",
    ]


def test_the_command_says_where_a_bound_is_assumed(tmp_path, capsys):
    """A dimension without weight in the gap costs least at a million times its tolerance. Fault caught: that number
    without a word, on the screen or in the JSON."""
    cost = 'cost = { model = "reciprocal", b = 1 }'
    path = tmp_path / "stack.toml"
    path.write_text(
        f'[study]\ntitle = "stack"\n[linear_stack]\ngap_tolerance = 0.1\n[linear_stack.dimensions]\n'
        f"idle = {{ sensitivity = 0, tolerance = 0.01, {cost} }}\nbusy = {{ tolerance = 0.01, {cost} }}\n"
        '[allocate]\nrule = "worst_case"\ncompare = false\nverify_n = 16384\n',
        encoding="utf-8",
    )
    with pytest.raises(SystemExit, match="^0$"):
        main(["allocate", str(path), "--json", str(tmp_path / "stack.json")])
    out = capsys.readouterr().out
    assert "default: cost.widest is not given for idle, busy: 1e+06 times the present tolerance" in out
    assert "note: idle (10000) stands at a bound that is assumed; cost.widest moves it" in out
    found = json.loads((tmp_path / "stack.json").read_text(encoding="utf-8"))
    assert {name: row["at_assumed_bound"] for name, row in found["errors"].items()} == {
        "idle": "cost.widest",
        "busy": None,
    }
    assert any("cost.widest is not given" in line for line in found["defaults"])
