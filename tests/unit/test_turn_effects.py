"""Effects over one input turn, in the cells that the kernel in lanes looks at: angles, bounds, spectra."""

import numpy as np
import pytest

from hdopt.simulation.turn.effects import _with_parts, derived, largest, scan_of, spectrum_of

TURN = 2 * np.pi
CELLS = 24


def waves(orders, places=512, seed=0):
    """Waves of these orders in both zones, of about 1 um, on even places of a turn, (2, places)."""
    angle = np.arange(places) * TURN / places
    size = np.random.default_rng(seed).normal(size=(2, len(orders), 2))
    sines = np.stack([np.stack([np.cos(k * angle), np.sin(k * angle)]) for k in orders])
    return 1e-3 * np.einsum("zkp,kpn->zn", size, sines)


def test_a_spectrum_is_that_of_the_values_and_of_their_derivatives():
    """Against sums of sines. Faults caught: a factor, a sign of the derivative."""
    angle = np.arange(96) * TURN / 96
    found = spectrum_of(np.stack([np.cos(3 * angle), np.sin(5 * angle)]))
    places = np.arange(200) * TURN / 200
    np.testing.assert_allclose(derived(found, 0, 200), [np.cos(3 * places), np.sin(5 * places)], atol=1e-12)
    np.testing.assert_allclose(derived(found, 1, 200), [-3 * np.sin(3 * places), 5 * np.cos(5 * places)], atol=1e-11)
    assert largest(found, 2) == pytest.approx(25, rel=1e-2)


@pytest.mark.parametrize(("count", "kept"), [(8, False), (9, True)])
def test_the_highest_order_of_an_even_count_is_left_out(count, kept):
    """Of values that go up and down from place to place nobody knows the phase. Fault caught: it stays, as a cosine;
    or the highest of an odd count goes too, whose phase is known."""
    angle = np.arange(count) * TURN / count
    found = spectrum_of(np.stack([np.cos(count // 2 * angle)] * 2))
    assert bool(np.abs(found[:, -1]).max() > 0.1) is kept


def test_cells_divide_the_turn_evenly():
    """Faults caught: a cell's width that is not a turn over their number, by which its middle, its half and its sag are
    wrong."""
    scan = scan_of(spectrum_of(waves([1, 2, 3])), np.zeros((2, 2), complex), CELLS)
    edges, middles = np.arange(CELLS + 1) * TURN / CELLS, (np.arange(CELLS) + 0.5) * TURN / CELLS
    np.testing.assert_allclose(scan.cos, np.cos(edges), atol=1e-6)
    np.testing.assert_allclose(scan.sin, np.sin(edges), atol=1e-6)
    np.testing.assert_allclose(scan.mid_cos, np.cos(middles), atol=1e-6)
    np.testing.assert_allclose(scan.mid_sin, np.sin(middles), atol=1e-6)
    assert scan.half == pytest.approx(np.pi / CELLS, rel=1e-6)
    assert scan.sag == pytest.approx((TURN / CELLS) ** 2 / 8, rel=1e-6)


def chord_of(edges, places):
    """Straight lines between `edges` (cells + 1,) on so many places of each cell, (cells, places)."""
    share = np.arange(places) / places
    return edges[:-1, None] * (1 - share) + edges[1:, None] * share


def test_between_the_edges_of_a_cell_an_effect_lies_within_its_bounds():
    """Both zones, sixty places a cell. Faults caught: a bound of one zone only, below and above exchanged, places of
    the neighbouring cell."""
    spectrum = spectrum_of(waves([1, 2, 5, 9]))
    scan = scan_of(spectrum, np.zeros((2, 2), complex), CELLS)
    values = derived(spectrum, 0, 60 * CELLS).reshape(2, CELLS, 60)
    both, apart = scan.edges[:, 0], scan.edges[:, 1]
    slack = 2e-2 * np.ptp(values)
    for zone, sign in enumerate((1, -1)):
        off = values[zone] - chord_of(both + sign * apart, 60)
        assert np.all(off >= -scan.below[:, None] - slack)
        assert np.all(off <= scan.above[:, None] + slack)
        assert off.min() < -0.5 * scan.below.max()


def test_parts_are_widened_by_what_is_fast_and_hardly_more():
    """A ripple of 160 waves over slow ones, in cells that the slow ones decide. Faults caught: the ripple left out of a
    bound, or what is left between its places taken by the first power of their distance: bounds of ten times."""
    slow, fast = waves([1, 2, 3], 4096), waves([160], 4096, seed=1)
    scan, *_ = _with_parts(spectrum_of(slow + fast), np.zeros((2, 2), complex), 2000, 100.0)
    alone = scan_of(spectrum_of(slow), np.zeros((2, 2), complex), len(scan.below))
    more = np.array([scan.above - alone.above, scan.below - alone.below])
    size = np.abs(fast).max()
    assert np.all(more > 0.9 * size) and np.all(more < 1.2 * size)
