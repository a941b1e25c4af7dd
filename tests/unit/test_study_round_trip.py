"""What hdopt writes it reads: every study, whatever its names and texts, as the same study."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdopt.study import load_study, shipped_studies
from hdopt.study.write import study_toml, with_moved_paths

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
