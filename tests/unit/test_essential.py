"""Essential extremes: limits count, ties do not; both methods, the tooth's width, and one number in every command."""

import numpy as np
import pytest
from cases import BASE_ERRORS, PROFILES, drive, random_errors

from hdopt.drive.errors import ERROR_NAMES, DriveErrors
from hdopt.drive.geometry import DriveGeometry, Structure
from hdopt.kinematics import essential
from hdopt.kinematics.extremes import (
    converged_peak_to_peak_arcmin,
    extremes_arcmin,
    held_peak_to_peak,
    interpolated_waveform,
    tooth_width_peak_to_peak_arcmin,
    walked_peak_to_peak_arcmin,
)
from hdopt.kinematics.waveform import full_turn, kinematic_error_arcmin
from hdopt.recordings.orders import model_orders
from hdopt.study import load_study
from hdopt.workflow.kinematic_error import kinematic_error
from hdopt.workflow.steps import Context
from hdopt.workflow.steps.waveform import waveform as waveform_step

EVERY_STRUCTURE = pytest.mark.parametrize("structure", Structure, ids=lambda structure: structure.value)
SMOOTH = {name: profile for name, profile in PROFILES.items() if profile.tip_is_smooth}


def one(seed: int, scale: float = 1.0) -> DriveErrors:
    return DriveErrors.from_matrix(random_errors(1, seed, scale).to_matrix()[0])


@EVERY_STRUCTURE
@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
def test_walks_approach_the_essential_extremes_from_inside(profile, structure):
    """A sampled waveform meets no tie of measure zero at an irrational step, so it can only lie inside."""
    design, errors = drive(profile, structure), one(3)
    theta = np.arange(80 * 1500) * (2 * np.pi / 1500.0137)
    values = interpolated_waveform(design, errors)(theta)
    low, high = extremes_arcmin(design, errors)
    assert low <= values.min() + 1e-6
    assert high >= values.max() - 1e-6
    # The walk's own step: slopes of 0.6 arcmin/rad over half a cell, and slivers narrower than a cell.
    assert values.min() - low < 5e-3
    assert high - values.max() < 2e-4


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_rims_that_only_tie_do_not_count(scale):
    """Aligned both ways, both zones change rims at the same angles; rounding must not pair rims that never meet.

    Counting such pairs gave up to 0.5 % too much here, 2.4 % at three times the errors.
    """
    for seed in range(6):
        errors = one(seed, scale)
        aligned = converged_peak_to_peak_arcmin(drive(structure=Structure.AUTOMATIC), errors)
        without = errors.with_(axis_eccentricity=0.0, wg_eccentricity=0.0)
        assert converged_peak_to_peak_arcmin(drive(), without) == pytest.approx(aligned, abs=1e-9)
        # The pair that never meets sinks below the walk by much more than the walk's step explains.
        theta = np.arange(80 * 7200) * (2 * np.pi / 7200.0137)
        walked = np.ptp(interpolated_waveform(drive(), without)(theta))
        assert aligned < walked + 6e-4 * scale


@pytest.mark.parametrize("profile", SMOOTH.values(), ids=SMOOTH.keys())
@EVERY_STRUCTURE
@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_exact_geometry_and_closed_form_agree(profile, structure, scale):
    """The difference of the two methods: third order in the errors, so 27 times larger at three times their size.

    Without the twist of two tilts the one-way minor structure is off by up to 0.005 and 0.04 arcmin.
    """
    design = drive(profile, structure)
    for seed in range(12):
        errors = one(seed, scale)
        exact, closed = (converged_peak_to_peak_arcmin(design, errors, m) for m in ("exact", "closed form"))
        assert closed == pytest.approx(exact, abs=4e-5 * scale**3)


@pytest.mark.parametrize("teeth", [60, 61, 101, 320, 640])
def test_methods_agree_at_other_ratios(teeth):
    module = 0.396 * 160 / teeth
    design = drive(geometry=DriveGeometry(teeth, teeth + 2, module, 0.2094, 30.65))
    exact, closed = (converged_peak_to_peak_arcmin(design, BASE_ERRORS, m) for m in ("exact", "closed form"))
    assert closed == pytest.approx(exact, abs=1e-3)


@EVERY_STRUCTURE
@pytest.mark.parametrize("name", [name for name in ERROR_NAMES if not name.endswith(("phase", "direction"))])
def test_one_error_alone_needs_few_cells(name, structure, monkeypatch):
    """Some make no kinematic error but rounding, alike in every cell: an eccentric wave generator of the aligned drive
    had all 86,000 cells followed, minutes of Python. A command looks into them as Python, hence the count.
    """
    followed = []

    def counted(*args):
        followed.append(args)
        assert len(followed) < 1000
        return follow(*args)

    follow = essential._extreme_in_cell
    monkeypatch.setattr(essential, "_extreme_in_cell", counted)
    monkeypatch.setattr(essential, "essential_extremes", essential.essential_extremes.plain)
    size = 1e-4 if "tilt" in name else 0.005
    low, high = extremes_arcmin(drive(structure=structure), DriveErrors(**{name: size}))
    assert high >= low


def test_the_base_case():
    """1.369 is the limit of ever finer walks (physics: 1.3693 at 0.05 deg); 1.358 holds over a tooth's width."""
    assert converged_peak_to_peak_arcmin(drive(), BASE_ERRORS) == pytest.approx(1.3694, abs=1e-4)
    assert tooth_width_peak_to_peak_arcmin(drive(), BASE_ERRORS) == pytest.approx(1.358, abs=1e-3)
    exact, closed = (walked_peak_to_peak_arcmin(drive(), BASE_ERRORS, 0.01, 2, m) for m in ("exact", "closed form"))
    assert exact == pytest.approx(closed, abs=1e-4)


def test_interpolated_waveform_is_the_waveform():
    theta = np.random.default_rng(1).uniform(0, 500, 400)
    for method in ("exact", "closed form"):
        expected = kinematic_error_arcmin(drive(), BASE_ERRORS, theta, method)
        # Where a rim changes within rounding of an angle, either side is right; none of these angles is one.
        assert interpolated_waveform(drive(), BASE_ERRORS, method)(theta) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("shape", "held"),
    [
        (lambda x: np.abs(np.mod(x, 2.0) - 1.0), 1.0 - 0.25),
        (lambda x: np.where(np.mod(x, 2.0) < 0.2, 1.0, 0.0), 0.0),
        (lambda x: np.where(np.mod(x, 2.0) < 0.3, 1.0, 0.0), 1.0),
    ],
    ids=["triangle", "pulse narrower than the window", "pulse wider than the window"],
)
def test_what_holds_over_a_window(shape, held):
    theta = np.arange(200) * 0.01
    # The finer grid has 256 places a window of 0.25: a triangle of slope 1 is met within 1e-3 at both ends.
    assert held_peak_to_peak(shape, theta, shape(theta), 0.25) == pytest.approx(held, abs=4e-3)


def test_no_order_left_out_is_larger_than_one_listed():
    values = interpolated_waveform(drive(), BASE_ERRORS)(full_turn(drive(), 720))
    amplitudes = 2 * np.abs(np.fft.rfft(values)) / len(values)
    listed = {round(order.order * 80) for order in model_orders(80)}
    smallest = min(amplitudes[index] for index in listed)
    left_out = {i: a for i, a in enumerate(amplitudes) if i > 0 and i not in listed and a > smallest}
    assert not left_out


def test_every_command_gives_the_same_number(tmp_path):
    study = load_study(drive="csf-25-80")
    of_ke = kinematic_error(study)
    of_run = waveform_step(study, Context(tmp_path)).results
    assert of_run["peak_to_peak_arcmin"] == of_ke.peak_to_peak_arcmin
    assert of_run["method"] == of_ke.method == "exact"
    closed = kinematic_error(study, method="closed form")
    assert closed.method == "closed form"
    assert 0 < abs(closed.peak_to_peak_arcmin - of_ke.peak_to_peak_arcmin) < 1e-4
