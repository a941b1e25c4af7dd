"""Measure what hdopt computes with and write docs/benchmarks.md: `python -m tests.benchmarks.page [--print]`.

Everything is processor time of one thread, the best of a few, in one run: so a busy machine disturbs it least, and what
counts are the ratios. `--print` leaves the page and its picture as they are.
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from datetime import date
from math import radians
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from cases import CSF_25_80, drive, random_errors

from hdopt.drive.errors import DriveErrors
from hdopt.effects import EFFECTS
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin, walked_peak_to_peak_arcmin
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin
from hdopt.parallel.engine import engine_in_force
from hdopt.simulation import EffectValues, Operation
from hdopt.simulation.batch import matrix_peak_to_peak_arcmin as turn_by_turn
from hdopt.simulation.batch import stacked_peak_to_peak_arcmin as with_effects
from hdopt.simulation.batch import tabulate
from hdopt.tolerance.fused import fused_pass
from hdopt.tolerance.sampling import ScrambledSobol
from hdopt.tolerance.sensitivity import run_sobol
from hdopt.tolerance.space import InputSpace
from hdopt.workflow.stack import study_problem
from tests.benchmarks import growth
from tests.benchmarks.peak import multiply_adds_per_ns
from tests.benchmarks.test_peak_to_peak_speed import fixed_angles

PAGE = Path(__file__).resolve().parents[2] / "docs" / "benchmarks.md"
DRIVES, SOME = 2**16, 400
BEST_OF = 5


def seconds_of(call: Callable[[], object], times: int = BEST_OF) -> float:
    """Processor time of this thread for one call, the best of so many."""
    found = []
    for _ in range(times):
        start = time.thread_time()
        call()
        found.append(time.thread_time() - start)
    return min(found)


@dataclass(frozen=True)
class Row:
    """One way to a number: what it is, seconds, and of how many drives (or analyses)."""

    name: str
    seconds: float
    count: int

    @property
    def ns(self) -> float:
        return 1e9 * self.seconds / self.count


LOBING = EffectValues("circular_spline_lobing", {"lobes": 6}, (0.001, 0.0005))
MESH = EffectValues("tooth_mesh", {"sidebands": (0,)}, (0.02, 0.01))
TEETH = EFFECTS["tooth_mesh"]
IN_ZONES = EffectValues(TEETH.id, *TEETH.values(TEETH.examples[2], CSF_25_80))
BEARING = EFFECTS["bearing_pass"]
CAGE = EffectValues(BEARING.id, *BEARING.values(BEARING.examples[1], CSF_25_80))
ENCODER, WAVES = (EFFECTS[name] for name in ("encoder_output_eccentricity", "fs_tooth_harmonics"))
OUTPUT = EffectValues(ENCODER.id, *ENCODER.values(ENCODER.examples[0], CSF_25_80))
DEFECT, OF_LINES = (EFFECTS[name] for name in ("local_tooth_defect", "encoder_interpolation"))
DAMAGED = EffectValues(DEFECT.id, *DEFECT.values(DEFECT.examples[0], CSF_25_80))
LINES = EffectValues(OF_LINES.id, *OF_LINES.values(OF_LINES.examples[1], CSF_25_80))
ON_FS = EffectValues(WAVES.id, *WAVES.values(WAVES.examples[0], CSF_25_80))
BENCHES = {
    "none": ([], DRIVES // 4),
    "lobes, every input turn": ([LOBING], DRIVES // 4),
    "a ripple at the teeth": ([MESH], DRIVES // 16),
    "a ripple inside the zones": ([IN_ZONES], DRIVES // 128),
    "a bearing's cage, no whole turn": ([CAGE], DRIVES // 16),
    "an output encoder off its centre": ([OUTPUT], DRIVES // 16),
    "waves of the FS teeth": ([ON_FS], DRIVES // 16),
    "a damaged FS tooth": ([DAMAGED], DRIVES // 64),
    "an output encoder of 4001 lines": ([LINES], DRIVES // 64),
}
"""Effects, and of how many drives."""


def drives() -> Iterable[Row]:
    """One drive's converged peak-to-peak, by every way there is."""
    design, matrix = drive(), random_errors(DRIVES, seed=0).to_matrix()
    few = [DriveErrors.from_matrix(row) for row in matrix[:4]]
    matrix_peak_to_peak_arcmin(design, matrix[:10])
    yield Row("compiled kernel", seconds_of(lambda: matrix_peak_to_peak_arcmin(design, matrix)), DRIVES)
    for name, (effects, count) in BENCHES.items():
        table = tabulate(design, effects, Operation())
        with_effects(design, matrix[:2], table)
        taken = seconds_of(lambda t=table, n=count: with_effects(design, matrix[:n], t), 3)
        yield Row(f"compiled, with effects: {name}", taken, count)
    some = random_errors(200, seed=0)
    yield Row("NumPy, one turn at 180 fixed angles (1-3 % low)", seconds_of(lambda: fixed_angles(design, some)), 200)
    for step, whose in ((10, ", as Jia 2021 publishes"), (1, "")):

        def walk(step=step):
            return [walked_peak_to_peak_arcmin(design, e, radians(step), 80, "closed form") for e in few]

        yield Row(f"NumPy, 80 turns at {step} deg{whose}", seconds_of(walk, 3), len(few))

    def exact():
        return [converged_peak_to_peak_arcmin(design, e) for e in few]

    yield Row("exact geometry, converged", seconds_of(exact, 3), len(few))


def stacks() -> Iterable[Row]:
    """A stack's drives from nothing: points, quantiles, errors, peak-to-peak."""
    problem = study_problem("csf-25-80")
    space, response, sampling = problem.space, problem.response, ScrambledSobol()
    fused = fused_pass(response, space)

    def one_pass():
        return fused.of_sobol(sampling.scrambling(1, 0, DRIVES, space.dimension), 0, DRIVES)

    def points():
        return next(sampling.blocks(1, 0, DRIVES, space.dimension))

    one_pass()
    u = points()
    yield Row("one compiled pass, kernel included", seconds_of(one_pass), DRIVES)
    yield Row("general path, kernel included", seconds_of(lambda: response(space.sample(points()))), DRIVES)
    yield Row("points alone, SciPy", seconds_of(points), DRIVES)
    yield Row("quantiles alone, scipy.special", seconds_of(lambda: space.sample(u)), DRIVES)
    yield from _openturns(space)


def _openturns(space: InputSpace) -> Iterable[Row]:
    """The same points and quantiles by OpenTURNS, without a drive; nothing where it is not installed."""
    try:
        import openturns as ot
    except ImportError:
        return
    marginals = []
    for one in space.marginals:
        low, high = one.support
        if one.name == "normal":
            marginals.append(ot.TruncatedNormal(one.mean, one.std, low, high))
        elif one.name == "rayleigh":
            marginals.append(ot.TruncatedDistribution(ot.Rayleigh(one.scale), low, high))
        else:
            marginals.append(ot.Uniform(low, high))
    experiment = ot.LowDiscrepancyExperiment(ot.SobolSequence(), ot.JointDistribution(marginals), DRIVES)
    yield Row("points and quantiles alone, OpenTURNS", seconds_of(experiment.generate, 3), DRIVES)


def indices() -> Iterable[Row]:
    """Sobol' indices with second order and intervals of 12 inputs, 2^12 base points."""
    problem, n = study_problem("csf-25-80"), 2**12
    space = InputSpace(problem.space.tolerances)
    run_sobol(problem.response, space, n=2**8, engine="process")
    yield Row(
        "hdopt, drives included", seconds_of(lambda: run_sobol(problem.response, space, n=n, engine="process"), 3), 1
    )
    try:
        from SALib.analyze import sobol as salib
    except ImportError:
        return
    y = np.random.default_rng(0).random(n * (2 * space.dimension + 2))
    names = {"num_vars": space.dimension, "names": list(space.names), "bounds": [[0, 1]] * space.dimension}
    yield Row(
        "SALib's analyze alone, 100 resamples", seconds_of(lambda: salib.analyze(names, y, num_resamples=100), 1), 1
    )


Sizes = list[tuple[int, float]]
"""Sizes and the seconds that each takes."""


def growth_of_stacks() -> Iterable[tuple[str, Sizes]]:
    """How a stack and its indices grow with drives and inputs."""
    problem, sampling = study_problem("csf-25-80"), ScrambledSobol()
    space = problem.space
    fused = fused_pass(problem.response, space)
    scrambling = sampling.scrambling(1, 0, 2**20, space.dimension)
    yield (
        "drives of a stack",
        [(n, seconds_of(lambda n=n: fused.of_sobol(scrambling, 0, n), 3)) for n in (2**12, 2**14, 2**16, 2**18)],
    )
    parts = {d: InputSpace(dict(list(space.tolerances.items())[:d])) for d in (3, 6, 12)}
    points = {d: next(sampling.blocks(1, 0, DRIVES, d)) for d in parts}
    yield (
        "inputs: quantiles of the general path",
        [(d, seconds_of(lambda d=d: parts[d].sample(points[d]))) for d in parts],
    )

    def total(x):
        return x.sum(axis=1)

    yield (
        "inputs: Sobol' indices with second order",
        [(d, seconds_of(lambda d=d: run_sobol(total, parts[d], n=2**12, engine="process"), 3)) for d in parts],
    )


def growth_with_effects() -> Iterable[tuple[str, Sizes]]:
    """How drives with effects, turn by turn, grow with turns, samples and effects."""
    matrix, found = random_errors(SOME, seed=0).to_matrix(), Sizes()
    for teeth in (80, 160, 320):
        gear = drive(geometry=replace(CSF_25_80, flexspline_teeth=teeth, circular_spline_teeth=teeth + 2))
        added = tabulate(gear, [LOBING], Operation())
        found.append((teeth // 2, seconds_of(lambda g=gear, t=added: turn_by_turn(g, matrix, t), 3)))
    yield "input turns of a relative turn: drives with an effect, turn by turn", found
    design, found = drive(), Sizes()
    for lobes in (40, 80, 160):
        added = tabulate(design, [replace(LOBING, shape={"lobes": lobes})], Operation())
        found.append((added.zones.shape[2], seconds_of(lambda t=added: turn_by_turn(design, matrix, t), 3)))
    yield "samples of a relative turn: drives with an effect of rising order, turn by turn", found
    tables, many = Sizes(), Sizes()
    for count in (1, 2, 4, 8):
        effects = [replace(LOBING, shape={"lobes": 2 + k}) for k in range(count)]
        tables.append((count, seconds_of(lambda e=effects: tabulate(design, e, Operation()), 3)))
        added = tabulate(design, effects, Operation())
        many.append((count, seconds_of(lambda t=added: turn_by_turn(design, matrix, t), 3)))
    yield "effects: their table, once a stack", tables
    yield "effects: drives under it, turn by turn", many


def exponent(sizes: Sizes) -> float:
    """The slope of the logarithm of time over that of size, by least squares."""
    x, y = np.log(np.array(sizes, float)).T
    return float(np.polyfit(x, y, 1)[0])


def machine() -> str:
    """Processor, threads and versions."""
    import numba
    import scipy

    from hdopt.parallel.workers import cores

    name = platform.processor() or platform.machine()
    about = Path("/proc/cpuinfo")
    if about.is_file():
        models = [line.split(":")[1].strip() for line in about.read_text().splitlines() if "model name" in line]
        name = models[0] if models else name
    versions = f"NumPy {np.__version__}, SciPy {scipy.__version__}, Numba {numba.__version__}"
    return f"{name}, {cores()} threads, Python {platform.python_version()}, {versions}"


def table(rows: Iterable[Row], unit: str, peak: float | None) -> list[str]:
    """Lines of a table of `rows`: the first row's time is one; multiply-adds in the same time where `peak` is known."""
    lines, first = [], None
    head = ["", unit, "times the first"] + (["multiply-adds in that time"] if peak else [])
    lines += ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1)]
    for row in rows:
        first = first or row.ns
        ratio = row.ns / first
        cells = [row.name, f"{row.ns / (1 if peak else 1e6):,.0f}", f"{ratio:,.2f}" if ratio < 10 else f"{ratio:,.0f}"]
        cells += [f"{row.ns * peak:,.0f}"] if peak else []
        lines.append("| " + " | ".join(cells) + " |")
        print(lines[-1], flush=True)
    return lines


TOP = """# Benchmarks

Written by `python -m tests.benchmarks.page`, which `make benchmark` runs first. Processor time of one thread, best of
a few, in one run: on another machine the seconds differ, the ratios less.

- Measured {date}.
- Machine: {machine}.
- Peak of one thread in this run: {single:.0f} multiply-adds a nanosecond in single precision, {double:.0f} in double
  (chains of sixteen over 4096 numbers, `tests/benchmarks/peak.py`).

## One drive's converged peak-to-peak
"""
ON_DRIVES = """
Here a drive counts one direction. Wanted are 4 us where effects differ from turn to turn (from the bearing's cage down)
and 10 base kernels for a ripple at the teeth, which keeps them: some eight of its troughs a drive are measured without
slopes, of which hardly more than one is looked at. What misses them looks at more: waves of the FS at some 23 cells in
every turn and 20 places, a damaged tooth and an encoder of 4001 lines at 14 to 20 cells in every turn, then at 17 to 27
of these part by part, and a ripple inside the zones at all of its troughs and crests within second order of the best.
There the envelopes of both zones are taken as if their waves always met, so that more cells are parted than hold an
extreme.

The walks are what a plain program does and what Jia 2021's figures come from; on a fixed grid they stay below the
converged value. Multiply-adds are those in single precision that the machine makes at its peak in the same time: what a
way costs, not what it counts.

## A stack's drive, from its point on

12 inputs of csf-25-80, 65,536 drives.
"""
ON_INDICES = """
## Sobol' indices

12 inputs, second order, intervals, 2^12 base points.
"""
ON_GROWTH = """
## Growth

Time goes as the size to the power of the exponent, fitted over the sizes named. How a diagnosis takes its time is
measured by `tests/benchmarks/test_diagnosis_speed.py`.

![Time over size, both as multiples of the first, with the exponent of each](benchmarks-growth.svg)

| what grows | sizes | seconds | exponent |
|---|---|---|---:|"""


def page() -> str:
    """The page, measured now."""
    with engine_in_force("process"):
        single, double = multiply_adds_per_ns(seconds_of), multiply_adds_per_ns(seconds_of, np.float64)
        lines = [TOP.format(date=date.today(), machine=machine(), single=single, double=double)]
        lines += [*table(drives(), "ns a drive", single), ON_DRIVES, *table(stacks(), "ns a drive", single)]
        lines += [ON_INDICES, *table(indices(), "ms", None), ON_GROWTH]
        for name, sizes in (*growth_of_stacks(), *growth_with_effects()):
            of, seconds = ", ".join(f"{n:,}" for n, _ in sizes), ", ".join(f"{s:.3g}" for _, s in sizes)
            lines.append(f"| {name} | {of} | {seconds} | {exponent(sizes):.2f} |")
            print(lines[-1], flush=True)
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the measurements and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.page", description=__doc__.splitlines()[0])
    parser.add_argument("--print", action="store_true", dest="only_print")
    only_print = parser.parse_args().only_print
    text = page()
    if not only_print:
        PAGE.write_text(text, encoding="utf-8")
        growth.write()


if __name__ == "__main__":
    main()
