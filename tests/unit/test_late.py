"""What a person waits for at the start: no compiler for one drive, and the same numbers to the bit without it."""

import importlib
import pkgutil
import subprocess
import sys

import numpy as np
import pytest
from cases import PROFILES, drive, random_errors
from scipy.interpolate import CubicSpline

import hdopt
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Structure
from hdopt.kinematics import essential, extremes
from hdopt.kinematics.extremes import periodic_spline
from hdopt.kinematics.inner import Inner
from hdopt.late import Late, late
from hdopt.mechanics import tooth_gap, tooth_path
from hdopt.mechanics.tooth_path import Mesh
from hdopt.recordings.orders import order_columns, order_spectrum


def run(*arguments: str) -> str:
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stderr
    return done.stdout


def test_one_drive_is_computed_without_the_compiler():
    """`ke` takes a third of the time without numba and SciPy: an import of either at the top of a module it reads."""
    said = run(
        "-c",
        "import sys; from hdopt.cli.app import cli; cli(['ke'], standalone_mode=False);"
        "print('loaded', sorted({'numba', 'scipy', 'pandas', 'plotly'} & sys.modules.keys()))",
    )
    assert said.splitlines()[-1] == "loaded []"


def test_the_package_runs_as_a_module():
    assert run("-m", "hdopt", "--help").startswith("Usage: hdopt [OPTIONS] COMMAND")


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
def test_extremes_are_the_same_as_python_and_compiled(profile, monkeypatch):
    design = drive(profile, Structure.ONE_WAY_MINOR)
    errors = DriveErrors.from_matrix(random_errors(1, 5, 2.0).to_matrix()[0])
    # On the very same arrays: sums of NumPy's before may differ in their last bit with where an array lies in memory.
    both, extremes_of = [], essential.essential_extremes

    def twice(mesh):
        both.append((extremes_of.plain(mesh), extremes_of.compiled(mesh)))
        return both[-1][0]

    monkeypatch.setattr(essential, "essential_extremes", twice)
    extremes.extremes_arcmin(design, errors)
    ((plain, compiled),) = both
    assert plain == compiled


def test_contact_is_the_same_as_python_and_compiled(monkeypatch):
    def figures() -> list[float]:
        mesh = Mesh(drive().geometry, drive().wave_generator.profile)
        own = [mesh.contact_angle, mesh.free_flank_angle(0.4, 0.04), mesh.largest_curvature_change]
        return [*own, mesh.trailing_flank_room(0.4, 0.04), mesh.tip_relief(0.4, 0.04)]

    compiled = figures()
    for module, names in (
        (tooth_path, ("_integrate", "_falls_to", "_free_angle", "_peak", "largest_overlap", "least_trailing_gap")),
        (tooth_gap, ("gap_at", "tooth_place", "deflection_at")),
    ):
        for name in names:
            monkeypatch.setattr(module, name, getattr(module, name).plain)
    assert figures() == compiled


def test_every_compiled_function_says_how_exact_its_sums_are():
    """A function that leaves `fastmath` out is compiled with that of the kernel that happens to call it first, and kept
    on disk so: its last bits then hang on the order of calls. Fault caught: the option left out anywhere.
    """
    from numba.core.dispatcher import Dispatcher

    silent = []
    for module in pkgutil.walk_packages(hdopt.__path__, "hdopt."):
        if module.name.endswith("__main__"):
            continue
        for name, value in vars(importlib.import_module(module.name)).items():
            compiled = value.compiled if isinstance(value, Late | Inner) else value
            if isinstance(compiled, Dispatcher) and "fastmath" not in compiled.targetoptions:
                silent.append(f"{module.name}.{name}")
    assert not silent


def test_python_comes_first_and_the_compiler_after(monkeypatch):
    """Only while the compiler is not loaded, and only so many times; numbers are Python's own either way."""

    @late(calls=2)
    def twice(x: float) -> float:
        return x * np.float64(2.0)

    monkeypatch.delitem(sys.modules, "numba")
    assert [twice(1.5), twice(2.5), twice.left, len(twice.compiled.signatures)] == [3.0, 5.0, 0, 0]
    assert type(twice(1.0)) is float
    assert len(twice.compiled.signatures) == 1


def test_the_periodic_spline_is_scipys():
    values = np.random.default_rng(3).normal(size=(2, 3, 37))
    theta = np.concatenate([np.linspace(-9.0, 15.0, 301), [0.0, 2 * np.pi, -1e-17]])
    nodes = np.linspace(0, 2 * np.pi, 38)
    expected = CubicSpline(nodes, np.concatenate([values, values[..., :1]], -1), axis=-1, bc_type="periodic")
    # Rounding of the angle's reduction, times slopes of a few units a cell.
    assert periodic_spline(values)(theta) == pytest.approx(expected(np.mod(theta, 2 * np.pi)), abs=1e-12)


@pytest.mark.parametrize("turns", [80, 20, 8, 3], ids=["well apart", "close", "just sound", "hardly apart"])
def test_orders_that_make_up_a_signal_come_back_to_rounding(turns):
    """Would catch normal equations without their correction: 3e-14 at 20 turns, 3e-12 at 8. At 3 turns they are left
    for orthogonal ones, which lose rounding times the condition of the columns, 600."""
    orders, rng = [2.0, 2.0125, 2.025, 5.0], np.random.default_rng(2)
    theta = np.sort(rng.uniform(0, 2 * np.pi * turns, 2000))
    truth = np.array([0.1, 0.96, 0.3, 0.2, 0.1, 0.0, 0.05, 0.3, 0.2])
    found = order_spectrum(theta, order_columns(theta, orders) @ truth, orders)
    assert found.amplitudes == pytest.approx(np.hypot(truth[1::2], truth[2::2]), abs=1e-15 if turns > 3 else 1e-12)
