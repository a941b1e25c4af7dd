"""Every threshold of the diagnosis stands in its settings, with a unit and an origin, and is used."""

import ast
import re
from pathlib import Path

import pytest

from hdopt.diagnosis.settings import DEFAULT, moved, thresholds

FOLDER = Path(__file__).resolve().parents[2] / "hdopt" / "diagnosis"
FILES = [file for file in sorted(FOLDER.rglob("*.py")) if file.name != "settings.py"]

PLAIN = {0, 1, 2}
"""Zero, one and two: signs, halves, squares, the ends of a share."""
OTHER_NUMBERS = {8: "size of a cache", 100: "per cent"}
MOST_NAMED = 27
"""Named numbers at the top of modules: guards against rounding, digits that are shown, constants of statistics."""


def top_level_names(tree):
    return [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign)]


def numbers(node):
    return [n for n in ast.walk(node) if isinstance(n, ast.Constant) and type(n.value) in (int, float)]


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(FOLDER)))
def test_no_number_decides_outside_the_settings(file):
    """Would catch `if t > 4.0` as well as `4.0 * rms` or an argument `0.3`."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    named = {id(number) for node in top_level_names(tree) for number in numbers(node)}
    loose = [
        (n.lineno, n.value)
        for n in numbers(tree)
        if id(n) not in named and abs(n.value) not in PLAIN and n.value not in OTHER_NUMBERS
    ]
    assert loose == []


def test_few_numbers_are_named_outside_the_settings():
    """Would catch a threshold that comes back as a constant of a module."""
    named = [
        f"{file.name}: {ast.unparse(node)}"
        for file in FILES
        for node in top_level_names(ast.parse(file.read_text(encoding="utf-8")))
        if node.value is not None and any(abs(n.value) not in PLAIN for n in numbers(node.value))
    ]
    assert len(named) <= MOST_NAMED, named


@pytest.mark.parametrize("one", list(thresholds()), ids=lambda one: one.key)
def test_every_threshold_has_a_unit_and_an_origin(one):
    assert one.unit
    assert re.match(r"(theorem|paper|catalogue|measured|choice): \S", one.origin), one.origin


def test_every_threshold_is_used():
    code = "\n".join(file.read_text(encoding="utf-8") for file in FILES)
    unused = [one.key for one in thresholds() if not re.search(rf"\.{one.name}\b", code)]
    assert unused == []


def test_one_threshold_moves_and_no_other():
    changed = moved(DEFAULT, "verdict.tie", 1.3)
    different = [a.key for a, b in zip(thresholds(DEFAULT), thresholds(changed), strict=True) if a != b]
    assert different == ["verdict.tie"]
    assert changed.verdict.tie == pytest.approx(1.3 * DEFAULT.verdict.tie)


def test_a_group_moves_together_and_whole_numbers_stay_whole():
    down = moved(DEFAULT, "search", 0.7).search
    assert down.leaders == 2
    assert down.rounds == 1
    assert type(down.leaders) is int
    assert down.close == pytest.approx(0.7 * DEFAULT.search.close)
    assert moved(DEFAULT, "search", 1.1).search.rounds == DEFAULT.search.rounds + 1
    assert moved(DEFAULT, "steps", 0.7).verdict == DEFAULT.verdict
