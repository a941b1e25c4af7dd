"""What a diagnosis says of itself while it works: the stage, which pass, and how long still where that is known."""

from __future__ import annotations

import re
import threading

import pytest

from hdopt.diagnosis import pipeline, stages
from hdopt.workflow import diagnosis_stages
from hdopt.workflow.diagnosis_stages import DiagnosisWatch


@pytest.fixture
def seen(monkeypatch):
    """Runs the real pipeline with stages that do nothing but let a watch in another thread look; what it saw."""
    watch = DiagnosisWatch(threading.get_ident())
    said: list[str] = []
    clock = [0.0]
    monkeypatch.setattr(diagnosis_stages.time, "monotonic", lambda: clock[0])
    watch.begun = 0.0

    def look():
        clock[0] += 10.0
        other = threading.Thread(target=lambda: said.append(watch.words()))
        other.start()
        other.join()

    return said, look


def test_every_stage_has_words_of_its_own():
    """Would catch a stage that was added to the pipeline without a word on what it does."""
    known = diagnosis_stages._stages()
    assert {stage.__code__ for stage in (*stages.STAGES, *stages.STAGES_OF_A_PART)} <= set(known)
    assert all(re.fullmatch(r"[a-z][a-z', ]+", words) for words in known.values())


def test_a_watch_sees_stage_pass_and_what_is_left(seen, monkeypatch):
    """Ten seconds a look: two in the first pass, then the second, of which a half to 3 times the first is expected."""
    said, look = seen

    def search_effects(state):
        look()
        return state

    def diagnosis_of_a_part(recordings):
        look()
        search_effects(None)

    monkeypatch.setattr(stages, "search_effects", search_effects)
    known = {search_effects.__code__: "search of effects"}
    monkeypatch.setattr(diagnosis_stages, "_stages", lambda: known)
    monkeypatch.setattr(diagnosis_stages, "_part", lambda: diagnosis_of_a_part.__code__)
    look()
    diagnosis_of_a_part([])
    for _ in range(9):
        search_effects(None)
    assert said[0] == ""
    assert said[1].endswith("on a part of the turns: the turns left out")
    assert said[2].endswith("on a part of the turns: search of effects")
    assert said[3] == "second pass, on all turns: search of effects, 20 to 120 s more"
    assert said[4].endswith(", 10 to 110 s more")
    assert said[7].endswith(", up to 80 s more")


def test_the_real_functions_are_the_ones_that_are_looked_for():
    """Would catch a pipeline that runs its part under another name: the words of the first pass would never come."""
    assert pipeline.diagnosis_of_a_part.__code__ is diagnosis_stages._part()
    assert pipeline.begin.__code__ in diagnosis_stages._stages()
    assert pipeline.assess.__code__ in diagnosis_stages._stages()


@pytest.mark.parametrize("terminal", [False, True])
def test_progress_shows_the_stage_on_a_terminal_and_in_a_log(terminal, monkeypatch, capsys):
    import time

    from hdopt.cli import log

    monkeypatch.setattr(log, "EVERY_S", 0.02)
    monkeypatch.setattr(log, "LOOK_EVERY_S", 0.02)
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal)
    with log.looked_at("diagnosis of 1 recording", lambda: "search of effects"):
        time.sleep(0.2)
    said = capsys.readouterr().err
    assert re.search(r"diagnosis of 1 recording: search of effects, 0 s so far", said)
