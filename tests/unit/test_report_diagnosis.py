"""Pieces of the diagnosis report that compute something of their own."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.checks.confounding import Confounding
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.report.sections.diagnosis import LISTED_WAVES, confounded_items, parameter_row, waves_figure, waves_of
from hdopt.report.sections.diagnosis_residual import (
    FEWEST,
    POINTS,
    continued,
    means_along,
    output_turn_figure,
    turn_figure,
)


def test_recordings_follow_one_another_in_time():
    """Two recordings from 5 s and from 1 s on, 2 s and 3 s long: the second goes on at 2 s."""
    time = np.array([5.0, 6.0, 7.0, 1.0, 2.0, 4.0])
    record = np.array([0, 0, 0, 1, 1, 1])
    np.testing.assert_allclose(continued(time, record), [0.0, 1.0, 2.0, 2.0, 3.0, 5.0])


def test_means_keep_the_mean_of_all_rows():
    """As many rows in each group, so the mean of the means is that of the rows."""
    rng = np.random.default_rng(0)
    values, residual = rng.normal(size=POINTS * 10), rng.normal(size=POINTS * 10)
    x, y = means_along(values, residual)
    assert len(x) == POINTS
    assert np.all(np.diff(x) > 0)
    assert y.mean() == pytest.approx(residual.mean())


def test_means_in_the_logarithm_show_the_first_degrees_and_no_lone_row():
    values = np.linspace(0, 1000, 10_000)
    x, y = means_along(values, np.where(values < 10, 1.0, 0.0), spread_log=True)
    assert np.sum(x < 10) >= 5
    assert np.all(y[x < 9] == 1.0)
    lone = np.r_[np.full(FEWEST - 1, 1.0), np.full(100, 50.0)]
    assert means_along(lone, lone, spread_log=True)[0].tolist() == [50.0]


def test_a_pure_number_shows_no_unit():
    assert parameter_row("parameter", "lobes", Parameter(6, 6, 6, "1"))["unit"] == ""
    assert parameter_row("parameter", "delay_s", Parameter(6, 6, 6, "s"))["unit"] == "s"


def test_what_could_be_mistaken_is_said_once_for_each_effect():
    class Told:
        evidence = SimpleNamespace(settings=DEFAULT)
        confounded = (
            Confounding("lost_motion", "hysteresis", 2.0, 0.99, 3.0, "reverse slowly"),
            Confounding("lost_motion", "channel_delay", 3.0, 0.9, 300.0, "reverse slowly"),
        )

    table, *texts = confounded_items(Told)
    assert table.frame["could be"].tolist() == ["Hysteresis", "Channel delay"]
    assert [text.text for text in texts] == ["To tell lost motion apart: reverse slowly."]


def test_many_waves_are_drawn_and_few_listed():
    size = Parameter(0.5, -0.1, 1.1, "um")
    waves = {f"{kind}_{h}_{unit}": size for h in range(2, 41) for kind, unit in (("amplitude", "um"), ("phase", "deg"))}
    assert list(waves_of(waves)) == list(range(2, 41))
    (bars,) = waves_figure("cs_tooth_harmonics", waves_of(waves)).figure.data
    assert list(bars.x) == list(range(2, 41))
    assert bars.error_y.arrayminus[0] == 0.5
    few = {"amplitude_arcmin": size, "phase_deg": size, "amplitude_output_2_arcmin": size, "delay_s": size}
    assert len(waves_of(few)) <= LISTED_WAVES
    assert waves_of(few) == {}


def test_intervals_end_where_amplitudes_and_phases_do():
    known = FitEstimate(np.array([3.0, 4.0]), np.diag([0.01, 0.01]))
    assert known.amplitude(0, 1, "um", scale=1e3).value == pytest.approx(5e3)
    assert known.amplitude(0, 1).high - known.amplitude(0, 1).low == pytest.approx(2 * 1.96 * 0.1, rel=1e-3)
    phase = known.phase_deg(0, 1)
    assert phase.high - phase.value == pytest.approx(np.degrees(1.96 * 0.1 / 5), rel=1e-3)
    open_ = FitEstimate(np.array([0.3, 0.4]), np.diag([100.0, 100.0]))
    assert open_.amplitude(0, 1).low == 0.0
    assert open_.phase_deg(0, 1).high - open_.phase_deg(0, 1).low == 360.0


def test_the_direction_of_a_nil_error_has_no_numbers():
    """Would catch a direction said with an interval of thousands of turns."""
    known, nil = Parameter(20.0, -100.0, 140.0, "deg"), Parameter(0.0, -1.1e7, 1.1e7, "deg")
    assert parameter_row("error", "x", known)["low"] == -100.0
    assert [parameter_row("error", "x", nil)[key] for key in ("value", "low", "high")] == [None] * 3
    assert not Parameter(9e3, -1e7, 1e7, "mm").undefined


@pytest.mark.parametrize("per_turn", [40, 90, 91, 180, 720])
def test_means_over_a_turn_have_no_gaps(per_turn):
    """Would catch 90 means of 90 rows a turn, of which those beside a row's place are empty."""
    theta = np.arange(0.3, 20 * per_turn) * 2 * np.pi / per_turn
    rows = SimpleNamespace(theta=theta, rows_per_turn=float(per_turn), ratio=80.0)
    fit = SimpleNamespace(problem=SimpleNamespace(rows=rows), residual=np.cos(theta))
    for made in (turn_figure([("before", fit, "red")]), output_turn_figure([("before", fit, "red")])):
        values = np.asarray(made.figure.data[0].y, float)
        assert len(values) >= 12
        if made.key == "diagnosis-turn":
            assert np.all(np.isfinite(values))
