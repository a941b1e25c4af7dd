"""One damaged tooth in a compensation: found at its place, and held by a few coefficients."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from hdopt.compensation.damage import fit_damage, stands_out
from hdopt.compensation.pulse import Damage
from hdopt.compensation.surface import nothing
from hdopt.compensation.teeth import CELLS, Teeth
from hdopt.compensation.zones import Zones, formed_damaged
from hdopt.drive.errors import DriveErrors
from hdopt.effects.met import Spline
from hdopt.kinematics.cartesian import PARAMETERS, CartesianModel, to_cartesian
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study

RATIO, TURN, NOISE = 80.0, 2 * np.pi, 0.008
CS_PITCH, FS_PITCH = TURN / 162, TURN / 160


@pytest.fixture(scope="module")
def drive():
    model = CartesianModel.of(load_study(drive="csf-25-80").drive)
    errors = DriveErrors(
        axis_eccentricity=0.004, wg_eccentricity=0.003, cs_tooth_amplitude=0.002, cs_tooth_phase=0.3,
        fs_tooth_amplitude=0.002, fs_tooth_phase=1.0,
    )  # fmt: skip
    return Teeth.bare(model, to_cartesian(errors, model.half_width), 1.0)


def tooth_on(drive, spline, number, height):
    """One tooth raised by `height` mm, its neighbours half as much, straight lines between the teeth."""
    count = 162 if spline is Spline.CIRCULAR else 160
    raised = np.zeros(count + 1)
    raised[[number - 1, number, number + 1]] = height / 2, height, height / 2
    table = np.interp(np.arange(CELLS) * count / CELLS, np.arange(count + 1), raised)
    return replace(drive, **{"cs" if spline is Spline.CIRCULAR else "fs": table})


def rows_of(teeth, seed=1, turns=82, per_turn=130):
    theta = np.arange(turns * per_turn) * TURN / per_turn
    error = teeth.at(theta) + np.random.default_rng(seed).normal(0, NOISE, len(theta))
    frame = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / RATIO - error / 60}
    return gather([recording_from_table(pd.DataFrame(frame), RATIO)])


@pytest.mark.parametrize(("spline", "number", "height"), [(Spline.FLEX, 91, 0.008), (Spline.CIRCULAR, 20, 0.008)])
def test_a_raised_tooth_is_found_at_its_place(drive, spline, number, height):
    """Begun from errors that the tooth has drawn to itself, and from a place half a turn on, where the other zone would
    meet it: only the tooth tells which zone drives."""
    true = tooth_on(drive, spline, number, height)
    rows = rows_of(true)
    free = np.ones((len(rows), 1))
    drawn = replace(drive, errors=drive.errors + 0.003 * np.random.default_rng(3).normal(size=PARAMETERS))
    pitch = CS_PITCH if spline is Spline.CIRCULAR else FS_PITCH
    wrong = Damage(spline, (number * pitch + np.pi) % TURN, 2 * pitch, height / 2)
    under, found = fit_damage(rows, free, drawn, wrong.on(drive))
    left = rows.error - found.on(under).at(rows.theta)
    assert np.std(left) < 1.06 * NOISE
    assert found.spline is spline
    turned = (found.centre / pitch - number + 0.5 * TURN / pitch) % (TURN / pitch) - 0.5 * TURN / pitch
    assert abs(turned) < 0.1
    assert found.height == pytest.approx(height, rel=0.05)
    assert found.half_width == pytest.approx(2 * pitch, rel=0.05)


def test_teeth_without_damage_have_none(drive):
    """Long waves are no tooth; each would be fitted again for nothing."""
    around = np.arange(CELLS) * TURN / CELLS
    assert stands_out(drive, (CS_PITCH, FS_PITCH)) is None
    assert stands_out(replace(drive, cs=np.sin(5 * around)), (CS_PITCH, FS_PITCH)) is None


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("spline", Spline)
def test_a_few_coefficients_hold_it(drive, spline, sense):
    """Against the teeth themselves over a beat: waves alone leave a third of so high a tooth.
    Without the sway of its place 0.004 mm of eccentricity has it off by a tenth of a pitch."""
    damage = Damage(spline, 1.3, 2 * FS_PITCH, 0.008)
    teeth = replace(drive, sense=sense)
    found, off = formed_damaged(teeth, damage, nothing(), 64, 0.1)
    assert isinstance(found, Zones) and len(found) <= 64
    theta = np.linspace(0, 80 * TURN, 60_000)
    left = damage.on(teeth).at(theta) - found.at(theta, theta / RATIO)
    high = np.ptp(damage.on(teeth).at(theta) - teeth.at(theta))
    assert high > 0.3
    assert np.ptp(left) < 0.06 * high
    assert off == pytest.approx(np.ptp(left), rel=0.1)
