"""Real recordings of others: what the diagnosis says of them, and what it leaves unsaid."""

import os
from pathlib import Path

import numpy as np
import pytest

from hdopt.diagnosis import diagnose
from hdopt.recording import read_recording

pytestmark = pytest.mark.recordings

PLANETARY = 7.2
REVERSING = "time=time_s:s,input=odrive_pos_rad:rad,output=output_pos_rad:rad"
STIFFNESS = "time=time_s:s,error=encoder_pos_rad:rad,torque=output_torque_Nm:Nm"
MOUNT = "time=time_s:s,input=wg_angle_deg(sidereal):deg,error={}:arcsec"


@pytest.fixture(scope="module")
def folder():
    root = Path(__file__).resolve().parents[2]
    for path in (os.environ.get("HDOPT_RECORDINGS"), root / "../shared/recordings"):
        if path and Path(path).is_dir():
            return Path(path)
    pytest.skip("no recordings: set HDOPT_RECORDINGS to their folder")


def test_planetary_reversing(folder):
    """A reversal, friction and play; half an input turn says nothing of orders."""
    diagnosis = diagnose(folder / "planetary-7to1-reversing.csv", ratio=PLANETARY, columns=REVERSING)
    assert any("sign has been turned around" in warning for warning in diagnosis.warnings)
    assert any("steps of 1.3 arcmin" in warning for warning in diagnosis.warnings)
    assert any(warning.startswith("encoder_output_eccentricity cannot be seen") for warning in diagnosis.warnings)
    claimed = {found.id for found in diagnosis.effects}
    assert claimed <= {"hysteresis", "lost_motion", "channel_delay"}


def test_planetary_stiffness(folder):
    """Torque against a locked input: the windup, softer in the middle than beyond its knee."""
    diagnosis = diagnose(folder / "planetary-7to1-stiffness.csv", ratio=PLANETARY, columns=STIFFNESS)
    assert "torsional_windup" in {found.id for found in diagnosis.effects}
    parameters = next(f for f in diagnosis.effects if f.id == "torsional_windup").parameters
    assert parameters["stiffness_2"].value > parameters["stiffness_1"].value > 0


def test_mount_is_too_short_to_name_anything(folder):
    """Five half-turns of the wave generator cannot part order 2 from 2 (1 + 1/N): no name is claimed."""
    diagnosis = diagnose(folder / "csf-17-100-mount.csv", ratio=100.0, columns=MOUNT.format("ra_error_arcsec_mean"))
    assert diagnosis.verdict in ("insufficient", "unknown")
    assert diagnosis.effects == ()


def test_trails_hidden_from_the_tool_agree_with_the_one_it_saw(folder):
    """The three trails are one motion read three times: they must agree within the 1 to 2 arcsec of their origin."""
    read = [
        read_recording(folder / "csf-17-100-mount.csv", 100.0, MOUNT.format(name)).error_arcmin * 60
        for name in ("altair", "trail2_V6.25", "omi_aql")
    ]
    for trail in read[1:]:
        difference = trail - read[0]
        assert np.std(difference - difference.mean()) < 2.0
