"""Callouts by their definitions, and what a stack says of a yield, from both ends of the interval."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from hdopt.allocation.convex import Item, solve, worst_case_rule
from hdopt.allocation.cost import Reciprocal
from hdopt.allocation.grades import JIS_PITCH_MICRONS
from hdopt.errors import HdoptError
from hdopt.tolerance.contributors import CALLOUTS, VECTORS, Contributor
from hdopt.tolerance.distributions import Normal
from hdopt.tolerance.empirical import SortedValues
from hdopt.tolerance.sampling import PlainMonteCarlo, ScrambledSobol
from hdopt.tolerance.stack import yield_estimate

DEFINED = {
    # An axis lies within a cylinder of diameter t, a shaft within a fit of clearance c: half of it to any side.
    "coaxiality": ("eccentricity", 0.5),
    "position": ("eccentricity", 0.5),
    "total_runout": ("eccentricity", 0.5),
    "fit_clearance": ("eccentricity", 0.5),
    # A plane or axis between two planes t apart over its length, here 4 mm (ISO 1101).
    "perpendicularity": ("tilt", 1 / 4.0),
    "parallelism": ("tilt", 1 / 4.0),
    # The largest less the smallest of one sine is twice its amplitude (ISO 1328-1).
    "total_cumulative_pitch": ("tooth deviation", 0.5),
}


def feeding(kind):
    return [name for name, (own, *_) in VECTORS.items() if own == kind]


def test_every_callout_is_defined_here():
    assert set(DEFINED) == set(CALLOUTS)


@pytest.mark.parametrize("name", DEFINED)
def test_a_callout_allows_what_its_definition_says_of_the_errors_of_its_kind(name):
    kind, share = DEFINED[name]
    assert feeding(kind)
    for feeds in VECTORS:
        length = 4.0 if kind == "tilt" else None
        if feeds in feeding(kind):
            assert Contributor("part", name, 0.02, feeds, length).error_per_mm == pytest.approx(share)
        else:
            with pytest.raises(HdoptError, match=f"{name} cannot feed {feeds}"):
                Contributor("part", name, 0.02, feeds, length)


def test_a_tilt_over_half_a_millimetre_is_twice_its_callout():
    assert Contributor("part", "perpendicularity", 0.02, "wg_tilt", 0.5).error_per_mm == pytest.approx(2.0)


@pytest.mark.parametrize("name", ["perpendicularity", "parallelism"])
@pytest.mark.parametrize("length", [None, 0.0, -3.0])
def test_a_tilt_needs_the_length_that_it_is_measured_over(name, length):
    with pytest.raises(HdoptError, match=f"contributor 'part': {name} needs length_mm"):
        Contributor("part", name, 0.02, "wg_tilt", length)


@pytest.mark.parametrize(
    ("callout", "value", "feeds", "said"),
    [
        ("coaxialty", 0.02, "wg_eccentricity", "callout 'coaxialty'.*coaxiality"),
        ("coaxiality", 0.02, "wg_excentricity", "error to feed 'wg_excentricity'.*wg_eccentricity"),
        ("coaxiality", 0.0, "wg_eccentricity", "finite number above 0"),
        ("coaxiality", -0.02, "wg_eccentricity", "finite number above 0"),
        ("coaxiality", float("inf"), "wg_eccentricity", "finite number above 0"),
        ("coaxiality", float("nan"), "wg_eccentricity", "finite number above 0"),
    ],
)
def test_what_is_no_callout_is_refused_with_the_nearest(callout, value, feeds, said):
    with pytest.raises(HdoptError, match=f"contributor 'part': .*{said}"):
        Contributor("part", callout, value, feeds)


def parts(above, n=1000):
    return [SimpleNamespace(n=n, above_limit=count) for count in above]


ABOVE = (95, 102, 99, 110, 91, 104, 97, 102)


def test_a_yield_over_scramblings_lies_within_students_interval_on_both_sides():
    """800 of 8000 beyond the limit, a share that eight scramblings know to t(7) times their standard error."""
    found = yield_estimate(parts(ABOVE), ScrambledSobol(8))
    half = stats.t.ppf(0.975, 7) * np.std(np.array(ABOVE) / 1000, ddof=1) / np.sqrt(8)
    assert found.value == pytest.approx(0.9)
    assert (found.low, found.high) == pytest.approx((0.9 - half, 0.9 + half))


def test_a_yield_is_a_share_whatever_the_scramblings_scatter():
    """Where half of them have nearly all and half nearly none beyond the limit, Student's ends lie beyond 0 and 1."""
    found = yield_estimate(parts((10, 990)), ScrambledSobol(2))
    assert (found.value, found.low, found.high) == (0.5, 0.0, 1.0)


@pytest.mark.parametrize("above", [(0, 0, 1, 0), (250, 250, 250, 249)])
def test_a_yield_with_hardly_any_on_one_side_is_clopper_and_pearsons(above):
    n, k = 1000, 1000 - sum(above)
    found = yield_estimate(parts(above, 250), ScrambledSobol(4))
    low = stats.beta.ppf(0.025, k, n - k + 1) if k else 0.0
    high = stats.beta.ppf(0.975, k + 1, n - k)
    assert (found.low, found.high) == pytest.approx((low, high), rel=1e-6)


def test_independent_points_are_clopper_and_pearsons_whatever_lies_beyond():
    found = yield_estimate(parts(ABOVE), PlainMonteCarlo())
    ends = stats.beta.ppf(0.025, 7200, 801), stats.beta.ppf(0.975, 7201, 800)
    assert (found.low, found.high) == pytest.approx(ends, rel=1e-6)


@pytest.mark.parametrize("limit", [0.0021, 0.0100, 1.0])
def test_tolerances_at_an_end_of_their_range_are_binding(limit):
    """Of two from 0.001 to 0.005, whose sum may be a little more than the finest, the widest, or anything."""
    items = [Item(name, Reciprocal(1.0, 0.02), 0.002, lower=0.001, upper=0.005) for name in ("a", "b")]
    found = solve(items, worst_case_rule([1.0, 1.0], limit))
    wide = {name for name, t in found.tolerances.items() if t >= 0.005 * (1 - 1e-6)}
    fine = {name for name, t in found.tolerances.items() if t <= 0.001 * (1 + 1e-6)}
    assert set(found.binding) == wide | fine
    assert wide == ({"a", "b"} if limit >= 0.01 else set())


@pytest.mark.parametrize("bins", [1, 7, 40])
def test_a_histogram_has_its_bins_and_every_value(bins):
    values = np.sort(np.random.default_rng(2).normal(size=500))
    edges, counts = SortedValues(values).histogram(bins)
    assert len(edges) == bins + 1 and len(counts) == bins and counts.sum() == 500
    assert (edges[0], edges[-1]) == (values[0], values[-1])
    assert np.diff(edges) == pytest.approx(np.ptp(values) / bins)


@pytest.mark.parametrize(("low", "high"), [(2.0, 2.5), (3.0, 3.1), (4.0, 9.0), (-2.5, -2.0), (-1.0, 0.5)])
def test_a_truncated_normal_is_scipys_on_either_side(low, high):
    """Between bounds that both take mass away, above the mean, below it and about it."""
    u = np.array([0.001, 0.1, 0.5, 0.9, 0.999])
    found = Normal(mean=0.3, std=0.2, lower=0.3 + 0.2 * low, upper=0.3 + 0.2 * high).quantile(u)
    assert found == pytest.approx(stats.truncnorm.ppf(u, low, high, 0.3, 0.2), rel=1e-9)


def test_fine_pitch_classes_are_a_root_of_two_apart_up_to_the_sixth_and_then_two():
    """JIS B 1702-1976: both numbers of a class, rounded to preferred numbers, to 4 %."""
    numbers = np.array(JIS_PITCH_MICRONS)
    steps = numbers[1:] / numbers[:-1]
    assert steps[:6] == pytest.approx(np.full((6, 2), np.sqrt(2)), rel=0.04)
    assert steps[6:] == pytest.approx(np.full((2, 2), 2.0), rel=0.01)
