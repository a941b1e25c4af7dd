"""The three steps together, with stand-ins for the diagnosis whose scores are known beforehand."""

import json
import sys

import pytest

from hdopt.bench import answer, generate
from hdopt.bench.proof import prove
from hdopt.bench.score import read, score

SHORT = ("nothing", "single", "pair", "unknown", "scale")
"""Families without the long records, which take as long as all others."""

ADEQUATE = {"schema": 1, "verdict": "adequate", "effects": [], "ambiguous_with": [], "fit": {}}


def test_who_always_says_adequate_raises_no_alarm_and_finds_nothing():
    scores = prove(lambda recordings: ADEQUATE, seed=3, cases=16, families=SHORT)
    assert scores.false_alarms.hits == 0 and scores.false_alarms.n == 3
    assert all(rate.hits == 0 for rate in scores.strict_by_count.values())
    assert scores.improvement[0] == 0 and not scores.passed


def test_who_always_says_unknown_recognises_the_unknown_and_nothing_else():
    scores = prove(lambda recordings: ADEQUATE | {"verdict": "unknown"}, seed=3, cases=16, families=SHORT)
    assert scores.false_alarms.hits == scores.false_alarms.n == 3
    assert scores.unknown_recognised.value == 1 and scores.unknown_named.hits == 0
    assert all(rate.hits == 0 for rate in scores.right_by_count.values())


def test_who_falls_over_is_shown():
    def fall(recordings):
        raise ZeroDivisionError(f"{len(recordings)} recordings")

    scores = prove(fall, seed=3, families=("nothing",), cases=13)
    assert scores.false_alarms.hits == 2
    assert "ZeroDivisionError" in scores.invalid[0]


def test_the_commands_in_a_row(tmp_path, capsys):
    chosen = ["--families", "nothing", "--cases", "13", "--gears", "csf-25-80"]
    generate.main(["--out", str(tmp_path), "--seed", "4", *chosen, "--workers", "2"])
    stand_in = tmp_path / "diagnose.py"
    # The second case gets no answer, so that a failing command is seen to be reported.
    stand_in.write_text(
        "import json, sys\n"
        "if 'case-0002' in sys.argv[1]: sys.exit('no idea')\n"
        "assert sys.argv[sys.argv.index('--drive') + 1] == 'csf-25-80'\n"
        f"json.dump({ADEQUATE!r}, open(sys.argv[sys.argv.index('--json') + 1], 'w'))\n"
    )
    status = answer.main(["--dir", str(tmp_path), "--", sys.executable, str(stand_in)])
    said = capsys.readouterr()
    assert status == 1 and "1 of 2 cases answered" in said.out
    assert "case-0002: exit status 1: no idea" in said.err
    assert json.loads((tmp_path / "answers" / "case-0001.json").read_text()) == ADEQUATE
    assert json.loads((tmp_path / "answers.json").read_text())["begun"] == 2
    scores = score(*read(tmp_path))
    assert scores.false_alarms.hits == 1 and scores.invalid == ("case-0002: no answer",)
    assert answer.main(["--dir", str(tmp_path), "--minutes", "0", "--", sys.executable, str(stand_in)]) == 0
    # No case is begun when the time is over; what an earlier sitting of the same program did stays.
    assert json.loads((tmp_path / "answers.json").read_text())["begun"] == 2
    told = tmp_path / "answers.json"
    told.write_text(json.dumps(json.loads(told.read_text()) | {"seconds": 100.0}))
    for others, seconds in (({}, 100.0), ({"program": "another"}, 0.0)):
        told.write_text(json.dumps(json.loads(told.read_text()) | others))
        answer.main(["--dir", str(tmp_path), "--minutes", "0", "--", sys.executable, str(stand_in)])
        assert seconds < json.loads(told.read_text())["seconds"] < seconds + 50
        assert json.loads(told.read_text())["begun"] == (0 if others else 2)


def test_shares_keep_a_part_of_every_family():
    with pytest.raises(ValueError, match="unknown family"):
        prove(lambda recordings: ADEQUATE, seed=0, families=("nothing", "everything"))
