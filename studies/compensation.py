"""How much a compensation leaves on the concealed bench: `python -m hdopt.studies.compensation --cases 60 --seed 1`.

Each case is a drive of the bench (which shares no code with hdopt), half of them with one hidden effect. The
compensation is made from its recordings and tried on a fresh run of the last one: same motion, new noise. An oracle
takes away the true error, torque, time and temperature included, so only noise and the encoders' steps are left of it.
A second oracle takes away what a function of both shafts' angles can hold: the true error at the mean temperature and
torque (that of a load that hangs on the output's angle as it is) and without the balls, whose cage nobody sees.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: what the bench, which is imported late, has drawn

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import ARCMIN, Drive

if TYPE_CHECKING:
    import pandas as pd

SEVERITIES = (0.25, 0.5, 1.0)
FIFTH = 0.2


@dataclass(frozen=True)
class Case:
    """One case: peak-to-peak (arcmin) of the fresh run as it is, with the compensation, with the oracle, what was
    predicted, and with the oracle of both angles, `holdable`."""

    seed: int
    effect: str
    method: str
    worth: bool
    before: float
    after: float
    oracle: float
    predicted: float
    holdable: float


def error_of_angles(drawn: Any, last: int) -> Array:
    """What of the true error (n,) rad of the recording numbered `last` of a case `drawn` is one of both angles."""
    from hdopt.bench.signal_chain import read_error

    setup, load = drawn.setups[last], drawn.plans[last].torque
    run = replace(setup.run, body_k=np.full_like(setup.run.body_k, setup.run.body_k.mean()))
    if load is not None and load.shape != "pendulum":
        run = replace(run, torque=np.full_like(run.torque, run.torque.mean()))
    return np.asarray(read_error(replace(setup, run=run), [one for one in drawn.hidden if one.id != "bearing_pass"]))


def run_case(seed: int, effect: str, severity: float, drive: Drive, terms: int | None = 64) -> Case | None:
    """The case of `seed` with `effect` ("" for none) at `severity` (rms in units of the base's), on `drive`, with at
    most so many `terms` of the compensation (0: a table, None: as `--terms auto`).

    None where the bench cannot make the effect so large in this draw.
    """
    from hdopt.bench import cases
    from hdopt.bench.instrument import record
    from hdopt.bench.signal_chain import read_angles, read_error
    from hdopt.recordings.read import recording_from_table
    from hdopt.recordings.rows import gather
    from hdopt.workflow.compensate import compensate
    from hdopt.workflow.compensation_samples import samples_of
    from hdopt.workflow.compensation_trials import neighbours_of, said_of

    spec = cases.Spec("single" if effect else "nothing", seed, (effect,) if effect else (), severity)
    drawn = cases.simulate(spec, np.random.default_rng([seed, 7]))
    if drawn is None:
        return None
    seen = [recording_from_table(table, drive.geometry.ratio, name=f"run {k}") for k, table in enumerate(drawn.tables)]
    made = compensate(seen, drive, terms, seed)
    setup, last = drawn.setups[-1], len(drawn.plans) - 1
    rng = np.random.default_rng([seed, 8])
    angles = read_angles(setup, drawn.hidden)
    torque = drawn.torque_gain * setup.run.torque
    table, _ = record(drawn.instrument, last, drawn.plans[-1], setup.run, angles, torque, rng)
    fresh = recording_from_table(table, drive.geometry.ratio)
    truths = [error / ARCMIN for error in (read_error(setup, drawn.hidden), error_of_angles(drawn, last))]
    if len(truths[0]) != len(fresh):
        assert fresh.time is not None, "every table of the bench has its time"
        truths = [truth[np.searchsorted(table["time_s"].to_numpy(), fresh.time)] for truth in truths]
    neighbours = neighbours_of(seen)
    each = samples_of([fresh], gather([fresh], neighbours), neighbours).each
    left, held = (fresh.error_arcmin - one for one in truths)
    after = each.error - said_of(made.found, each)
    return Case(
        seed,
        effect,
        made.method,
        made.worth,
        float(np.ptp(each.error)),
        float(np.ptp(after)),
        float(np.ptp(left)),
        made.recordings[-1].expected,
        float(np.ptp(held)),
    )


def summary(frame: pd.DataFrame) -> list[str]:
    """The figures asked for, of a `frame` with one row a case."""
    written = frame[frame.worth]
    share = (written.after / written.before).median()
    off = (written.predicted / written.after - 1).abs()
    could = frame[frame.oracle < (1 - FIFTH) * frame.before]

    def against(oracle: str) -> str:
        left = (written[oracle] / written.before).median()
        ratios = (written.after / written[oracle]).median()
        return f"{left:.3f}, median of ratios {ratios:.3f}, quotient of medians {share / left:.3f}"

    return [
        f"{len(frame)} cases, {len(written)} written",
        f"median share of peak-to-peak left: {share:.3f}, oracle {against('oracle')}",
        f"oracle of both angles {against('holdable')}",
        f"predicted within 10 % of found: {(off <= 0.1).mean():.1%}, median off by {off.median():.1%}",
        f"worse than none: {(written.after > written.before).sum()} of {len(written)}",
        f"refused where the oracle removes a fifth: {(~could.worth).sum()} of {len(could)}",
    ]


def plan(seed: int, count: int) -> list[tuple[int, str, float]]:
    """`count` cases from `seed`: every other one clean, the others with each effect of the catalogue in turn."""
    from hdopt.bench.cases import CATALOGUE

    names = sorted(CATALOGUE)
    return [
        (1000 * seed + n, "" if n % 2 == 0 else names[n // 2 % len(names)], SEVERITIES[n // 2 % 3] if n % 2 else 0.0)
        for n in range(count)
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the cases that `arguments` name and write a line each, then the summary; finished lines are kept."""
    import pandas as pd

    from hdopt.files import to_csv, write_text
    from hdopt.study import load_study
    from hdopt.workflow.doing import still

    parser = argparse.ArgumentParser(prog="python -m hdopt.studies.compensation", description=__doc__)
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--skip", type=int, default=0, help="Leave out so many cases of the list's beginning.")
    parser.add_argument("--every", type=int, default=1, help="Of the cases that are left take every so many-th.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--terms", default="64", help="As of hdopt compensate.")
    parser.add_argument("--out", default="compensation.csv", help="One line a case; cases that stand there are kept.")
    options = parser.parse_args(arguments)
    drive = load_study(drive="csf-25-80").drive
    try:
        kept = pd.read_csv(options.out, keep_default_na=False)
    except FileNotFoundError:
        kept = pd.DataFrame()
    terms = None if options.terms == "auto" else int(options.terms)
    rows = kept.to_dict("records")
    done = {int(row["seed"]) for row in rows}
    listed = plan(options.seed, options.skip + options.cases)[options.skip :: options.every]
    asked = [one for one in listed if one[0] not in done]
    begun = time.monotonic()
    for number, (seed, effect, severity) in enumerate(asked):
        more = f", {still(begun, number, len(asked))}" if number else ""
        print(f"case {number + 1} of {len(asked)}: {effect or 'nothing'} hidden{more}", file=sys.stderr, flush=True)
        case = run_case(seed, effect, severity, drive, terms)
        if case is not None:
            rows.append({str(key): value for key, value in asdict(case).items()})
            write_text(Path(options.out), to_csv(pd.DataFrame(rows)))
    for line in summary(pd.DataFrame(rows)):
        print(line)


if __name__ == "__main__":
    main()
