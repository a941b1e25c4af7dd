"""A recording whose zero was set anew by less than is seen at once: told beside the verdict and never named."""

from dataclasses import replace

import numpy as np
import pytest

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.alternatives import Jump
from hdopt.diagnosis.inference.catalogue import NEW_ZERO, TOLD, explanations, is_effect
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from tests.unit.test_diagnosis import NOISE, bench

ZERO = explanations()[NEW_ZERO]
OFF = 0.3
"""Arcmin: well below the 5 arcmin from which zeros are free before anything is fitted."""


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


def three(study, hidden=None, turns=5):
    """Three recordings of a few turns at three speeds."""
    return bench(study, hidden, turns=turns, speeds=(1.0, 1.5, 2.0))


def test_there_is_a_column_for_each_recording_but_the_first(study):
    rows = gather(three(study))
    columns = ZERO.term(rows, {}).columns
    assert columns.tolist() == [[row == 1, row == 2] for row in rows.record]
    assert ZERO.lacks(rows) is None
    assert "two" in ZERO.lacks(gather(bench(study, turns=5)))
    assert NEW_ZERO in TOLD
    assert not is_effect(NEW_ZERO)


def test_a_jump_where_a_recording_starts_could_be_a_new_zero(study):
    """It must then win clearly, as it must at a reversal; elsewhere nothing else jumps."""
    rows = gather(three(study))
    rows = replace(rows, direction=np.ones(len(rows)))
    start = float(np.flatnonzero(np.diff(rows.record))[0] + 1)
    assert Jump().term(rows, {"row": start}).doubtful
    assert not Jump().term(rows, {"row": start + 250}).doubtful


@pytest.mark.slow
def test_a_new_zero_is_adequate_and_told(study):
    """Without this explanation it is an event, and the verdict unknown."""
    recordings = three(study, lambda state: np.where(state["index"] == 1, OFF, 0.0), turns=12)
    found = diagnose(recordings, study.drive)
    assert (found.verdict, found.effects) == ("adequate", ())
    (note,) = [note for note in found.warnings if "zero" in note]
    told = [float(part.split(" arcmin")[0]) for part in note.split(": ")[1].split(", ")]
    assert told == pytest.approx([OFF, 0.0], abs=5 * NOISE / np.sqrt(1200))
