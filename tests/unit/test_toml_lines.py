"""On which lines keys of a TOML file stand: of any depth and length, in a study, an allocation and a bench."""

import pytest

from hdopt.errors import HdoptError
from hdopt.recordings.bench import load_bench
from hdopt.study.document import parse_document
from hdopt.toml_lines import closest_line, first_too_deep, key_lines

DEPTHS = (13, 499, 500, 501, 3000)
"""With a letter and a point a level, lines of 1000 letters, the longest head that is searched, end at 500."""
FORMS = {
    "dotted": lambda keys: f"\n\n{keys} = 1\n",
    "in a table": lambda keys: f"\n[ratio]\n{keys} = 1\n",
    "a table": lambda keys: f"\n\n[{keys}]\nb = 1\n",
    "an array of tables": lambda keys: f"\n\n[[{keys}]]\n",
    "quoted": lambda keys: f"\n\n\"ratio\".'a b'.{keys} = 1\n",
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("root", ["ratio", "columns"])
def test_keys_of_any_depth_are_refused_with_file_and_line(form, depth, root, tmp_path):
    """Would catch keys that do not end within the head of their line, or whose upper levels have no line of their own;
    and a value that is shown level by level, which goes deeper than Python does."""
    file = tmp_path / "any.toml"
    file.write_text(FORMS[form](".".join([root] + ["a"] * (depth - 1))))
    with pytest.raises(HdoptError, match=r"^any.toml, line 3: .* is nested more than 12 levels deep$"):
        load_bench(file)
    with pytest.raises(HdoptError, match=r"^any.toml, line 3, .*: is nested 13 levels deep; a study has 12 levels"):
        parse_document(file.read_text(), "any.toml")


def test_a_long_name_is_refused_with_its_line():
    with pytest.raises(HdoptError, match=r"^any.toml, line 4: has a name of 5000 letters; at most 200 are allowed$"):
        parse_document("a = 1\n[b]\nc = 1\n" + "x" * 5000 + " = 1\n", "any.toml")


def test_a_tables_own_line_goes_before_that_of_a_key_within():
    lines = key_lines("[a.b]\nc = 1\n\n[a]\nd.e = 1\nd.f = 2\n")
    assert {key: line for key, line in lines.items() if key[:1] == ("a",)} == {
        ("a",): 4,
        ("a", "b"): 1,
        ("a", "b", "c"): 2,
        ("a", "d"): 5,
        ("a", "d", "e"): 5,
        ("a", "d", "f"): 6,
    }
    assert closest_line(lines, ("a", "d", "g", "h")) == 5
    assert closest_line(lines, ("z",)) == 1


def test_what_lies_within_the_levels_is_not_too_deep():
    assert first_too_deep({"a": {"b": [1, [2]]}, "c": 3}, 4) is None
    assert first_too_deep({"a": {"b": [1, [2]]}, "c": 3}, 3) == ("a", "b", "1", "0")
