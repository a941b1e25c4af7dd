"""Where a refusal points when --set, not the file, gave what is refused."""

from pathlib import Path

import pytest

from hdopt.errors import HdoptError
from hdopt.study import study_document, study_of, with_values
from hdopt.study.document import parse_document
from hdopt.study.schema import ANY_NAME, known_paths
from hdopt.workflow.search import search

FILE = study_document()
NAMES = {"errors": "axis_tilt_y_deg", "tolerances": "axis_tilt_y_deg"}
KEYS = sorted({path for path in known_paths(FILE[0].data) if ANY_NAME not in path[:-1]})
PATHS = sorted({tuple("own" if part == ANY_NAME else part for part in path) for path in KEYS})


def refusal(values):
    document, name, folder = FILE
    with pytest.raises(HdoptError) as caught:
        study = study_of(with_values(document, values.items()), name, folder)
        assert study.errors and study.drive
    return str(caught.value)


def test_what_no_key_takes_is_refused_at_the_key_that_was_set():
    """Every key of the schema, whether the shipped file writes it, its table or nothing of it."""
    assert len(PATHS) > 300
    for path in PATHS:
        said = refusal({".".join(path): {"nonsense": [{}]}})
        place = f"--set {'.'.join(path)}"
        assert all(line.startswith(place) for line in said.splitlines()), said


def test_what_a_table_that_was_set_replaces_is_not_pointed_to():
    """The file writes std of this tolerance on a line of its own; the one refused is that of --set."""
    table = "tolerances.axis_tilt_y_deg"
    file = parse_document(f'[{table}]\ndistribution = "normal"\nstd = 0.1\n', "mine.toml")
    with pytest.raises(HdoptError, match=rf"^--set {table}\.std: is '0,3';"):
        study_of(with_values(file, [(table, {"distribution": "normal", "std": "0,3"})]), "mine", Path())


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (
            {"required_yield": 0.9},
            "--set linear_stack.required_yield: needs linear_stack.gap_tolerance, linear_stack.dimensions too, which "
            "the study does not give; give them, unless you meant requirement.yield",
        ),
        (
            {"cs_teeth.recentre": False, "cs_teeth.file": "ring.csv"},
            "--set cs_teeth.file with cs_teeth.recentre: needs cs_teeth.deviation too, which the study does not give;",
        ),
        (
            {"cs_teeth.deviation": "single", "cs_teeth.file": "no.csv"},
            "--set cs_teeth.deviation with cs_teeth.file: measured teeth no.csv: cannot be read",
        ),
        ({"tolerances.axis_tilt_y_deg.cost.a": 1}, "--set tolerances.axis_tilt_y_deg.cost.a: does not say its model"),
        (
            {"search.limits.flank_pressure_mpa.upper": 20},
            "--set search.limits.flank_pressure_mpa: unknown key 'upper'; known: max,",
        ),
        (
            {"search.trade.structure_cost_percent.automatik": 1},
            "--set search.trade.structure_cost_percent.automatik: is 'automatik'; it must be 'integral',",
        ),
        ({"tolerances.axis_tilt_y_deg.weight": 1}, "--set tolerances.axis_tilt_y_deg: unknown key 'weight'; known:"),
    ],
)
def test_a_key_that_needs_others_says_so_itself(values, said):
    assert refusal(values).startswith(said)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("search.limits", {"peak_to_peek": 1}, "--set search.limits.peak_to_peek: is 1; give its bound as a table"),
        (
            "search.limits",
            {"flank_pressure_mpa": {"max": 60, "min": 90}},
            "--set search.limits, flank_pressure_mpa: needs exactly one of max, min",
        ),
        (
            "search.limits.flank_pressure_mpa",
            {"max": 60, "min": 90},
            "--set search.limits.flank_pressure_mpa: needs exactly one of max, min",
        ),
        ("search.limits", {"flank_presure_mpa": {"max": 60}}, "--set search.limits: [search] limits: unknown quantity"),
        ("search.objective", "peak_to_peek", "--set search.objective: [search] objective: unknown quantity"),
    ],
)
def test_a_limit_is_refused_at_its_quantity(key, value, said):
    """Faults caught: a key that does not exist proposed as a table; two bounds without the quantity that has them; an
    unknown quantity said to stand in the shipped file."""
    document, name, folder = FILE
    with pytest.raises(HdoptError) as caught:
        search(study_of(with_values(document, [(key, value)]), name, folder))
    assert str(caught.value).startswith(said), str(caught.value)
