"""Surfaces and harmonics of the error, what a record may say of them, and the C code that carries them."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

from hdopt.compensation.pursuit import dictionary, pursue
from hdopt.compensation.surface import Harmonics, Surface, surface_of
from hdopt.compensation.writers import written

TERMS = Harmonics(np.array([2, 1]), np.array([0, -3]), np.array([0.4, 0.0]), np.array([0.1, 0.25]), back=0.05)
A, B = np.random.default_rng(0).uniform(-20, 20, (2, 400))


def by_hand(a, b, direction=0.0):
    return 0.4 * np.cos(2 * a) + 0.1 * np.sin(2 * a) + 0.25 * np.sin(a - 3 * b) + 0.05 * direction


def test_harmonics_are_sines_of_both_angles_and_half_the_return_error():
    assert TERMS.at(A, B) == pytest.approx(by_hand(A, B))
    way = np.where(A > 0, 1.0, -1.0)
    assert TERMS.at(A, B, way) == pytest.approx(by_hand(A, B, way))


def test_a_surface_is_exact_at_its_points_and_straight_between_them_all_round():
    surface = surface_of([TERMS], back=0.05)
    rows, columns = surface.values.shape
    i, j = np.array([0, 5, rows - 1]), np.array([0, columns - 1, 7])
    a, b = 2 * np.pi * i / rows, 2 * np.pi * j / columns
    assert surface.at(a, b, 1.0) == pytest.approx(surface.values[i, j] + 0.05)
    # A quarter of a cell on, over the edge of the grid too: straight lines between neighbours.
    along = surface.at(a + 0.25 * 2 * np.pi / rows, b)
    assert along == pytest.approx(0.75 * surface.values[i, j] + 0.25 * surface.values[(i + 1) % rows, j])
    across = surface.at(a, b + 0.25 * 2 * np.pi / columns)
    assert across == pytest.approx(0.75 * surface.values[i, j] + 0.25 * surface.values[i, (j + 1) % columns])


def test_a_surface_gives_its_harmonics_back():
    found = surface_of([TERMS]).harmonics(2)
    assert found.at(A, B) == pytest.approx(by_hand(A, B), abs=1e-12)


@pytest.mark.parametrize(("turns", "step"), [(1.0, 1), (0.5, 2), (0.3, 3)])
def test_a_short_record_parts_only_orders_far_enough_apart(turns, step):
    """Orders j/N apart are one cycle apart over an output turn."""
    assert {j % step for _, j in dictionary(turns)} == {0}
    assert len({j for _, j in dictionary(turns)}) == 2 * (10 // step) + 1


def test_less_than_a_tenth_of_an_output_turn_parts_nothing():
    assert {j for _, j in dictionary(0.05)} == {0}


def pursued(residual, theta, terms=20):
    return pursue((theta, theta / 80), residual, np.ones((len(theta), 1)), None, dictionary(1.0), terms)


def test_what_is_there_is_found_and_nothing_else():
    theta = np.arange(80 * 60) * 2 * np.pi / 60
    noise = np.random.default_rng(1).normal(0, 0.02, len(theta))
    found = pursued(by_hand(theta, theta / 80) + noise, theta)
    assert {(int(k), int(j)) for k, j in zip(found.k, found.j, strict=True)} == {(2, 0), (1, -3)}
    assert found.at(theta, theta / 80) == pytest.approx(by_hand(theta, theta / 80), abs=0.005)


def test_noise_has_no_harmonics_whatever_its_colour():
    """A walk that forgets over 30 rows has a thirtieth of as many independent values as rows."""
    from scipy.signal import lfilter

    theta = np.arange(80 * 60) * 2 * np.pi / 60
    white = np.random.default_rng(2).normal(0, 0.02, len(theta))
    assert len(pursued(white, theta)) == 0
    assert len(pursued(lfilter([1.0], [1.0, -0.97], white), theta)) <= 1


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("found", [TERMS, surface_of([TERMS], back=0.05)], ids=["terms", "table"])
def test_the_controllers_code_computes_the_same(found, tmp_path):
    source, library = tmp_path / "found.c", tmp_path / "found.so"
    source.write_text(written(found, "c", {"drive": "test"}))
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", library, source, "-lm"], check=True)
    function = ctypes.CDLL(str(library)).hdopt_error_arcmin
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * 3
    for a, b in zip(A[:40], B[:40], strict=True):
        for way in (1, -1):
            expected = float(found.at(np.array([a]), np.array([b]), way)[0])
            assert function(a, b, way) == pytest.approx(expected, abs=1e-9)
    assert isinstance(found, Harmonics | Surface)
