"""Surfaces and harmonics of the error, what a record may say of them, and the C code that carries them."""

import ctypes
import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from hdopt.compensation.pursuit import dictionary, pursue
from hdopt.compensation.surface import Harmonics, nothing, surface_of
from hdopt.compensation.teeth import Teeth
from hdopt.compensation.writers import written
from hdopt.compensation.zones import Zones, driving, in_terms, zone_values
from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.study import load_study

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
    beside = [j for k, j in dictionary(turns) if k > 0]
    assert {j % step for j in beside} == {0}
    assert len(set(beside)) == 2 * (10 // step) + 1


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


SECOND = Harmonics(np.array([0, 3, 2]), np.array([0, 1, -2]), np.array([0.1, 0.3, 0.2]), np.array([0.0, 0.1, -0.3]))
ZONES = Zones(replace(TERMS, back=0.0), SECOND, replace(SECOND, k=SECOND.k + 4, back=0.05))
FOUND = {
    "terms": TERMS,
    "zones": ZONES,
    "mirrored": replace(ZONES, sense=-1.0),
    "table": surface_of([TERMS], back=0.05),
    "large": surface_of([replace(TERMS, cos=300 * TERMS.cos)], back=7.0),
}


def read_back(text, form, a, b, way):
    """What a reader makes of a file who knows nothing but the file: its own few lines for each layout."""
    if form == "json":
        content = json.loads(text)
        back, table, rule = content["half_return_arcmin"], content.get("table_arcmin"), content.get("error", "")
        rows = [list(term.values()) for term in content.get("terms", [])]
    else:
        lines = text.splitlines()
        facts = dict(line[2:].split(": ", 1) for line in lines if line[0] == "#")
        rows = [[float(cell) for cell in line.split(",")] for line in lines if line[0].isdigit() or line[0] == "-"]
        back, rule = float(facts["half_return_arcmin"]), facts.get("error", "")
        table = [row[1:] for row in rows] if any(line.startswith("input_deg") for line in lines) else None
    if table is not None:
        return (
            RegularGridInterpolator(
                [np.linspace(0, 2 * np.pi, n + 1) for n in np.shape(table)], np.pad(table, (0, 1), mode="wrap")
            )((a % (2 * np.pi), b % (2 * np.pi)))
            + back * way
        )
    sums = np.zeros((3, len(a)))
    for k, j, c, s, *number in rows:
        sums[int(number[0]) if number else 0] += c * np.cos(k * a + j * b) + s * np.sin(k * a + j * b)
    return sums[0] + back * way + (sums[1:].min(axis=0) if "smaller" in rule else sums[1:].max(axis=0))


@pytest.mark.parametrize("name", FOUND)
@pytest.mark.parametrize("form", ["csv", "json"])
def test_a_file_says_all_that_a_reader_needs(name, form):
    """To 1e-6 arcmin, of small errors and of large ones."""
    found, way = FOUND[name], np.where(A > 0, 1.0, -1.0)
    read = read_back(written(found, form, {"drive": "test"}), form, A, B, way)
    assert read == pytest.approx(found.at(A, B, way), abs=1e-6)


@pytest.mark.parametrize("mirrored", [False, True])
def test_kinks_where_the_driving_zone_changes_are_kept_by_few_terms(mirrored):
    """The larger of two sums leaves a quarter at most of what one sum of as many harmonics leaves, as the zones
    themselves are smooth; fewer than eight terms are one sum. Errors as in the shipped tolerances."""
    model = CartesianModel.of(load_study(drive="csf-25-80").drive)
    errors = to_cartesian(DriveErrors(axis_eccentricity=0.008, wg_eccentricity=0.003, wg_eccentricity_direction=1.0,
        axis_tilt_x=0.001, cs_tooth_amplitude=0.002, fs_tooth_amplitude=0.002), model.half_width)  # fmt: skip
    sense = -1.0 if mirrored else 1.0
    theta = np.arange(80 * 90) * 2 * np.pi / 90
    true = sense * model.evaluate(theta, errors)[0]
    values = zone_values(Teeth.bare(model, errors, sense))
    found = in_terms(values, nothing(), sense, 64)
    one = surface_of([], driving(values, sense)).harmonics(64)
    left = [np.ptp(true - each.at(theta, theta / 80)) for each in (found, one)]
    assert len(found) <= 64
    assert left[0] < 0.25 * left[1]
    assert left[0] < 0.02 * np.ptp(true)
    assert isinstance(in_terms(values, nothing(), sense, 3), Harmonics)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("found", FOUND.values(), ids=FOUND)
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
