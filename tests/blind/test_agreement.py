"""Two statements of one base: the bench's contours and tooth arrays against hdopt's model.

This is the one file here that may import hdopt. If the two disagreed about a sign or a zero, every blind case would
hide that instead of what its key says.
"""

import numpy as np
import pytest

import hdopt
from hdopt.bench.geometry import ARCMIN, BaseErrors, draw_errors, kinematic_error
from hdopt.drive.errors import DriveErrors
from hdopt.kinematics import kinematic_error_arcmin


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


@pytest.mark.parametrize("seed", range(8))
def test_base_waveform_is_hdopts(seed):
    errors = draw_errors(np.random.default_rng(seed))
    drive = hdopt.load_study("csf-25-80").drive
    theta = np.linspace(-30.0, 300.0, 20011)
    ours = kinematic_error(errors, theta) / ARCMIN
    theirs = kinematic_error_arcmin(drive, as_hdopt(errors), theta)
    difference = np.abs(ours - theirs)
    # Closed form 1e-4 arcmin, interpolation between teeth 2e-4 of 0.33 arcmin at most for each spline.
    assert np.quantile(difference, 0.98) < 3e-4
    # Where the deepest rim changes, both are right on either side of a small step.
    assert difference.max() < 0.02
