"""The study `concealed-physics`, a small part of it: it answers, keeps the contract, and raises no alarm on nothing."""

from types import SimpleNamespace

import pandas as pd
import pytest

from hdopt.errors import HdoptError
from hdopt.report import Report, Ruling, Table
from hdopt.report.html import render
from hdopt.studies.concealed_physics import gate_frame, proof_section, without_empty
from hdopt.study import load_study
from hdopt.study.schema import SECTIONS, step_sections
from hdopt.workflow.steps import Context, find_step


@pytest.mark.slow
def test_small_part_of_the_blind_proof(tmp_path):
    size = ("concealed.share=0.003", 'concealed.families=["nothing", "single"]', "concealed.seed=2009")
    study = load_study("concealed-physics", size)
    result = find_step("concealed_physics")(study, Context(tmp_path))
    assert result.results["cases"] == 2
    said = "\n".join(result.says)
    assert "schema" not in said and "no answer" not in said
    alarms = next(row for row in result.results["gate"] if row["name"].startswith("false-alarm"))
    assert alarms["detail"].startswith("0 of")


def test_its_section_comes_with_the_step_and_not_with_the_general_schema():
    assert "concealed" not in SECTIONS and step_sections()["concealed"]
    assert load_study("concealed-physics", ("concealed.seed=7",)).sections["concealed"].seed == 7
    with pytest.raises(HdoptError, match=r"unknown key 'concealed.sede'; did you mean 'concealed.seed'"):
        load_study("concealed-physics", ("concealed.sede=7",))


def test_its_page_begins_with_the_verdict_and_speaks_in_words():
    """Would catch a figure 'nan (limit 0.93)', an empty table of confidences, and keys of the catalogue on the page."""
    gate = [
        SimpleNamespace(name="exact sets, 2 hidden", value=float("nan"), limit=0.9, passed=False, detail="0 of 0"),
        SimpleNamespace(name="false-alarm rate", value=0.527, limit=0.01, passed=False, detail="0 of 4"),
        SimpleNamespace(
            name="95 % intervals that hold the truth",
            value=1.0,
            limit=0.93,
            passed=False,
            detail="7 of 7, at most 0.97",
        ),
        SimpleNamespace(
            name="effects whose intervals do not", value=1.0, limit=0.0, passed=False, detail="lost_motion"
        ),
        SimpleNamespace(name="unknown physics recognised", value=1.0, limit=0.95, passed=True, detail="3 of 3"),
        SimpleNamespace(name="enough cases", value=0.0, limit=1.0, passed=False, detail="1 cases"),
    ]
    case = SimpleNamespace(
        id="case-1", family="pair", severity=1.0, truth=("cs_tooth_harmonics",), outside="", hidden="lobes",
        verdict="named", said=("torsional_windup", "resonance"), reason="another name",
    )  # fmt: skip
    scores = SimpleNamespace(
        gate=lambda: gate, passed=False, cases=(case,), failed=(case,), reliability_frame=lambda: pd.DataFrame(),
        families={"pair": SimpleNamespace(hits=0, n=1)},
    )  # fmt: skip
    section = proof_section(scores, SimpleNamespace(seed=1, share=0.02))
    ruling, *rest = section.items
    assert isinstance(ruling, Ruling) and ruling.met is False and ruling.text.startswith("1 of 5 criteria")
    points, *_ = rest
    assert points.sentences == (
        "Missed: false-alarm rate: 0.527, where at most 0.01 is asked (0 of 4).",
        "Missed: 95 % intervals that hold the truth: 1, where 0.93 to 0.97 is asked (7 of 7).",
        "Missed: effects whose intervals do not: 1, where at most 0 is asked (Lost motion).",
        "No case of this run bears on one criterion: exact sets, 2 hidden.",
        "One case is too few for the gate, whatever it says: it is that of the full proof, and this is 2 % of it or a "
        "part of its families.",
    )
    tables = {item.key: item.frame for item in rest if isinstance(item, Table)}
    assert list(tables) == ["concealed-gate", "concealed-families", "concealed-failed"]
    assert tables["concealed-gate"]["kept"].tolist() == ["not asked", "no", "no", "no", "yes", "no"]
    assert tables["concealed-gate"]["limit"].tolist() == [
        "at least 0.9", "at most 0.01", "0.93 to 0.97", "at most 0", "at least 0.95", "",
    ]  # fmt: skip
    (row,) = tables["concealed-failed"].to_dict("records")
    assert row["concealed"] == "CS tooth harmonics (lobes)" and row["answered"] == "named: Torsional windup, Resonance"
    page = render(Report("Title", "", (section,)))
    assert ">nan" not in page and "(limit" not in page
    assert "CS tooth harmonics" in page and "Torsional windup, Resonance" in page and "cs_tooth_harmonics" not in page


def test_every_criterion_of_the_real_gate_has_its_side():
    """Would catch a criterion whose limit the page turns round: the side must be the one that decides `passed`."""
    from hdopt.bench.score import score

    gate = score({}, [], {}).gate()
    sides = dict(zip(gate_frame(gate)["criterion"], gate_frame(gate)["limit"], strict=True))
    for one in gate:
        asked = sides[one.name].split(" ")[:2]
        if one.name == "95 % intervals that hold the truth":
            assert sides[one.name] == "0.93 to 0.97"
            continue
        assert one.name in ("enough cases", "log score of confidences, over the best constant") or asked in (
            ["at", "most"], ["at", "least"],
        )  # fmt: skip
    assert {name for name, side in sides.items() if side.startswith("at most")} == {
        "false-alarm rate, upper bound", "unknown physics named", "effects whose intervals do not",
        "calibration error of confidences", "cases that cannot be told apart",
    }  # fmt: skip


def test_a_summary_without_its_empty_blocks():
    blocks = ["gate\n  a 1", "right by effect\n", "reliability\nEmpty DataFrame\nColumns: []", "redrawn: 0"]
    assert list(without_empty(blocks)) == ["gate", "  a 1", "", "redrawn: 0", ""]
