"""Every unit that a column may have, against its size worked out here: rad, s, Nm, deg C."""

from math import pi

import pytest

from hdopt.recordings.units import CHANNEL_UNITS, parse_unit, stated_unit

SIZES = {
    "angle": {
        "rad": 1.0,
        "mrad": 0.001,
        "urad": 0.000001,
        "deg": pi / 180,
        "arcmin": pi / 10800,
        "arcsec": pi / 648000,
        "rev": 2 * pi,
        "turn": 2 * pi,
        "gon": pi / 200,
    },
    "time": {"s": 1.0, "ms": 0.001, "us": 0.000001, "ns": 0.000000001, "min": 60.0, "h": 3600.0},
    "torque": {"Nm": 1.0, "Nmm": 0.001, "Ncm": 0.01, "kNm": 1000.0},
}
"""Quantity -> unit -> its size in the base unit, by definition (BIPM, SI brochure, 9th edition)."""

OF_CHANNEL = {"time": "time", "input": "angle", "output": "angle", "error": "angle", "torque": "torque"}


@pytest.mark.parametrize("channel", OF_CHANNEL)
def test_every_unit_has_its_size(channel):
    sizes = SIZES[OF_CHANNEL[channel]]
    assert set(CHANNEL_UNITS[channel]) == set(sizes)
    for name, size in sizes.items():
        unit = parse_unit(channel, name)
        assert unit.factor == pytest.approx(size, rel=1e-12), f"{channel} in {name}"
        assert unit.offset == 0


@pytest.mark.parametrize(("name", "reading"), [("C", 20.0), ("K", 293.15), ("F", 68.0)])
def test_twenty_degrees_in_every_unit_of_temperature(name, reading):
    assert name in CHANNEL_UNITS["temperature"] and len(CHANNEL_UNITS["temperature"]) == 3
    unit = parse_unit("temperature", name)
    assert reading * unit.factor + unit.offset == pytest.approx(20.0, abs=1e-9)


def test_counts_and_a_gear_before_the_encoder():
    """16384 counts are a turn of the encoder, which turns three times as fast as the shaft."""
    assert parse_unit("input", "counts/16384").factor * 16384 == pytest.approx(2 * pi)
    assert parse_unit("output", "counts/16384/gear3").factor * 16384 == pytest.approx(2 * pi / 3)
    assert parse_unit("input", "deg/gear0.5").factor == pytest.approx(pi / 90)


WRITTEN = {
    "angle": {
        "deg": ["°", "degrees", "Deg", "grad", "[deg]"],
        "rad": ["radians", "(rad)"],
        "arcmin": ["'", "′", "arcminute"],
        "arcsec": ['"', "″", "arcseconds"],
        "urad": ["µrad", "μrad"],
        "turn": ["turns", "rot"],
        "rev": ["revs"],
    },
    "time": {"s": ["sec", "Seconds"], "ms": ["msec", "millis"], "us": ["µs", "μs", "usec"]},
    "torque": {"Nm": ["nm", "N·m", "N*m", "N m", "NM"], "Nmm": ["mNm", "mnm"]},
}
"""Quantity -> unit -> how people and loggers write it."""


@pytest.mark.parametrize("channel", OF_CHANNEL)
def test_units_as_people_write_them(channel):
    """Fault caught: a second's sign read as a minute's, a mNm as a Nm; both would be taken without a word."""
    for unit, words in WRITTEN[OF_CHANNEL[channel]].items():
        for word in words:
            assert stated_unit(channel, word) == unit
    assert stated_unit(channel, "furlong") == ""
