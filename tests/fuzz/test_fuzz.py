"""A few hundred inputs of each kind at every check; `make fuzz` goes on for as long as it is let."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fuzz import soak
from tests.fuzz.rule import KINDS

EXAMPLES = {"studies": 60, "numbers": 30, "recordings": 100, "cams": 40, "allocations": 200, "options": 60}
MANY = 500


def check(kind, folder, examples):
    strategy, rule = KINDS[kind]

    @settings(
        max_examples=examples, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
    )
    @given(strategy)
    def one(content):
        rule(content, folder)

    one()


@pytest.mark.parametrize("kind", KINDS)
def test_some_of_each_kind(kind, tmp_path):
    check(kind, tmp_path, EXAMPLES[kind])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_many_of_each_kind(kind, tmp_path):
    check(kind, tmp_path, MANY)


def test_a_soak_goes_on_and_its_page_says_what_was_done(tmp_path, monkeypatch):
    """Would catch rounds done twice, a failure that is not counted, a kind that waits for a dearer one, and a page that
    is written beside its marks."""
    tried = []

    def rule(content, folder):
        tried.append(content)
        assert content != 7

    monkeypatch.setattr(soak, "KINDS", {"any": (st.integers(0, 9), rule), "dear": (st.integers(0, 9), rule)})
    monkeypatch.setattr(soak, "ROUND", 5)
    state = soak.opened(tmp_path, 1)
    state["kinds"]["dear"]["seconds"] = 1e9
    soak.soak(state, tmp_path, 60, 1e9)
    first, kept = len(tried), soak.opened(tmp_path, 1)
    assert kept == state and sum(done["inputs"] for done in kept["kinds"].values()) == first >= 120
    failed = {file.name for file in (tmp_path / "failures").iterdir()}
    assert 0 < sum(done["failures"] for done in kept["kinds"].values()) == len(failed)
    soak.soak(kept, tmp_path, 60, 1e9)
    assert len(tried) == first
    assert soak.next_kind({"a": {"inputs": 0, "seconds": 2}, "b": {"inputs": 9, "seconds": 1}}, 10) == "b"
    page = soak.renewed(f"before\n{soak.START}\nold\n{soak.END}\nafter", kept)
    assert page.startswith("before") and page.endswith("after") and "old" not in page
    assert f"| any | {kept['kinds']['any']['inputs']} | {kept['kinds']['any']['failures']} |" in page


def test_a_soak_ends_where_it_is_interrupted(tmp_path, monkeypatch):
    """Would catch an interruption that comes while a command runs, which ends the command with 130, counted as a
    failure of the command while the soak goes on."""

    def interrupted(arguments):
        raise SystemExit(130)

    monkeypatch.setattr("tests.fuzz.rule.main", interrupted)
    state = soak.opened(tmp_path, 1)
    with pytest.raises(KeyboardInterrupt):
        soak.soak(state, tmp_path, 100, 1e9)
    assert all(done["failures"] == 0 for done in state["kinds"].values())
    assert not list((tmp_path / "failures").iterdir())
