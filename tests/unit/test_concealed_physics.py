"""The study `concealed-physics`, a small part of it: it answers, keeps the contract, and raises no alarm on nothing."""

from types import SimpleNamespace

import pandas as pd
import pytest

from hdopt.errors import HdoptError
from hdopt.report import Report, Ruling, Table
from hdopt.report.html import render
from hdopt.studies.concealed_physics import proof_section
from hdopt.study import load_study
from hdopt.study.schema import SECTIONS, step_sections
from hdopt.workflow.steps import Context, find_step


@pytest.mark.slow
def test_small_part_of_the_blind_proof(tmp_path):
    size = ("concealed.share=0.003", 'concealed.families=["nothing", "single"]', "concealed.seed=2001")
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
    gate = [SimpleNamespace(name="exact sets", value=float("nan"), limit=0.95, passed=False, detail="0 of 0")]
    case = SimpleNamespace(
        id="case-1", family="pair", severity=1.0, truth=("cs_tooth_harmonics",), outside="", hidden="lobes",
        verdict="named", said=("torsional_windup", "resonance"), reason="another name",
    )  # fmt: skip
    scores = SimpleNamespace(
        gate=lambda: gate, passed=False, cases=(case,), failed=(case,), reliability_frame=lambda: pd.DataFrame()
    )
    section = proof_section(scores, SimpleNamespace(seed=1, share=0.02))
    ruling, *rest = section.items
    assert isinstance(ruling, Ruling) and ruling.met is False and ruling.text.startswith("0 of 1 criteria")
    assert [item.key for item in rest if isinstance(item, Table)] == ["concealed-gate", "concealed-failed"]
    page = render(Report("Title", "", (section,)))
    assert ">nan" not in page and "(limit" not in page
    assert "CS tooth harmonics" in page and "Torsional windup, Resonance" in page and "cs_tooth_harmonics" not in page
