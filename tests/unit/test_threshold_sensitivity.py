"""The study of thresholds: kept evidence answers as a new diagnosis would, work goes on where it stopped."""

from __future__ import annotations

from pathlib import Path

import pytest

from hdopt.diagnosis.settings import DEFAULT, moved, thresholds
from hdopt.studies import threshold_sensitivity as study
from hdopt.studies.threshold_sensitivity import Answers, Case, Move, page, row_of, work

NAMED = ("named", ("hysteresis",))
CASES = (Case("one", None, (NAMED,)), Case("two", None, (NAMED,)))


@pytest.mark.slow
def test_kept_evidence_is_judged_by_the_settings_of_the_move():
    """Would catch evidence that brings its own settings along, so that no move of the verdict's thresholds shows."""
    case = next(case for case in study.cases(nothing=0) if case.name == "encoder_input_eccentricity")
    diagnosis = study.diagnosed(case, DEFAULT)
    named = ("named", (case.name,))
    assert study.answer_of(diagnosis) == named
    evidence = study.kept(diagnosis)
    assert study.redrawn(evidence, DEFAULT) == study.answer_of(diagnosis)
    strict = moved(DEFAULT, "verdict.significance", 1e-9)
    assert study.redrawn(evidence, strict) == study.answer_of(study.diagnosed(case, strict)) != named


@pytest.fixture
def counted(monkeypatch, tmp_path):
    """Answers that cost nothing: moving the group `steps`, or its first member, changes that of case two."""
    first = next(one for one in thresholds() if one.group == "steps")
    given = []

    def diagnosed(case, settings):
        given.append(case.name)
        away = getattr(settings.steps, first.name) != first.value
        return ("unknown", ()) if away and case.name == "two" else NAMED

    monkeypatch.setattr(study, "diagnosed", diagnosed)
    monkeypatch.setattr(study, "answer_of", lambda diagnosis: diagnosis)
    monkeypatch.setattr(study, "kept", lambda diagnosis: b"")
    monkeypatch.setattr(study, "redrawn", lambda evidence, settings: NAMED)
    return Answers(tmp_path), given, first


def test_what_was_answered_is_not_asked_again(counted, tmp_path):
    answers, given, _ = counted
    for case, move in work(answers, CASES):
        answers.answered(case, move)
    before = len(given)
    for case, move in work(Answers(tmp_path), CASES):
        Answers(tmp_path).answered(case, move)
    assert len(given) == before


def test_only_a_group_that_matters_is_moved_singly_and_only_where_it_does(counted):
    answers, _, first = counted
    for case, move in work(answers, CASES):
        answers.answered(case, move)
    assert answers.get(CASES[1], Move(first.key, 0.7)) == ("unknown", ())
    assert answers.get(CASES[0], Move(first.key, 0.7)) is None
    other = next(one for one in thresholds() if one.group == "wander")
    assert answers.get(CASES[1], Move(other.key, 0.7)) is None


def test_the_page_tells_every_threshold_and_what_was_not_tried(counted):
    answers, _, first = counted
    assert "have not been tried" in page(answers, CASES)
    for case in CASES:
        answers.answered(case)
    assert "2 of the 2" in page(answers, CASES)
    assert page(answers, CASES).count("not tried | not tried |") >= 100
    for case, move in work(answers, CASES):
        answers.answered(case, move)
    text = page(answers, CASES)
    for one in thresholds():
        assert f"| `{one.name}` |" in text
    assert "not tried" not in text
    row = next(line for line in text.splitlines() if f"`{first.name}`" in line and first.origin in line)
    assert row.count("1 (two: unknown)") == 2


def test_the_page_of_the_documentation_holds_todays_settings():
    """Would catch a threshold added, moved or explained anew without its row: `--minutes 0 --write` renews them."""
    written = (Path(__file__).resolve().parents[2] / "docs" / "diagnosis-thresholds.md").read_text(encoding="utf-8")
    rows = [line for line in written.splitlines() if line.startswith("| `")]
    assert [row.split(" | ")[:4] for row in rows] == [["| " + row_of(one)[0], *row_of(one)[1:]] for one in thresholds()]
