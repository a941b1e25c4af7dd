"""Results as users of Python take them: frames, Plotly figures, waveforms, and sweeps in one call."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
import pytest

import hdopt
from hdopt.errors import HdoptError
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.kinematics.waveform import kinematic_error_arcmin

STACK = "chase-shaft-housing"
RESULTS = {
    "ke": lambda: hdopt.kinematic_error("csf-25-80"),
    "stack": lambda: hdopt.stack(STACK, 2**11),
    "sobol": lambda: hdopt.sobol(STACK, 2**8),
    "shapley": lambda: hdopt.sobol(STACK, 2**8, shapley="inputs", second_order=False),
    "screen": lambda: hdopt.screen(STACK, "morris", 2**8),
    "allocate": lambda: hdopt.allocate(STACK, "rss", compare=False),
    "inspect": lambda: hdopt.inspect(recording(), "csf-25-80", {"peak_to_peak": 1.0}),
    "each": lambda: hdopt.inspect_many([recording()], "csf-25-80", {"peak_to_peak": 1.0}),
}


def recording():
    """Two turns there and back of the shipped drive."""
    import pandas as pd

    study = hdopt.load_study("csf-25-80")
    theta = np.r_[there := np.arange(120) * 2 * np.pi / 60, there[::-1]]
    error = kinematic_error_arcmin(study.drive, study.errors, theta)
    table = {"time_s": np.arange(len(theta)) * 0.1, "input_angle_deg": np.degrees(theta)}
    return hdopt.recording_from_table(
        pd.DataFrame(table | {"output_angle_deg": np.degrees(theta) / 80 - error / 60}), 80.0
    )


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_draws_itself_and_is_a_table(name):
    """Would catch an empty trace, an axis without a name, and a main table that is not the first of all."""
    result = RESULTS[name]()
    figure = result.plot()
    assert isinstance(figure, go.Figure)
    assert all(len(trace.x) == len(trace.y) > 0 for trace in figure.data)
    assert figure.layout.xaxis.title.text and figure.layout.yaxis.title.text
    first = next(iter(result.tables().values()))
    assert len(first) == len(result.to_frame()) > 0


def test_what_is_drawn_of_a_stack_is_its_sample():
    result = hdopt.stack(STACK, 2**11)
    (bars,) = result.plot().data
    assert sum(bars.y) == result.stack.n
    mean = np.average(bars.x, weights=bars.y)
    assert mean == pytest.approx(result.stack.mean.value, abs=bars.width[0])  # a bin's width


def test_the_waveform_of_a_result_is_the_drives():
    """One relative turn of 80 input turns; its range is the converged peak-to-peak but for what the grid leaves out."""
    study = hdopt.load_study("csf-25-80")
    result = hdopt.kinematic_error(study)
    assert result.theta.shape == result.waveform_arcmin.shape
    assert result.theta[-1] / (2 * np.pi) == pytest.approx(80, abs=0.01)
    some = slice(0, None, 997)
    ours = kinematic_error_arcmin(study.drive, study.errors, result.theta, "exact")[some]
    assert result.waveform_arcmin[some] == pytest.approx(ours - ours.mean() + result.waveform_arcmin[some].mean())
    low = result.peak_to_peak_arcmin - np.ptp(result.waveform_arcmin)
    assert 0 <= low < 0.01 * result.peak_to_peak_arcmin
    assert not {"theta", "waveform_arcmin"} & result.to_dict().keys()


def test_a_sweep_is_what_its_drives_are_one_by_one():
    study = hdopt.load_study("csf-25-80")
    sizes, directions = np.array([0.0, 0.005, 0.01]), np.array([[0.0], [1.0]])
    swept = study.errors.with_(axis_eccentricity=sizes, axis_eccentricity_direction=directions)
    found = hdopt.peak_to_peak(study, swept)
    assert found.shape == (2, 3)
    for i, j in np.ndindex(found.shape):
        one = study.errors.with_(axis_eccentricity=sizes[j], axis_eccentricity_direction=directions[i, 0])
        # closed form against exact geometry, 1e-3 for 99 % of the shipped tolerances' drives
        assert found[i, j] == pytest.approx(converged_peak_to_peak_arcmin(study.drive, one), abs=1e-3)
    by_name = hdopt.peak_to_peak("csf-25-80")
    assert by_name == hdopt.peak_to_peak(study.drive, study.errors) == hdopt.peak_to_peak()


def test_a_sweep_does_not_leave_effects_out_in_silence():
    lobing = {"effects": {"circular_spline_lobing": {"lobes": 6, "radial_amplitude_um": 8.0, "phase_deg": 0.0}}}
    with pytest.raises(HdoptError, match=r"take hdopt\.kinematic_error"):
        hdopt.peak_to_peak(hdopt.load_study("csf-25-80").with_(lobing))
