"""The beat of measured teeth in lanes against the search over all phases, which is held to walks of the beat."""

from dataclasses import replace

import numpy as np
import pytest
from cases import CSF_25_80, PROFILES, drive, random_errors

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Structure
from hdopt.drive.profiles import Ellipse
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.kinematics.extremes import extremes_arcmin
from hdopt.kinematics.peak_to_peak import beat_extremes_arcmin, matrix_peak_to_peak_arcmin

ARCMIN = 1e-5
"""Both are right to rounding at the places where they look; what parabolas leave between them is below 1e-6 arcmin."""

SMOOTH = [name for name, profile in PROFILES.items() if profile.tip_is_smooth]


def with_teeth(design, seed=3, cs=True, fs=True, sigma=0.004):
    rng = np.random.default_rng(seed)
    gear = design.geometry
    teeth = [
        MeasuredTeeth.of(rng.normal(0, sigma, z), "single") for z in (gear.circular_spline_teeth, gear.flexspline_teeth)
    ]
    return replace(design, cs_teeth=teeth[0] if cs else None, fs_teeth=teeth[1] if fs else None)


def rows(n, seed, sines):
    matrix = random_errors(n, seed).to_matrix()
    if not sines:
        matrix[:, [8, 10]] = 0.0
    return matrix


def searched(design, matrix, **shares):
    return np.array([extremes_arcmin(design, DriveErrors.from_matrix(row), "closed form", **shares) for row in matrix])


@pytest.mark.parametrize("structure", Structure)
@pytest.mark.parametrize("name", SMOOTH)
def test_same_extremes_as_the_search_over_all_phases(name, structure):
    """A margin too small for what a cell can hide, a rim taken on the wrong side of a change, or a phase shifted by one
    changes these values by 1e-3 and more."""
    design = with_teeth(drive(PROFILES[name], structure))
    for sines in (False, True):
        matrix = rows(6, seed=11, sines=sines)
        assert beat_extremes_arcmin(design, matrix) == pytest.approx(searched(design, matrix), abs=ARCMIN)


@pytest.mark.parametrize(("cs", "fs"), [(True, False), (False, True)])
def test_one_spline_measured_and_a_sine_on_the_other(cs, fs):
    design, matrix = with_teeth(drive(), cs=cs, fs=fs), rows(8, seed=2, sines=True)
    assert beat_extremes_arcmin(design, matrix) == pytest.approx(searched(design, matrix), abs=ARCMIN)


@pytest.mark.parametrize("teeth", [60, 101, 202])
def test_other_numbers_of_teeth(teeth):
    """Odd ones meet in as many phases as there are teeth, and half a turn then lies between two phases."""
    radius = CSF_25_80.flexspline_inner_radius * teeth / 160
    gear = replace(CSF_25_80, flexspline_teeth=teeth, circular_spline_teeth=teeth + 2, flexspline_inner_radius=radius)
    profile = Ellipse.of_equal_perimeter(radius, radius + gear.module)
    design, matrix = with_teeth(drive(profile, geometry=gear), seed=5), rows(4, seed=7, sines=False)
    assert beat_extremes_arcmin(design, matrix) == pytest.approx(searched(design, matrix), abs=ARCMIN)


def test_teeth_of_every_size_and_none():
    """From teeth far better than the alignment to teeth that hide it; and without any error the drive has none."""
    matrix = rows(3, seed=4, sines=False)
    for sigma in (1e-7, 1e-4, 0.03):
        design = with_teeth(drive(), sigma=sigma)
        assert beat_extremes_arcmin(design, matrix) == pytest.approx(searched(design, matrix), abs=ARCMIN)
    flat = replace(drive(), cs_teeth=MeasuredTeeth.of(np.zeros(162)))
    assert matrix_peak_to_peak_arcmin(flat, np.zeros((1, 12))) == pytest.approx([0.0], abs=1e-12)


def test_shared_terms_are_those_of_the_search():
    design, matrix = with_teeth(drive(), fs=False), rows(4, seed=9, sines=True)
    scaled = matrix.copy()
    scaled[:, [8, 10]] *= 0.2
    found = beat_extremes_arcmin(design, matrix, misalignment=0.8, sine_share=0.2)
    assert found == pytest.approx(searched(design, scaled, misalignment=0.8), abs=ARCMIN)


def test_each_drive_its_own_teeth():
    """Tables drive by drive give what drives with those teeth give one at a time."""
    from hdopt.kinematics.load_sharing import mesh_tables

    designs = [with_teeth(drive(), seed) for seed in range(3)]
    tables = [mesh_tables(design) for design in designs]
    stacked = np.stack([cs for cs, _ in tables]), np.stack([fs for _, fs in tables])
    matrix = rows(3, seed=1, sines=False)
    one_by_one = [beat_extremes_arcmin(d, row[None, :])[0] for d, row in zip(designs, matrix, strict=True)]
    assert beat_extremes_arcmin(designs[0], matrix, stacked) == pytest.approx(np.array(one_by_one), abs=1e-12)
