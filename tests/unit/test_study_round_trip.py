"""What hdopt writes it reads: every study, whatever its names and texts, as the same study."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdopt.allocation.results import AllocatedError, AllocateResult
from hdopt.errors import HdoptError
from hdopt.files import to_json, write_text
from hdopt.study import load_study, shipped_studies
from hdopt.study.write import study_toml, with_moved_paths
from hdopt.tolerance.intervals import IntervalEstimate
from hdopt.workflow.allocation_file import read_allocation

TEXT = st.text(st.characters(exclude_categories=("Cs",)), max_size=40)
NUMBER = st.one_of(
    st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False, allow_infinity=False), st.booleans(), TEXT
)
VALUE = st.recursive(
    NUMBER,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(TEXT, inner, max_size=4)),
    max_leaves=12,
)
DATA = st.dictionaries(TEXT, st.one_of(NUMBER, st.dictionaries(TEXT, VALUE, max_size=5)), max_size=5)


@pytest.mark.parametrize("name", shipped_studies())
def test_every_shipped_study_comes_back(name, tmp_path):
    study = load_study(name)
    (tmp_path / "again.toml").write_text(study_toml(study.data), encoding="utf-8")
    again = load_study(tmp_path / "again.toml")
    assert again.data == study.data and again.sha256 == study.sha256


@settings(max_examples=200, deadline=None, derandomize=True)
@given(DATA)
def test_any_names_and_values_come_back(data):
    """Quotes, line breaks, control characters, dots and blanks in keys and texts; integers stay integers."""
    text = study_toml(data, head=("a\nb\x00",), comments={(): ["end\n[drive]"]})
    assert tomllib.loads(text) == data
    assert repr(tomllib.loads(text)) == repr({k: v for k, v in sorted_like(data)})


def sorted_like(data):
    """Keys before tables, as TOML must have them at the top."""
    return [
        *((k, v) for k, v in data.items() if not isinstance(v, dict)),
        *((k, v) for k, v in data.items() if isinstance(v, dict)),
    ]


@settings(max_examples=50, deadline=None, derandomize=True)
@given(TEXT, st.lists(TEXT, max_size=3))
def test_effects_and_comments_cannot_be_mistaken(title, lines):
    data = {"study": {"title": title}, "effects": {"tooth_mesh": {"order": 2, "note": title}}}
    comments = {("effects", "tooth_mesh"): lines, ("study", "title"): lines[:1]}
    assert tomllib.loads(study_toml(data, comments=comments)) == data


@pytest.mark.parametrize("name", ["cam.csv", 'a b\'s "c".csv', "sub/../cam.csv"])
def test_files_are_found_from_where_the_study_went(name, tmp_path):
    old, new = tmp_path / "old", tmp_path / "elsewhere" / "new"
    data = {"wave_generator": {"file": name}, "tolerances": {"x": {"distribution": "measured", "file": name}}}
    for folder in (new, None):
        moved = tomllib.loads(study_toml(with_moved_paths(data, old, folder)))
        for file in (moved["wave_generator"]["file"], moved["tolerances"]["x"]["file"]):
            assert ((folder or Path("/")) / file).resolve() == (old / name).resolve()
    absolute = {"wave_generator": {"file": "/data/cam.csv"}}
    assert with_moved_paths(absolute, old, new) == absolute


OWN = """\
# Drive of the mill.
# Second line.

drive = "csf-25-80"

# measured on 3 May
# at 21 deg
[wave_generator]
width_mm = 8.5 # by caliper
# not sure of this one
structure = "automatic"

[tolerances.axis_eccentricity_mm] # of the lathe
distribution = "rayleigh"
scale = 0.004 # as 2024
upper = 0.01

# the end
"""


def test_comments_stand_where_they_stood():
    """Would catch a comment that is lost, one at another key, and what ships said of a number that the study gave."""
    from hdopt.study.comments import comments_of_text

    found = comments_of_text(OWN)
    assert found.head == ("Drive of the mill.", "Second line.")
    assert found.beside == {
        ("wave_generator", "width_mm"): ("by caliper",),
        ("tolerances", "axis_eccentricity_mm"): ("of the lathe",),
        ("tolerances", "axis_eccentricity_mm", "scale"): ("as 2024",),
    }
    assert found.above == {
        ("wave_generator",): ("measured on 3 May", "at 21 deg"),
        ("wave_generator", "structure"): ("not sure of this one",),
        (): ("the end",),
    }


def test_comments_of_what_ships_go_with_its_numbers(tmp_path):
    from hdopt.study.comments import SET, comments_of

    (tmp_path / "own.toml").write_text(OWN + "[load]\ntorque_nm = 50\n")
    study = load_study(tmp_path / "own.toml", ["semi_minor_mm=30.3", "flexspline_wall_mm=0.7"])
    found = comments_of(study.document)
    assert found.beside["load", "input_speed_rpm"] == ("the speed makers rate at",)
    assert ("load", "torque_nm") not in found.beside, "what ships says of 63 N m does not hold for 50"
    assert found.beside["wave_generator", "semi_minor_mm"] == found.beside["drive", "flexspline_wall_mm"] == (SET,)
    text = study_toml(study.data, found.head, found.beside, found.above)
    assert tomllib.loads(text) == study.data
    for line in (
        "[wave_generator]\n# measured on 3 May\n# at 21 deg\n",
        "width_mm = 8.5 # by caliper",
        "upper = 0.01} # of the lathe; scale: as 2024",
    ):
        assert line in text


@pytest.mark.parametrize("name", shipped_studies())
def test_no_comment_of_a_shipped_study_is_lost(name):
    from hdopt.study.comments import comments_of

    study = load_study(name)
    found = comments_of(study.document)
    text = study_toml(study.data, found.head, found.beside, found.above)
    assert tomllib.loads(text) == study.data
    own = study.document.texts[-1]
    bare = [line.partition("#")[2].strip() for line in own.splitlines() if "#" in line]
    assert [comment for comment in bare if comment not in text] == []


def toleranced(study):
    """Names that have a tolerance, read off the shipped file itself."""
    data = study.data
    rows = {
        **data.get("tolerances", {}),
        **data.get("contributors", {}),
        **data.get("linear_stack", {}).get("dimensions", {}),
    }
    return sorted(name for name in rows if name != "correlation")


TOLERANCED = {name: names for name in shipped_studies() if (names := toleranced(load_study(name)))}
POSITIVE = st.floats(0, exclude_min=True, allow_infinity=False, allow_nan=False)
MAYBE = st.one_of(POSITIVE, st.just(float("nan")), st.none())


def allocated(study, tolerances, cost, grade):
    """What `hdopt allocate` would have found, with costs that are no numbers where a grade is too fine."""
    found = IntervalEstimate(0.999, 0.998, 1.0)
    return AllocateResult(
        study=study,
        rule="rss",
        unit="arcmin",
        limit=1.0,
        required_yield=0.9973,
        status="verified",
        errors={
            name: AllocatedError(value, value, cost or 0.0, float("nan"), "mm", grade)
            for name, value in tolerances.items()
        },
        total_cost=1.0,
        present_cost=float("nan"),
        optimality_gap=None,
        optimality_gap_reason=grade,
        marginal_cost=cost,
        marginal_cost_reason="",
        slack=None,
        verified_yield=found,
        verify_n=1,
        verify_seed=1,
    )


def test_all_studies_with_tolerances_are_asked():
    assert {"csf-25-80", "csf-25-80-tolerances", "chase-shaft-housing", "paper-reproduction"} <= set(TOLERANCED)


@pytest.mark.parametrize("name", TOLERANCED)
def test_an_allocation_of_any_study_comes_back(name, tmp_path_factory):
    """Would catch tolerances rounded on the way, and names that the writer knows and the reader refuses."""
    study, path = load_study(name), tmp_path_factory.mktemp("allocation") / "a.json"
    some = st.dictionaries(st.sampled_from(TOLERANCED[name]), POSITIVE, min_size=1)

    @settings(max_examples=20, deadline=None, derandomize=True)
    @given(some, TEXT, MAYBE, TEXT)
    def check(tolerances, title, cost, grade):
        called = replace(study, name=title)
        write_text(path, to_json(allocated(title, tolerances, cost, grade).to_dict()))
        assert read_allocation(path, called) == tolerances
        with pytest.raises(HdoptError, match="is of the study"):
            read_allocation(path, replace(study, name=title + "'"))

    check()


def test_what_is_no_tolerance_of_a_study_is_refused(tmp_path):
    """Would catch an allocation that tolerances the study's correlations."""
    study = load_study("csf-25-80")
    rows = {**study.data["tolerances"], "correlation": [{"errors": ["axis_tilt_y_deg", "axis_tilt_x_deg"]}]}
    correlated = replace(study, data={**study.data, "tolerances": rows})
    write_text(tmp_path / "a.json", to_json(allocated(study.name, {"correlation": 0.01}, 1.0, "").to_dict()))
    with pytest.raises(HdoptError, match="unknown tolerance 'correlation'"):
        read_allocation(tmp_path / "a.json", correlated)


@pytest.mark.parametrize(
    ("row", "line"), [('"wg_eccentricity_mm": {"tolerance": 0}', 5), ('"gap": {"tolerance": 1}', 5)]
)
def test_an_allocation_is_refused_with_its_line(tmp_path, row, line):
    """Fault caught: the line of another place where the name stands, here among the shares before."""
    lines = [
        '{"shares": {"wg_eccentricity_mm": 1, "gap": 2},',
        '"errors": {',
        '"axis_eccentricity_mm": {',
        '"tolerance": 1},',
    ]
    write_text(tmp_path / "a.json", "\n".join([*lines, row + "}}"]))
    with pytest.raises(HdoptError, match=rf"a\.json, line {line}: "):
        read_allocation(tmp_path / "a.json", load_study("csf-25-80"))
