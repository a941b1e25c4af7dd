"""From ideal readings to a file's columns: resolution, noise, clocks, missing rows."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hdopt.bench import loops
from hdopt.bench.arrays import Array
from hdopt.bench.geometry import ARCMIN
from hdopt.bench.motion import Plan, Run


@dataclass(frozen=True)
class Instrument:
    """Measuring chain of one case."""

    input_step_deg: float
    output_step_deg: float
    noise_arcmin: float  # rms at the output
    noise_length: float  # correlation length of the noise, in samples
    jitter: float  # of both channels together, in sampling steps
    skew: float  # of one channel against the other, in sampling steps
    torque_noise_nm: float
    temperature_noise_k: float
    output_zero_deg: tuple[float, ...]  # one a recording
    gaps: int
    blanks: float  # share of rows with a value missing

    @property
    def noise_keep(self) -> float:
        return float(np.exp(-1 / self.noise_length)) if self.noise_length > 0.1 else 0.0

    def effective(self, samples: float) -> float:
        """Number of independent samples that the coloured noise leaves of `samples`."""
        return samples * (1 - self.noise_keep) / (1 + self.noise_keep)


def draw_instrument(rng: np.random.Generator, recordings: int, trouble: Set[str] = frozenset()) -> Instrument:
    """A measuring chain for so many `recordings`, drawn by `rng`.

    `trouble` may hold "coloured" (more noise, correlated over 20 to 150 samples), "gaps" (rows and values missing),
    "coarse" (an output encoder of 18 bits) and "clock" (a jitter of 5 to 30 % of a sampling step).
    """
    zero = rng.uniform(-20, 20)
    zeros = [zero] * recordings if rng.random() < 0.7 else list(rng.uniform(-20, 20, recordings))
    coloured = "coloured" in trouble
    return Instrument(
        input_step_deg=360 / 2.0 ** rng.integers(13, 18),
        output_step_deg=360 / 2.0 ** (18 if "coarse" in trouble else rng.integers(19, 23)),
        noise_arcmin=rng.uniform(0.05, 0.12) if coloured else np.exp(rng.uniform(np.log(0.008), np.log(0.04))),
        noise_length=rng.uniform(20, 150) if coloured else rng.uniform(0, 6),
        jitter=rng.uniform(0.05, 0.3) if "clock" in trouble else rng.uniform(0, 0.02),
        skew=rng.uniform(0, 2e-4),
        torque_noise_nm=rng.uniform(0.005, 0.05),
        temperature_noise_k=rng.uniform(0.01, 0.05),
        output_zero_deg=tuple(map(float, zeros)),
        gaps=int(rng.integers(2, 6)) if "gaps" in trouble else 0,
        blanks=rng.uniform(0.001, 0.01) if "gaps" in trouble else 0.0,
    )


def record(
    instrument: Instrument,
    rank: int,
    plan: Plan,
    run: Run,
    angles: tuple[np.ndarray, np.ndarray],
    torque: Array,
    rng: np.random.Generator,
) -> tuple[pd.DataFrame, np.ndarray]:
    """Recording `rank` as a table, and its noise (rad of kinematic error, mean removed).

    `instrument` writes what `plan` and `run` are and the ideal readings `angles` (input and output, (n,) rad each); a
    loaded plan has a column of `torque` (n,), Nm. Noise, skew and gaps come from `rng`.
    """
    input_angle, output_angle = angles
    n = run.time.size
    noise = instrument.noise_arcmin * ARCMIN * loops.first_order_noise(rng.standard_normal(n), instrument.noise_keep)
    skew = instrument.skew * run.step * rng.standard_normal(n)
    read_input = _quantised(np.rad2deg(input_angle), instrument.input_step_deg)
    true_output = np.rad2deg(output_angle)
    zero = instrument.output_zero_deg[rank]
    read_output = _quantised(
        true_output + np.rad2deg(noise + skew * run.speed / run.ratio) + zero, instrument.output_step_deg
    )
    columns = {"time_s": np.round(run.time, 7), "input_angle_deg": read_input, "output_angle_deg": read_output}
    if plan.torque is not None:
        columns["torque_Nm"] = np.round(torque + instrument.torque_noise_nm * rng.standard_normal(n), 4)
    if plan.log_temperature:
        measured = 21 + run.body_k + instrument.temperature_noise_k * rng.standard_normal(n)
        columns["temperature_C"] = np.round(measured, 3)
    error = np.deg2rad((read_input - np.rad2deg(input_angle)) / run.ratio - (read_output - true_output))
    return _with_gaps(instrument, pd.DataFrame(columns), rng), error - error.mean()


def _quantised(angle_deg: Array, step_deg: float) -> Array:
    return np.round(np.floor(angle_deg / step_deg + 0.5) * step_deg, 7)


def _with_gaps(instrument: Instrument, table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    if instrument.gaps:
        keep = np.ones(len(table), bool)
        for _ in range(instrument.gaps):
            at, length = rng.integers(len(table)), rng.integers(30, 300)
            keep[at : at + length] = False
        keep[[0, -1]] = True
        table = table[keep].reset_index(drop=True)
        blank = rng.random(len(table)) < instrument.blanks
        table.loc[blank, "output_angle_deg"] = np.nan
    return table
