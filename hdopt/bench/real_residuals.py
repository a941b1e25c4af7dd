"""Known physics put on the residuals of real recordings: noise that nobody drew from a distribution.

Whoever calls hands in what a fit left of a real recording (arcmin), as no fit is made here. `on_real_motion` puts
play, friction or a delay of this bench on the recording's own motion and residual; `on_simulated_drive` records a drive
of the bench, with any physics of the catalogue in it, through a chain whose only noise is the real one, scaled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from hdopt.bench import loops
from hdopt.bench.arrays import Array
from hdopt.bench.cases import CATALOGUE, scaled_to
from hdopt.bench.geometry import ARCMIN, draw_errors
from hdopt.bench.motion import draw_plans, run
from hdopt.bench.signal_chain import joint_rms, read_angles, read_error, set_up

ATTEMPTS = 14
BLOCK = 100


@dataclass(frozen=True)
class RealResidual:
    """What is left of one real recording: time (s), input angle (rad), residual (arcmin), gear ratio."""

    time: Array
    input_angle: Array
    residual: Array
    ratio: float

    @property
    def rms(self) -> float:
        return float(np.std(self.residual))


def friction(real: RealResidual, rng: np.random.Generator) -> Array:
    """Maxwell slip of unit half loop on the motion of `real`, over a fifth to half a degree of output by `rng`."""
    slip = np.deg2rad(0.5 * rng.uniform(0.2, 0.5)) * np.geomspace(0.3, 2, 8)
    return -loops.maxwell_slip(real.input_angle / real.ratio, slip, np.full(8, 1 / 8))


def play(real: RealResidual, rng: np.random.Generator) -> Array:
    """A follower in a play of one arcmin on the motion of `real`; nothing in it is left to `rng`."""
    position = real.input_angle / real.ratio
    return (loops.play(position, np.full(position.size, ARCMIN)) - position) / ARCMIN


def delay(real: RealResidual, rng: np.random.Generator) -> Array:
    """The output read a millisecond before the input, by interpolation in the recording `real`; `rng` has no part."""
    output = real.input_angle / real.ratio
    return (output - np.interp(real.time + 1e-3, real.time, output)) / ARCMIN


ON_REAL_MOTION = {"hysteresis": friction, "lost_motion": play, "channel_delay": delay}


def on_real_motion(real: RealResidual, effect: str, severity: float, rng: np.random.Generator) -> pd.DataFrame:
    """Table of the motion of `real` with its own residual and `effect` ("" for none) at `severity` x the residual's
    rms.

    The residual is that of the recording as it is, or with its sign turned, by `rng`; so is the effect.
    """
    error = rng.choice([-1.0, 1.0]) * real.residual
    if effect:
        wave = ON_REAL_MOTION[effect](real, rng)
        error = error + rng.choice([-1.0, 1.0]) * severity * real.rms / np.std(wave) * wave
    output = real.input_angle / real.ratio - error * ARCMIN
    return pd.DataFrame(
        {
            "time_s": real.time,
            "input_angle_deg": np.rad2deg(real.input_angle),
            "output_angle_deg": np.rad2deg(output),
        }
    )


def prolonged(residual: Array, samples: int, rng: np.random.Generator) -> Array:
    """`samples` values made of blocks of a real `residual` (m,), drawn by `rng`, a hundred long on average; unit rms.

    The stationary bootstrap (Politis, Romano, J. Am. Stat. Assoc. 89, 1994): colour and steps stay, and no line comes
    in that a repeated record would have.
    """
    fresh = rng.random(samples) < 1 / BLOCK
    fresh[0] = True
    start = rng.integers(residual.size, size=samples)
    begun = np.maximum.accumulate(np.where(fresh, np.arange(samples), 0))
    series = residual[(start[begun] + np.arange(samples) - begun) % residual.size]
    result: Array = (series - series.mean()) / series.std()
    return result


def on_simulated_drive(
    residual: Array, effect: str, severity: float, noise_share: float, rng: np.random.Generator
) -> tuple[pd.DataFrame, ...]:
    """Tables of a bench run whose noise is `residual`, `noise_share` x the base's rms, with `effect` ("" for none) at
    `severity` x the base's rms in it.

    Drive, plan and the blocks of the residual are drawn by `rng`. Raises `RuntimeError` where no draw of 14 allows an
    effect so large.
    """
    for _ in range(ATTEMPTS):
        errors = draw_errors(rng)
        hidden = [CATALOGUE[effect](rng)] if effect else []
        plans = draw_plans(rng, hidden[0].needs if hidden else frozenset(), "full" if hidden else "small")
        hidden = [physics.for_plans(plans) for physics in hidden]
        setups = [set_up(errors, run(plan, 0.0, rng)) for plan in plans]
        base = joint_rms([read_error(s) for s in setups])
        found = [scaled_to(physics, setups, severity * base) for physics in hidden]
        sized = [one for one in found if one is not None]
        if len(sized) == len(found):
            break
    else:
        raise RuntimeError(f"{effect} could not be made {severity} x the base's rms in {ATTEMPTS} draws")
    hidden = [physics for physics, _ in sized]
    gain = float(np.prod([physics.torque_gain for physics in hidden]))
    tables = []
    for plan, setup in zip(plans, setups, strict=True):
        input_angle, output_angle = read_angles(setup, hidden)
        noise = noise_share * base * prolonged(residual, setup.run.time.size, rng)
        columns = {
            "time_s": setup.run.time,
            "input_angle_deg": np.rad2deg(input_angle),
            "output_angle_deg": np.rad2deg(output_angle - noise),
        }
        if plan.torque is not None:
            columns["torque_Nm"] = gain * setup.run.torque
        if plan.log_temperature:
            columns["temperature_C"] = 21 + setup.run.body_k
        tables.append(pd.DataFrame(columns))
    return tuple(tables)
