"""Where each check of a recording begins to speak, from both sides."""

import numpy as np
import pytest

from hdopt.drive.geometry import ARCMIN
from hdopt.errors import HdoptError
from hdopt.recordings.checks import check_error_column, checked_recording, smooth_clock, turn_output_sign
from hdopt.recordings.repairs import Checks, drop_incomplete_rows, drop_outliers

TURN, RATIO, ROWS = 2 * np.pi, 80.0, 1000
THETA = np.arange(ROWS) * TURN / 100
WAVE = 2.0 * np.sin(2 * THETA)


def rows_of(**channels):
    return Checks({"input": THETA, **channels}, RATIO, "record")


@pytest.mark.parametrize(("jitter", "said"), [(0.01, None), (0.04, "jitters by 4%")])
def test_a_clock_is_uneven_from_a_fiftieth_of_a_step(jitter, said):
    """The deviation that half of the steps exceed is 0.6745 of a normal clock's standard deviation, the jitter."""
    steps = 0.01 * (1 + 0.6745 * jitter * np.resize([1.0, -1.0, 0.0, 0.0, 1.0, -1.0, 1.0, -1.0], ROWS))
    checks = rows_of(time=np.cumsum(steps))
    smooth_clock(checks)
    assert [said in warning for warning in checks.warnings] == [True] * (said is not None)


@pytest.mark.parametrize(
    ("size", "read_as", "doubted"),
    [(20.0, 60.0, True), (20.0, 180 / np.pi * 60, True), (0.02, 1 / 60, True), (0.1, 1.0, False), (60.0, 1.0, False)],
)
def test_an_error_of_a_size_that_no_drive_has_is_doubted(size, read_as, doubted):
    """Peak to peak `size` arcmin, `read_as` so many times that: arcmin as degrees, as radians, arcsec for arcmin."""
    checks = rows_of(error=read_as * size / 2 * np.sin(2 * THETA) * ARCMIN)
    check_error_column(checks)
    assert ["check its unit" in warning for warning in checks.warnings] == [True] * doubted


@pytest.mark.parametrize(("slope", "turned"), [(-1.0, True), (-0.7, True), (-0.3, False), (0.02, False)])
def test_an_output_is_counted_backward_where_it_moves_at_half_its_speed(slope, turned):
    """An output that hardly follows is not one that is counted the other way: what it is, the ratio's check says."""
    checks = rows_of(output=slope * THETA / RATIO)
    assert turn_output_sign(checks) is turned
    assert np.allclose(checks.channels["output"], (-slope if turned else slope) * THETA / RATIO)


def test_a_spike_does_not_take_its_neighbours_with_it():
    error = WAVE.copy()
    error[[200, 605]] += 100.0
    checks = rows_of(error=error * ARCMIN)
    segment = drop_outliers(checks, np.zeros(ROWS, np.int64))
    assert len(checks) == len(segment) == ROWS - 2
    assert np.array_equal(checks.channels["error"], np.delete(WAVE, [200, 605]) * ARCMIN)


def gappy(share):
    error = WAVE * ARCMIN
    error[np.random.default_rng(0).permutation(ROWS)[: round(share * ROWS)]] = np.nan
    return rows_of(error=error, time=0.01 * np.arange(ROWS))


def test_a_record_may_lose_up_to_half_of_its_rows():
    """Of 45 % missing the rest is a recording, by the first check and by the last; of 55 % none."""
    assert len(checked_recording(gappy(0.45).channels, RATIO, "record")) == 550
    with pytest.raises(HdoptError, match="550 of 1000 rows hold missing values"):
        drop_incomplete_rows(gappy(0.55))


def test_losses_of_two_kinds_add_up():
    """Three tenths without a number, and three tenths of the rows written twice: four tenths are left."""
    time = 0.01 * np.arange(ROWS)
    time[1:600:2] = time[0:600:2]
    error = WAVE * ARCMIN
    error[700:] = np.nan
    with pytest.raises(HdoptError, match="only 400 of 1000 rows are usable"):
        checked_recording({"input": THETA, "time": time, "error": error}, RATIO, "record")
