"""One or more of every effect of the catalogue as its keys in a study file, and a condition that all can work at."""

from __future__ import annotations

from hdopt.effects import EFFECTS

OPERATION = {
    "motion": "both",
    "output_torque_nm": 20.0,
    "speed_rpm": 30.0,
    "temperature_difference_k": 5.0,
    "time_s": 0.0,
}

EXAMPLES: list[tuple[str, dict]] = [(name, dict(keys)) for name, effect in EFFECTS.items() for keys in effect.examples]
"""As each effect's own file gives them."""

NAMES = [f"{name}-{i}" for i, (name, _) in enumerate(EXAMPLES)]


def toml(effects: dict[str, dict], operation: dict | None = None) -> str:
    """A study of the CSF-25-80 with these effects at this operation."""
    lines = ['drive = "csf-25-80"']
    for table, content in {
        "operation": operation or {},
        **{f"effects.{name}": keys for name, keys in effects.items()},
    }.items():
        lines += [f"[{table}]"]
        lines += [f"{k} = {f'{v!r}'.replace(chr(39), chr(34))}" for k, v in content.items()]
    return "\n".join(lines) + "\n"
