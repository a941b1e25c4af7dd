"""A k_e that varies round the input's turn: a drive as built, told beside the verdict and never named."""

import numpy as np
import pytest

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.inference.catalogue import TOLD, VARYING_CONTACT, explanations, is_effect, is_outside
from hdopt.effects.estimate import FitEstimate
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from tests.unit.test_diagnosis import bench

CONTACT = explanations()[VARYING_CONTACT]
SHARES = {1: (0.05, 0.4), 2: (0.04, -1.1), 4: (0.07, 2.0)}
"""Share of k_e and phase (rad) at each number of waves an input turn."""


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


def test_its_columns_are_the_drives_own_error_times_its_waves(study):
    rows = gather(bench(study, turns=5))
    motion = np.random.default_rng(0).normal(1, 0.3, len(rows))
    term = CONTACT.term(rows, {"waves": 2.0}, motion)
    coefficients = np.array([0.1, -0.2, 0.03, 0.04])
    share = sum(
        s * np.sin(k * rows.theta) + c * np.cos(k * rows.theta)
        for k, (s, c) in enumerate(coefficients.reshape(-1, 2), 1)
    )
    assert term.columns @ coefficients == pytest.approx(motion * share)
    response = CONTACT.response(rows, term.shape, coefficients, np.column_stack([motion, rows.theta]))
    assert response == pytest.approx(np.column_stack([motion, rows.theta]) * share[:, None])


def test_it_needs_the_drives_motion_and_a_few_turns(study):
    rows = gather(bench(study, turns=5))
    assert CONTACT.lacks(rows) is None
    assert "input turns" in CONTACT.lacks(gather(bench(study, turns=1)))
    with pytest.raises(ValueError, match="motion"):
        CONTACT.term(rows, {"waves": 1.0})
    assert VARYING_CONTACT in TOLD
    assert not is_effect(VARYING_CONTACT)
    assert not is_outside(VARYING_CONTACT)


@pytest.mark.parametrize(("largest", "believed"), [(0.3, True), (0.6, False), (-0.6, False)])
def test_no_contact_varies_by_more_than_a_half(study, largest, believed):
    rows = gather(bench(study, turns=5))
    term = CONTACT.term(rows, {"waves": 1.0}, np.ones(len(rows)))
    assert CONTACT.every_part_shows(term, FitEstimate(np.array([0.1, largest]), np.eye(2))) is believed


@pytest.mark.slow
def test_a_drive_whose_k_e_varies_is_adequate_and_told(study):
    """The whole error, its mean included, follows k_e; without this explanation teeth are named."""

    def varies(state):
        own = kinematic_error_arcmin(study.drive, study.errors, state["theta"])
        return own * sum(a * np.cos(k * state["theta"] + phase) for k, (a, phase) in SHARES.items())

    (recording,) = bench(study, varies, turns=20)
    found = diagnose([recording], study.drive)
    assert (found.verdict, found.effects) == ("adequate", ())
    (note,) = [note for note in found.warnings if "k_e" in note]
    told = [float(part.split(" %")[0].split()[-1]) for part in note.split(": ")[1].split(", ")]
    # Two digits are printed; the noise of 4,000 rows against a base of 0.1 arcmin leaves 0.5 % at five sigma.
    assert told == pytest.approx([100 * SHARES.get(k, (0.0, 0.0))[0] for k in (1, 2, 3, 4)], abs=1.0)
