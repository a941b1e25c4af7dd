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
    "profile": lambda: hdopt.profile("csf-25-80"),
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


@pytest.mark.parametrize("name", RESULTS)
def test_matplotlib_draws_the_same_numbers(name):
    """Would catch a bar that is left out or stands for another, a line of other points, and a lost title of an axis."""
    result = RESULTS[name]()
    plotly, other = result.plot(), result.plot(backend="matplotlib")
    sizes = [np.asarray(trace.x if lying(trace) else trace.y) for trace in plotly.data if trace.type == "bar"]
    bars = [size for some in sizes for size in some]
    patches = [patch for axes in other.axes for patch in axes.patches]
    lie = any(lying(trace) for trace in plotly.data)
    assert [p.get_width() if lie else p.get_height() for p in patches] == pytest.approx(bars, nan_ok=True)
    points = [np.asarray(trace.y) for trace in plotly.data if trace.type != "bar"]
    lines = [line.get_ydata() for axes in other.axes for line in axes.lines[: len(points)]]
    for ours, theirs in zip(lines, points, strict=False):
        assert ours == pytest.approx(theirs)
    assert len(lines) >= len(points)
    assert other.axes[-1].get_xlabel() == plotly.layout.xaxis.title.text
    assert other.axes[0].get_ylabel() == plotly.layout.yaxis.title.text
    other.canvas.draw()


def lying(trace):
    return trace.type == "bar" and trace.orientation == "h"


def test_grouped_bars_stand_beside_each_other_with_their_errors():
    import plotly.graph_objects as go

    from hdopt.figures import drawn

    ends = {"type": "data", "array": [1.0, 2.0], "arrayminus": [0.5, 0.25]}
    one = go.Bar(x=["a", "b"], y=[3.0, 4.0], name="one", error_y=ends)
    bars = [one, go.Bar(x=["b", "a"], y=[5.0, 6.0], name="two")]
    (axes,) = drawn(go.Figure(bars), "matplotlib").axes
    middles = {patch.get_height(): patch.get_x() + patch.get_width() / 2 for patch in axes.patches}
    assert middles == pytest.approx({3.0: -0.2, 4.0: 0.8, 5.0: 1.2, 6.0: 0.2})
    assert [text.get_text() for text in axes.get_xticklabels()] == ["a", "b"]
    (segments,) = [lines.get_segments() for lines in axes.collections]
    assert [list(segment[:, 1]) for segment in segments] == [[2.5, 4.0], [3.75, 6.0]]


def test_a_backend_that_cannot_draw_a_figure_says_so():
    import plotly.graph_objects as go

    from hdopt.figures import drawn

    with pytest.raises(HdoptError, match="unknown backend 'matplotlip'; did you mean 'matplotlib'"):
        hdopt.profile("csf-25-80").plot("matplotlip")
    with pytest.raises(HdoptError, match="not heatmap; leave backend out"):
        drawn(go.Figure(go.Heatmap(z=[[1, 2], [3, 4]])), "matplotlib")


def test_the_curves_of_a_profile_are_its_figures():
    result = hdopt.profile("csf-25-80")
    assert result.deflection_mm.max() == pytest.approx(0.396)  # Jia 2021, Table 1: the module
    assert np.abs(result.curvature_change_per_mm).max() == pytest.approx(result.max_curvature_change_per_mm, rel=1e-4)
    assert not {"phi", "deflection_mm", "curvature_change_per_mm"} & result.to_dict().keys()


def test_the_outline_of_an_export_is_the_cam():
    """Table 1's ellipse less 3 mm of bearing all round, its major axis upwards."""
    figure = hdopt.export("csf-25-80", {}).plot()
    (cam,) = figure.data
    assert np.ptp(cam.x) == pytest.approx(54.636, abs=1e-3) and np.ptp(cam.y) == pytest.approx(56.092, abs=1e-3)
    assert cam.name == "cam" and figure.layout.yaxis.scaleanchor == "x"


def test_a_run_draws_the_figures_of_its_page(tmp_path):
    study = hdopt.load_study("csf-25-80").with_({"study": {"steps": ["structures", "lag"]}})
    result = hdopt.run_study(study, tmp_path / "out")
    assert len(result.figures) >= 2
    for key, figure in result.figures.items():
        assert result.plot(key) == figure
    assert result.plot() == next(iter(result.figures.values()))
    with pytest.raises(HdoptError, match="unknown figure"):
        result.plot("nothing")


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


def test_an_error_that_is_none_is_named():
    with pytest.raises(HdoptError, match="unknown error 'axis_eccentricity_mm'; did you mean 'axis_eccentricity'"):
        hdopt.load_study().errors.with_(axis_eccentricity_mm=0.01)


@pytest.mark.parametrize("name", RESULTS)
def test_a_notebook_shows_the_table_of_a_result(name):
    """Would catch a result that fills the notebook with the text of a record."""
    result = RESULTS[name]()
    shown = result._repr_html_()
    assert "<table" in shown and all(f"<th>{column}</th>" in shown for column in result.to_frame().columns)
