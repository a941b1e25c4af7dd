"""How far off an exported part may be: parts that are made up, a little within and a little beyond what is allowed."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.geometry import check

NANOMETRE = 1e-6


def wall(points, gap=0.01):
    return SimpleNamespace(points=np.asarray(points, float), largest_gap=gap)


def contour(off):
    """A curve that all points lie `off` mm from."""
    return SimpleNamespace(deviation=lambda points: np.full(len(points), off))


@pytest.mark.parametrize(
    ("offs", "gaps", "said"),
    [
        ((49 * NANOMETRE, 49 * NANOMETRE), (0.01, 0.01), []),
        ((51 * NANOMETRE, 0.0), (0.01, 0.01), ["number 1"]),
        ((-51 * NANOMETRE, 0.0), (0.01, 0.01), ["number 1"]),
        ((0.0, 51 * NANOMETRE), (0.01, 0.01), ["number 2"]),
        ((0.0, math.nan), (0.01, 0.01), ["number 2"]),
        ((0.0, 0.0), (0.01, math.radians(5.9)), []),
        ((0.0, 0.0), (0.01, math.radians(6.1)), ["no closed wall number 2"]),
        ((0.0, 0.0), (0.01,), ["no closed wall number 2"]),
    ],
)
def test_every_wall_lies_on_its_curve_to_50_nm_all_round(offs, gaps, said, monkeypatch):
    """The page says 0.05 um, a tenth of what machines place a point to, and no gap beyond 6 deg."""
    monkeypatch.setattr(check, "walls", lambda solid: [wall([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], gap) for gap in gaps])
    failures, deviation = check._check_walls(None, SimpleNamespace(name="cam", walls=[contour(off) for off in offs]))
    assert len(failures) == len(said)
    assert all(words in failure for words, failure in zip(said, failures, strict=True))
    if not said:
        assert deviation == max(abs(off) for off in offs)


class Solid:
    """A part of 1,000 mm^3 with 600 mm^2 of surface."""

    def __init__(self, closed=True, box=(0.0, 10.0)):
        self.closed, self.ends = closed, box

    def Area(self):
        return 600.0

    def Shells(self):
        return [SimpleNamespace(Closed=lambda: True), SimpleNamespace(Closed=lambda: self.closed)]

    def BoundingBox(self, tolerance):
        low, high = self.ends
        return SimpleNamespace(**{f"{axis}{end}": x for axis in "xyz" for end, x in (("min", low), ("max", high))})


def checked(monkeypatch, volume=1000.0, valid=True, colour=(0.5, 0.5, 0.5), **solid):
    monkeypatch.setattr(check, "_is_valid", lambda one: valid)
    monkeypatch.setattr(check, "volume_of", lambda one: volume)
    monkeypatch.setattr(check, "walls", lambda one: [])
    part = SimpleNamespace(
        name="cam",
        colour=(0.5, 0.5, 0.5),
        volume=1000.0,
        box=(0.0, 0.0, 0.0, 10.0, 10.0, 10.0),
        size=(10.0, 10.0, 10.0),
        walls=[],
        context=False,
    )
    return check._check_part(SimpleNamespace(solids=[Solid(**solid)], colour=colour), part)[0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, ""),
        ({"volume": 1000 + 500 * NANOMETRE}, ""),  # a nanometre over the surface is 600
        ({"volume": 1000 + 700 * NANOMETRE}, "volume"),
        ({"volume": 1000 - 700 * NANOMETRE}, "volume"),
        ({"volume": math.nan}, "volume"),
        ({"box": (0.0, 10 + 1.1 * NANOMETRE)}, ""),
        ({"box": (0.0, 10 + 1.3 * NANOMETRE)}, "spans"),
        ({"box": (-1.3 * NANOMETRE, 10.0)}, "spans"),
        ({"valid": False}, "not a valid solid"),
        ({"closed": False}, "not closed"),
        ({"colour": (0.5, 0.5, 0.51)}, "colour"),
        ({"colour": None}, "colour"),
    ],
)
def test_a_part_is_whole_and_of_its_size_to_a_nanometre(changes, said, monkeypatch):
    failures = checked(monkeypatch, **changes)
    assert len(failures) == bool(said)
    assert all(said in failure for failure in failures)


@pytest.mark.parametrize(("off", "alike"), [(0.5, True), (1.5, False), (-1.5, False)])
def test_sizes_of_a_file_are_those_of_the_drawing_to_a_nanometre(off, alike):
    rows = [("position", 0.02, ("A",))]
    assert check._alike(rows, [("position", 0.02 + off * NANOMETRE, ("A",))]) is alike
    assert not check._alike(rows, [("position", 0.02, ("B",))])
    assert not check._alike(rows, [])


@pytest.mark.parametrize(("volume", "overlap"), [(0.0, False), (0.5e-6, False), (2e-6, True)])
def test_parts_that_overlap_by_more_than_rounding_are_said(volume, overlap, monkeypatch):
    monkeypatch.setattr(check, "_boxes_meet", lambda one, other: True)
    common = SimpleNamespace(Volume=lambda: volume)
    parts = [SimpleNamespace(name=n, shape=SimpleNamespace(intersect=lambda other: common)) for n in ("cam", "hub")]
    assert bool(check.interferences(parts)) is overlap


def test_a_clearance_moves_a_part_by_half_and_leans_it_over_its_length():
    from hdopt.geometry import budget

    joint = budget.Joint("shaft", "hub", "shaft", 14.0, 9.0)
    fit = budget.fit_of("H7/h6", 14.0)
    play = (18 + 11) / 1000  # ISO 286: H7 0 to +18, h6 -11 to 0 um
    assert budget._eccentricity_of(joint, fit).takes == pytest.approx(play / 2)
    assert budget._tilt_of(joint, fit).takes == pytest.approx(math.atan(play / 9))
    bounds = budget.Bounds(0.05, None)
    # Half of the bound for one fit: its play is no more than the bound itself.
    assert budget._fit(joint, 1, 1, 0.05, bounds).largest_play <= 0.05
    assert budget._fit(joint, 1, 1, 0.02, bounds).largest_play <= 0.02
