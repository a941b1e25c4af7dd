"""What every effect declares, and what derives from it."""

import math

import numpy as np
import pytest

from hdopt.effects import EFFECTS
from hdopt.effects.declared import Category, Numbers, Quantity
from hdopt.effects.estimate import Parameter
from hdopt.effects.prior import outside_prior, prior_ranges
from hdopt.simulation import EffectValues
from hdopt.study import load_study

GEAR = load_study(drive="csf-25-80").drive.geometry
RANGES = [
    pytest.param(effect, name, quantity, id=f"{effect.id}-{name}")
    for effect in EFFECTS.values()
    for name, quantity in prior_ranges(effect).items()
    if not name.endswith(tuple(f"_{k}_um" for k in range(4, 41)))
]
EACH = pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)


@pytest.mark.parametrize(("effect", "name", "quantity"), RANGES)
def test_a_number_outside_its_prior_is_said_with_both(effect, name, quantity):
    low, high = quantity.prior
    width = high - low
    for value in (low, high):
        assert outside_prior(effect, {name: Parameter(value, value, value, quantity.unit)}) == []
    for value, sign in ((low - 0.1 * width, -1), (high + 0.1 * width, 1)):
        far = Parameter(value, value - 0.01 * width, value + 0.01 * width, quantity.unit)
        (found,) = outside_prior(effect, {name: far})
        assert found.certainly
        assert f"{effect.id} has {name} = {value:.3g}" in found.says and f"{low:g} to {high:g}" in found.says
        wide = Parameter(value, value - 0.2 * width, value + 0.2 * width, quantity.unit)
        assert [one.certainly for one in outside_prior(effect, {name: wide})] == [False]
        assert sign * (value - (low if sign < 0 else high)) > 0


def test_a_delay_of_seconds_and_a_stiffness_of_a_rock_are_outside():
    """Time in ms read as s made a delay of 2.5 s, torque in the wrong unit 2.5e7 Nm/rad."""
    delay = {"delay_s": Parameter(2.5, 2.4, 2.6, "s")}
    assert [one.name for one in outside_prior(EFFECTS["channel_delay"], delay)] == ["delay_s"]
    stiff = {"stiffness_1": Parameter(2.5e7, 2.4e7, 2.6e7, "Nm/rad")}
    assert [one.name for one in outside_prior(EFFECTS["torsional_windup"], stiff)] == ["stiffness_1"]
    absorber = {
        "frequency_hz": Parameter(0.1, 0.09, 0.11, "Hz"),
        "damping_ratio": Parameter(0.5, 0.4, 0.6, "1"),
        "gain": Parameter(0.02, 0.0, 0.04, "1"),
    }
    assert {one.name for one in outside_prior(EFFECTS["resonance"], absorber)} == set(absorber)


@EACH
def test_an_effect_declares_what_its_examples_need(effect):
    """Every example holds only declared keys, within what a study may say and within the prior."""
    assert effect.examples
    declared = {item.key: item for item in effect.flat_declared()}
    for example in effect.examples:
        for key, value in example.items():
            item = declared[key]
            if isinstance(item, Category):
                assert value in set(item.choices)
                continue
            if isinstance(item, Numbers):
                assert item.prior[0] <= min(value) <= max(value) <= item.prior[1]
                continue
            if item.prior is not None:
                assert item.prior[0] <= abs(value) <= item.prior[1]
            assert item.at_least is None or value >= item.at_least
            assert item.at_most is None or value <= item.at_most
            assert item.above is None or value > item.above
            assert item.below is None or value < item.below


@EACH
def test_categories_are_words_and_numbers_are_finite(effect):
    """No category is a number in disguise: what is not a float, a whole number or a set of waves is an enumeration."""
    for example in effect.examples:
        defaults = {i.key: i.default for i in effect.flat_declared() if isinstance(i.default, (str, float, int))}
        shape, coefficients = effect.values({**defaults, **example}, GEAR)
        assert all(math.isfinite(c) for c in coefficients)
        declared = {item.key for item in effect.flat_declared() if isinstance(item, Category)}
        assert set(effect.categories(shape)) == declared & set(shape)
        for value in shape.values():
            assert isinstance(value, (float, int, str, tuple))
        again = effect.keys(shape, coefficients, GEAR)
        assert np.allclose(EffectValues(effect.id, *effect.values(again, GEAR)).coefficients, coefficients)


@EACH
def test_every_number_says_its_unit_and_meaning(effect):
    for item in effect.flat_declared():
        assert item.meaning
        if isinstance(item, Quantity):
            assert item.unit
            assert item.prior is None or item.prior[0] < item.prior[1]
