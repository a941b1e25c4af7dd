"""The study `concealed-physics`, a small part of it: it answers, keeps the contract, and raises no alarm on nothing."""

import pytest

from hdopt.errors import HdoptError
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
