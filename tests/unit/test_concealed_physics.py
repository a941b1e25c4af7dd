"""The study `concealed-physics`, a small part of it: it answers, keeps the contract, and raises no alarm on nothing."""

import pytest

from hdopt.steps import Context, find_step
from hdopt.study import load_study


@pytest.mark.slow
def test_small_part_of_the_blind_proof(tmp_path):
    size = ("concealed.share=0.007", 'concealed.families=["nothing", "single"]', "concealed.seed=2001")
    study = load_study("concealed-physics", size)
    result = find_step("concealed_physics")(study, Context(tmp_path))
    assert result.results["cases"] == 3
    said = "\n".join(result.says)
    assert "schema" not in said and "no answer" not in said
    alarms = next(row for row in result.results["gate"] if row["name"].startswith("false-alarm"))
    assert alarms["detail"].startswith("0 of")
