"""Whole numbers on the command line: written out, or with an exponent."""

from decimal import Decimal

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hdopt.cli.app import COMMANDS, cli
from hdopt.cli.whole_number import WholeNumber


def read(text):
    return WholeNumber(0, 10**13).convert(text, None, None)


@given(part=st.decimals(0, 100, places=3), exponent=st.integers(0, 9), sign=st.sampled_from(["e", "E", "e+"]))
def test_an_exponent_means_what_it_says(part, exponent, sign):
    """Faults caught: 2.5e3 taken for 25000, or refused; 1.5e0 cut to 1."""
    value = part * Decimal(10) ** exponent
    if value == int(value):
        assert read(f"{part}{sign}{exponent}") == int(value)
    else:
        with pytest.raises(click.BadParameter, match="is no whole number; write it as 100000 or 1e5"):
            read(f"{part}{sign}{exponent}")


@given(st.integers(0, 10**13))
def test_digits_are_kept(value):
    """Fault caught: a number that goes through a float."""
    assert read(str(value)) == read(value) == value


@pytest.mark.parametrize("text", ["abc", "", "1e", "e5", "1.5", "nan", "1e-3", "0x10", "1_000"])
def test_what_is_none_is_refused(text):
    with pytest.raises(click.BadParameter, match="is no whole number"):
        read(text)


@pytest.mark.parametrize("text", ["1e14", "-1", "1e99"])
def test_what_is_out_of_range_says_the_range(text):
    with pytest.raises(click.BadParameter, match="is not in the range 0<=x<=10000000000000"):
        read(text)


def test_every_whole_number_is_read_so():
    """Fault caught: an option that takes 100000 and not 1e5."""
    for name in COMMANDS:
        for option in cli.get_command(click.Context(cli), name).params:
            if isinstance(option.type, click.types.IntParamType):
                assert isinstance(option.type, WholeNumber), (name, option.opts)
