"""A kernel gives the same bits in the process that compiles it and in one that loads it from disk."""

import json
import os
import struct
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

TESTS = Path(__file__).parents[1]
SCRIPT = """
import json, sys
from cases import drive, random_errors
from test_compiled_kernels import drawn_in
from hdopt.effects import EFFECTS
from hdopt.kinematics import kernel
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin
from hdopt.simulation import EffectValues, Operation
from hdopt.simulation.batch import stacked_peak_to_peak_arcmin, tabulate
from hdopt.simulation.beat import kernel as beat
from hdopt.simulation.turn import kernel as turn

(effect, _, example), of = sys.argv[1].partition("-"), drive()
rows = random_errors(1000, seed=1, scale=3.0).to_matrix()
if effect == "none":
    found = matrix_peak_to_peak_arcmin(of, rows)
else:
    values = EFFECTS[effect].values(EFFECTS[effect].examples[int(example or 0)], of.geometry)
    found = stacked_peak_to_peak_arcmin(of, rows, tabulate(of, [EffectValues(effect, *values)], Operation(speed=3.0)))
entries = (kernel.peak_to_peak_block, turn._fill, turn._fill_by_parts, turn._fill_by_waves, beat.beat_block)
libraries = [overload.library for each in entries for overload in each.overloads.values()]
compiled = [library._compiled_object for library in libraries if library._compiled_object]
print(json.dumps([found.tolist(), len(compiled), [name for code in compiled for name in drawn_in(code)]]))
"""
"""Compute 1000 drives, then look at what was compiled: none where it was loaded."""
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


class Computed(NamedTuple):
    """What a process `found` of 1000 drives, how many entries it compiled, and the functions beside these."""

    found: list[float]
    compiled: int
    others: list[str]


def computed(effect, environment):
    """What a process of its own says of `effect`."""
    command = [sys.executable, "-c", SCRIPT, effect]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    return Computed(*json.loads(done.stdout))


@pytest.mark.slow
@pytest.mark.compiles
@pytest.mark.parametrize("effect", ["none", "circular_spline_lobing", "tooth_mesh", "tooth_mesh-2", "bearing_pass"])
def test_who_compiles_finds_what_who_loads_does(effect, tmp_path):
    """To the bit: 20 to 33 % of drives with effects were others while some functions of a kernel were compiled for
    themselves, and once more with their caller. Then all calls go to the first copy that a process has: its own where
    it compiles, the caller's where it loads, another kernel's where that was loaded before. So there is but one."""
    path = os.pathsep.join([str(TESTS), str(TESTS / "unit"), os.environ.get("PYTHONPATH", "")])
    usual = os.environ | {"PYTHONPATH": path}
    first = computed(effect, usual)
    # Where nobody has compiled it yet, it is there for all tests now; elsewhere it is compiled once more, aside.
    second = computed(effect, usual if first.compiled else usual | {"NUMBA_CACHE_DIR": str(tmp_path)})
    assert {first.compiled, second.compiled} == {0, 1}
    assert not first.others + second.others
    assert first.found == second.found
