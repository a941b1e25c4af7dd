"""Sine and cosine by polynomials, against the C library's."""

import math

import numpy as np
import pytest

from hdopt.effects._sine_cosine import sine_cosine
from hdopt.effects.sines import sine_columns

LAST_DIGIT = 2.3e-16
"""One unit in the last place of a number just above 1, in which each of both may err."""


@pytest.mark.parametrize("within", [1.0, 10.0, 1e3, 1e6])
def test_both_are_right_to_the_last_digit(within):
    angles = np.random.default_rng(1).uniform(-within, within, 20_000)
    found = sine_columns(angles, [1.0])
    assert np.abs(found[:, 0] - np.sin(angles)).max() <= LAST_DIGIT
    assert np.abs(found[:, 1] - np.cos(angles)).max() <= LAST_DIGIT


@pytest.mark.parametrize("eighth", range(-17, 18))
def test_both_are_right_where_the_reduction_changes(eighth):
    """At whole eighths of a turn and one rounding to either side."""
    middle = eighth * math.pi / 4
    for angle in (np.nextafter(middle, -np.inf), middle, np.nextafter(middle, np.inf)):
        assert sine_cosine(angle) == pytest.approx((math.sin(angle), math.cos(angle)), abs=LAST_DIGIT, rel=0)


def test_python_and_the_compiled_function_agree_to_the_bit():
    for angle in np.random.default_rng(2).uniform(-500, 500, 200):
        assert sine_cosine.plain(float(angle)) == sine_cosine.compiled(float(angle))


def test_far_angles_lose_no_more_than_their_own_rounding():
    """1e7 rad are known to 1.9e-9; what is lost in the reduction stays below."""
    angles = np.random.default_rng(3).uniform(-1e7, 1e7, 5000)
    assert np.abs(sine_columns(angles, [1.0])[:, 0] - np.sin(angles)).max() < np.spacing(1e7)
