"""Two statements of one base: the bench's contours and tooth arrays against hdopt's model.

This is the one file here that may import hdopt. If the two disagreed about a sign or a zero, every blind case would
hide that instead of what its key says.
"""

import numpy as np
import pytest

from hdopt.bench.gears import GEARS, study_text
from hdopt.bench.geometry import ARCMIN, BaseErrors, draw_errors, kinematic_error
from hdopt.drive.errors import DriveErrors
from hdopt.kinematics import kinematic_error_arcmin
from hdopt.study import load_study


def as_hdopt(errors: BaseErrors):
    polar = [np.hypot, np.arctan2]
    axis, axis_direction = (f(errors.axis_x_mm, errors.axis_y_mm) for f in polar)
    wg, wg_direction = (f(errors.wg_x_mm, errors.wg_y_mm) for f in polar)
    cs, cs_phase = (f(errors.cs_cos_mm, errors.cs_sin_mm) for f in polar)
    fs, fs_phase = (f(errors.fs_cos_mm, errors.fs_sin_mm) for f in polar)
    return DriveErrors(
        axis_eccentricity=axis,
        axis_eccentricity_direction=axis_direction,
        axis_tilt_y=errors.axis_tilt_y,
        axis_tilt_x=errors.axis_tilt_x,
        wg_eccentricity=wg,
        wg_eccentricity_direction=wg_direction,
        wg_tilt_major=errors.wg_tilt_major,
        wg_tilt_minor=errors.wg_tilt_minor,
        cs_tooth_amplitude=cs,
        cs_tooth_phase=cs_phase,
        fs_tooth_amplitude=fs,
        fs_tooth_phase=fs_phase,
    )


@pytest.mark.parametrize("gear", GEARS.values(), ids=str)
@pytest.mark.parametrize("seed", range(4))
def test_base_waveform_is_hdopts(gear, seed, tmp_path):
    """Catches a study file that describes another drive, a contour, a structure or a rim that is another."""
    errors = draw_errors(np.random.default_rng(seed))
    (tmp_path / "drive.toml").write_text(study_text(gear))
    drive = load_study(tmp_path / "drive.toml").drive
    theta = np.linspace(-30.0, 300.0, 20011)
    ours = kinematic_error(errors, theta, gear) / ARCMIN
    theirs = kinematic_error_arcmin(drive, as_hdopt(errors), theta)
    difference = np.abs(ours - theirs)
    # Closed form 1e-4 arcmin; interpolation between z teeth, a straight line between two points of a sine: (2 pi/z)^2/8
    # of 0.33 arcmin at most for each spline.
    pitches = sum((2 * np.pi / z) ** 2 / 8 for z in (gear.fs_teeth, gear.cs_teeth))
    assert np.quantile(difference, 0.98) < 1e-4 + 0.33 * pitches
    # Where the deepest rim changes, both are right on either side of a small step.
    assert difference.max() < 0.02


def test_the_shipped_drive_is_the_first_gear():
    shipped, ours = load_study(drive="csf-25-80").drive, GEARS["csf-25-80"]
    assert shipped.geometry.ratio == ours.ratio and shipped.geometry.module == ours.module_mm
    profile = shipped.wave_generator.profile
    assert (profile.semi_major, profile.semi_minor) == (ours.semi_major_mm, ours.semi_minor_mm)
