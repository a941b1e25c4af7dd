"""What a recording must hold to show an effect, by the domain where the effect lives: the default of `Effect.lacks`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hdopt.effects.conditions import Conditions, varies

LEAST_SPEED_SPREAD, LEAST_TORQUE_SPREAD = 0.003, 0.02
"""Standard deviation over the largest value from which speed or torque varies."""
LEAST_WARMING_K = 0.02


def requirement(domain: str, conditions: Conditions) -> str | None:
    """What `conditions` would need to show an effect that lives in `domain`, or None where they can."""
    checks: dict[str, Callable[[], str | None]] = {
        "reversal": lambda: None if conditions.reverses else "a reversal",
        "direction": lambda: None if conditions.reverses else "a reversal",
        "torque": lambda: varying_torque(conditions),
        "speed": lambda: varying_speed(conditions),
        "temperature": lambda: varying_temperature(conditions),
        "time": lambda: None if conditions.time is not None else "a time column",
    }
    if domain in checks:
        return checks[domain]()
    return None if conditions.span_turns >= 1 else "a whole input turn"


def varying_torque(conditions: Conditions) -> str | None:
    """None where the `conditions` have a torque and it varies, else what they lack."""
    if conditions.torque is None:
        return "a torque column"
    return None if varies(conditions.torque, LEAST_TORQUE_SPREAD) else "torque that varies"


def varying_speed(conditions: Conditions) -> str | None:
    """None where the `conditions` have a speed and it varies, else what they lack."""
    if conditions.speed is None:
        return "a time column"
    return None if varies(conditions.speed, LEAST_SPEED_SPREAD) else "speed that varies"


def varying_temperature(conditions: Conditions) -> str | None:
    """None where the `conditions` have a temperature and it varies, else what they lack."""
    if conditions.temperature is None:
        return "a temperature column"
    return None if float(np.ptp(conditions.temperature)) > LEAST_WARMING_K else "temperature that varies"
