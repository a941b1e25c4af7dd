"""The study `real-residuals`: a small part of it on the real recordings, and how a case is judged."""

from types import SimpleNamespace

import pandas as pd
import pytest

import hdopt.bench.real_residuals as bench
from hdopt.bench.motion import draw_plans
from hdopt.errors import HdoptError
from hdopt.studies.real_residuals import judged, recordings_folder, residuals_section
from hdopt.study import load_study
from hdopt.workflow.steps import Context, find_step


@pytest.mark.slow
@pytest.mark.recordings
def test_known_physics_in_real_noise(recordings, tmp_path, monkeypatch):
    monkeypatch.setenv("HDOPT_RECORDINGS", str(recordings))
    # Forty samples a turn in place of hundreds: what is asked of the study does not hang on them.
    monkeypatch.setattr(bench, "draw_plans", lambda rng, needs, _: draw_plans(rng, needs, "brief"))
    size = (
        "residuals.nothing=1",
        "residuals.severities=[1.0]",
        'residuals.effects=["lost_motion"]',
    )
    result = find_step("real_residuals")(load_study("real-residuals", size), Context(tmp_path))
    cases = result.results["cases"]
    assert len(cases) == 3 * (1 + 1)
    assert not [case for case in cases if case["wrong"]]
    assert all(case["among"] for case in cases if case["hidden"] != "nothing")


def diagnosis(verdict, effects=(), ambiguous_with=()):
    return SimpleNamespace(
        verdict=verdict, effects=[SimpleNamespace(id=name) for name in effects], ambiguous_with=ambiguous_with
    )


@pytest.mark.parametrize(
    ("hidden", "answer", "exact", "among", "unknown", "wrong"),
    [
        ("", diagnosis("adequate"), True, True, False, False),
        ("", diagnosis("unknown"), False, False, True, False),
        ("", diagnosis("named", ["hysteresis"]), False, False, False, True),
        ("hysteresis", diagnosis("named", ["hysteresis"]), True, True, False, False),
        ("hysteresis", diagnosis("ambiguous", ["lost_motion"], (("hysteresis",),)), False, True, False, False),
        ("hysteresis", diagnosis("named", ["hysteresis", "lost_motion"]), False, False, False, True),
        ("hysteresis", diagnosis("unknown", ["hysteresis"]), False, True, True, False),
        ("hysteresis", diagnosis("unknown"), False, False, True, False),
        ("hysteresis", diagnosis("unknown", ["lost_motion"]), False, False, True, True),
        ("hysteresis", diagnosis("adequate"), False, False, False, False),
    ],
)
def test_how_a_case_is_judged(hidden, answer, exact, among, unknown, wrong):
    case = judged("noise", hidden, 0.5, answer)
    assert (case["exact"], case["among"], case["unknown"], case["wrong"]) == (exact, among, unknown, wrong)


@pytest.mark.parametrize("given", [None, "", "empty"])
def test_without_recordings_it_says_where_they_should_be(given, tmp_path, monkeypatch):
    """Would catch a folder that is taken because it exists, whatever is in it."""
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("HDOPT_RECORDINGS", raising=False)
    if given is not None:
        monkeypatch.setenv("HDOPT_RECORDINGS", given)
    with pytest.raises(HdoptError, match="set HDOPT_RECORDINGS to their folder"):
        recordings_folder()


def test_its_page_says_what_came_out_and_names_effects_in_words():
    answers = [
        judged("trails", "", 0.0, diagnosis("adequate")),
        judged("trails", "", 0.0, diagnosis("named", ["hysteresis"])),
        judged("trails", "cs_tooth_harmonics", 0.5, diagnosis("named", ["cs_tooth_harmonics"])),
        judged("trails", "hysteresis", 0.5, diagnosis("unknown", ["torsional_windup"])),
    ]
    summary = pd.DataFrame({"noise": ["trails"], "severity": [0.0], "cases": [4], "among": [1], "wrong": [2]})
    points, counts, missed = residuals_section(pd.DataFrame(answers), summary).items
    assert points.sentences == (
        "With nothing put there, a name was given in 1 of 2 records, and 0 were called unknown.",
        "With physics put there, 1 of 2 were named exactly, 1 were among the explanations offered, and 1 got a wrong "
        "name.",
    )
    assert missed.frame["said"].tolist() == ["Hysteresis", "Torsional windup"]
    assert missed.frame["hidden"].tolist() == ["nothing", "Hysteresis"]
    assert missed.frame["came out as"].tolist() == ["a wrong name", "a wrong name"]
    assert missed.frame["severity"].isna().tolist() == [True, False]
    assert list(counts.frame) == ["in the noise of", "severity", "cases", "among the offered", "wrong name"]


@pytest.mark.parametrize(
    ("hidden", "answer", "says"),
    [
        ("", diagnosis("unknown"), "unknown"),
        ("", diagnosis("named", ["hysteresis"]), "a wrong name"),
        ("hysteresis", diagnosis("ambiguous", ["lost_motion"], (("hysteresis",),)), "among the explanations offered"),
        ("hysteresis", diagnosis("unknown", ["hysteresis"]), "the right name, said beside more that is unknown"),
        ("hysteresis", diagnosis("adequate"), "not found"),
    ],
)
def test_how_a_case_came_out_is_said_in_words(hidden, answer, says):
    case = pd.DataFrame([judged("trails", hidden, 0.5, answer)])
    *_, missed = residuals_section(case, pd.DataFrame({"severity": [0.5], "noise": ["trails"]})).items
    assert missed.frame["came out as"].tolist() == [says]
