"""A kernel gives the same bits in the process that compiles it and in one that loads it from disk."""

import json
import os
import struct
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from cases import PROFILES, drive, random_errors

TESTS = Path(__file__).parents[1]
SYMBOLS, FUNCTION, WEAK = 2, 2, 2
"""A section's type, a symbol's type and its binding in ELF."""


def drawn_in(code):
    """Names of hdopt's functions that stand beside the entry's own in an object file (ELF, 64 bits)."""
    (start,), (size, count) = struct.unpack_from("<Q", code, 0x28), struct.unpack_from("<HH", code, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", code, start + k * size) for k in range(count)]
    for _, kind, _, _, offset, length, link, *_ in sections:
        for at in range(offset, offset + length if kind == SYMBOLS else offset, 24):
            name, info, _, section = struct.unpack_from("<IBBH", code, at)
            if info == (WEAK << 4 | FUNCTION) and section:
                begin = sections[link][4] + name
                text = code[begin : code.index(b"\0", begin)].decode()
                if "hdopt" in text:
                    yield text


def rows_of(n):
    """Errors of `n` drives, three times as large as the shipped tolerances let them be."""
    return random_errors(n, seed=1, scale=3.0).to_matrix()


def of_errors():
    """Peak-to-peaks of drives by their errors alone."""
    from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin

    return matrix_peak_to_peak_arcmin(drive(), rows_of(1000))


def table_of(effect, example):
    """An `example` of an `effect` as kernels take it."""
    from hdopt.effects import EFFECTS
    from hdopt.simulation import EffectValues, Operation
    from hdopt.simulation.batch import tabulate

    values = EFFECTS[effect].values(EFFECTS[effect].examples[example], drive().geometry)
    return tabulate(drive(), [EffectValues(effect, *values)], Operation(speed=3.0))


def stacked(effect, example=0):
    """Asks for peak-to-peaks of a stack's drives with an `example` of an `effect`."""

    def found():
        from hdopt.simulation.batch import stacked_peak_to_peak_arcmin

        return stacked_peak_to_peak_arcmin(drive(), rows_of(1000), table_of(effect, example))

    return found


def one_by_one():
    """The same in double precision, of a few drives with lobes."""
    from hdopt.simulation.batch import matrix_peak_to_peak_arcmin

    return matrix_peak_to_peak_arcmin(drive(), rows_of(20), table_of("circular_spline_lobing", 0))


def walked():
    """The same over all input angles, of a drive with friction."""
    from hdopt.simulation.batch import local_extremes

    row, table = rows_of(1)[0], table_of("hysteresis", 0)
    return np.concatenate([one.values(drive(), row, table) for one in local_extremes(drive(), row, table, 2)])


def over_the_beat(profile):
    """Asks for the extremes over all input turns of drives with a cam of this `profile`."""

    def found():
        from hdopt.kinematics.peak_to_peak import beat_extremes_arcmin

        return beat_extremes_arcmin(drive(PROFILES[profile]), rows_of(20))

    return found


def one_drive_exactly():
    """The extremes over all input turns of one drive after the other, by the exact geometry."""
    import numba  # noqa: F401  # without it a few drives are gone through as Python

    from hdopt.drive.errors import DriveErrors
    from hdopt.kinematics.extremes import extremes_arcmin

    return np.array([extremes_arcmin(drive(), DriveErrors.from_matrix(row), "exact") for row in rows_of(5)])


def in_one_pass(points):
    """Asks for a stack in one pass, of ready `points` or of Sobol' points that it makes."""

    def found():
        from test_fused_stack import problem_of

        from hdopt.tolerance.distributions import HalfNormal
        from hdopt.tolerance.fused import fused_pass
        from hdopt.tolerance.sampling import ScrambledSobol

        problem = problem_of(HalfNormal(scale=0.004))
        made, dimension, n = fused_pass(problem.response, problem.space), problem.space.dimension, 4096
        if points:
            return made.of_points(np.random.default_rng(0).random((n, dimension)))
        return made.of_sobol(ScrambledSobol().scrambling(1, 0, n, dimension), 0, n)

    return found


def of_slopes():
    """Extremes of drives, and what each measure of the cam moves them by."""
    from hdopt.drive.errors import DriveErrors
    from hdopt.kinematics.gradients import extremes

    return np.concatenate([np.ravel(one) for one in extremes(drive(), DriveErrors.from_matrix(rows_of(20)))])


def of_a_fit():
    """Where a few steps down from a first guess end."""
    from test_linear_terms import LINEAR, fit_of, problem_of, terms_of

    from hdopt.diagnosis.inference.descent import refine
    from hdopt.kinematics.cartesian import CartesianModel

    problem = problem_of(CartesianModel.of(drive()))
    return refine(fit_of(problem, terms_of(problem.rows, LINEAR["all"])), 3, 0.0).errors


class Kernel(NamedTuple):
    """Where a kernel is, below `hdopt` and with its name, and what `asks` for numbers of it."""

    place: str
    asks: Callable[[], np.ndarray]


# Those that take longest to compile first, and all that others begin with before these.
KERNELS = {
    "mesh": Kernel("simulation.turn.kernel._fill_by_waves", stacked("tooth_mesh")),
    "beat": Kernel("kinematics.teeth_kernel.beat_extremes_block", over_the_beat("ellipse")),
    "bearing": Kernel("simulation.beat.kernel.beat_block", stacked("bearing_pass")),
    "mesh of both zones": Kernel("simulation.turn.kernel._fill_by_parts", stacked("tooth_mesh", 2)),
    "lobes": Kernel("simulation.turn.kernel._fill", stacked("circular_spline_lobing")),
    "fit": Kernel("diagnosis.inference.compiled_descent.descended", of_a_fit),
    "cells": Kernel("simulation.cell_kernel.extended_block", one_by_one),
    "one pass of Sobol' points": Kernel("tolerance.fused_kernel.sobol_block", in_one_pass(points=False)),
    "one pass of ready points": Kernel("tolerance.fused_kernel.points_block", in_one_pass(points=True)),
    "errors": Kernel("kinematics.kernel.peak_to_peak_block", of_errors),
    "slopes": Kernel("kinematics.gradients._extremes", of_slopes),
    "one drive": Kernel("kinematics.essential.essential_extremes", one_drive_exactly),
    "walk": Kernel("simulation.walk_kernel.extended_walk", walked),
    "beat of a measured cam": Kernel("kinematics.contour_kernel.contour_extremes_block", over_the_beat("measured")),
}
IN_PIECES = {"slopes": (), "one drive": (), "beat": (), "beat of a measured cam": ("beat",)}
"""Kernels of which functions stand beside the entry, and those that have some of the same, after which they are asked
again. Those of slopes and of one drive contract nothing, so that every copy has the same bits; those of the beat take
half as long again to compile in one piece, or twice, and are no faster.
"""


class Computed(NamedTuple):
    """What a process `found`, how often it compiled the kernel, and the functions that stand beside it."""

    found: list[float]
    compiled: int
    others: list[str]


def say(name, *before):
    """Prints what this process finds by the kernel called `name`, once it has asked others (`before`), and what it
    compiled for it: none where it loaded."""
    kernel = KERNELS[name]
    for other in before:
        KERNELS[other].asks()
    found = np.ravel(kernel.asks()).tolist()
    module, _, attribute = kernel.place.rpartition(".")
    entry = getattr(import_module(f"hdopt.{module}"), attribute)
    libraries = [overload.library for overload in getattr(entry, "compiled", entry).overloads.values()]
    compiled = [library._compiled_object for library in libraries if library._compiled_object]
    print(json.dumps([found, len(compiled), [name for code in compiled for name in drawn_in(code)]]))


def computed(environment, name, *before):
    """What a process of its own says of the kernel called `name`, once it has asked others (`before`)."""
    command = [sys.executable, "-c", f"import test_compiled_kernels as asked; asked.say(*{(name, *before)!r})"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    return Computed(*json.loads(done.stdout))


@pytest.mark.slow
@pytest.mark.compiles
@pytest.mark.parametrize("kernel", KERNELS)
def test_who_compiles_finds_what_who_loads_does(kernel, tmp_path):
    """To the bit: 20 to 33 % of drives with effects were others while some functions of a kernel were compiled for
    themselves, and once more with their caller. Then all calls go to the first copy that a process has: its own where
    it compiles, the caller's where it loads, another kernel's where that was loaded before. So there is but one."""
    path = os.pathsep.join([str(TESTS), str(TESTS / "unit"), os.environ.get("PYTHONPATH", "")])
    usual = os.environ | {"PYTHONPATH": path}
    first = computed(usual, kernel)
    # Where nobody has compiled it yet, it is there for all tests now; elsewhere it is compiled once more, aside.
    second = computed(usual if first.compiled else usual | {"NUMBA_CACHE_DIR": str(tmp_path)}, kernel)
    assert {first.compiled, second.compiled} == {0, 1}
    assert first.found == second.found
    if kernel not in IN_PIECES:
        assert not first.others + second.others
    elif IN_PIECES[kernel]:
        assert computed(usual, kernel, *IN_PIECES[kernel]).found == first.found
