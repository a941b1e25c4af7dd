"""The fitted drive as a study: its errors and effects replace those of the study it was diagnosed with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdopt.errors import HdoptError
from hdopt.extended import AddedEffect
from hdopt.extended.effects import BENCH
from hdopt.extended.operation import RPM

if TYPE_CHECKING:
    from hdopt.diagnosis.effect import Parameter
    from hdopt.diagnosis.found import Found
    from hdopt.diagnosis.verdict import Diagnosis
    from hdopt.drive import DriveGeometry


def write_study(diagnosis: Diagnosis, drive: str, path: Path) -> None:
    """Write a study file that starts from `drive` and holds the extended model: the fitted errors of the base model,
    each effect that was named as [effects.ID], and in [operation] the condition of the recordings.

    Intervals, and what the recordings left open, stand as comments. Raises `HdoptError` where there was no
    harmonic-drive model to fit.
    """
    from hdopt.files import write_text
    from hdopt.study import load_study, shipped_drives

    if not diagnosis.base.parameters:
        raise HdoptError(
            "--write-study needs a harmonic-drive model; diagnose with --drive NAME, not with --drive none"
        )
    shipped = drive in shipped_drives()
    study = load_study(drive=drive) if shipped else load_study(drive)
    lines = [f'drive = "{drive}"', ""] if shipped else _sections_of(study.data)
    lines += ["[errors]"] + [f"{key} = {p.value:.8g}" for key, p in diagnosis.base.parameters.items()]
    effects = found_effects(diagnosis)
    if effects:
        lines += ["", "[operation]", *_operation_lines(diagnosis)]
    said = {found.id: found for found in diagnosis.effects}
    for effect in effects:
        lines += ["", *_effect_lines(effect, said[effect.id], study.drive.geometry)]
    for left in (found for name, found in said.items() if name not in {effect.id for effect in effects}):
        lines += [
            "",
            f"# {left.says} Found in a torque sweep with the input locked: not in this model of a drive that turns.",
        ]
    for other in diagnosis.ambiguous_with:
        lines += ["", f"# The recordings cannot tell these effects from: {' and '.join(other)}."]
    if diagnosis.where is not None:
        lines += ["", f"# {diagnosis.says} It is not in this model."]
    write_text(path, "\n".join(lines) + "\n")


def found_effects(diagnosis: Diagnosis) -> tuple[AddedEffect, ...]:
    """The effects that a diagnosis named, with the numbers of its fit, strongest first."""
    evidence = diagnosis.evidence
    fitted: dict[str, AddedEffect] = {}
    for selection in (evidence.high, evidence.selection):
        if selection is None:
            continue
        fit = selection.best.fit
        for term, coefficients in zip(fit.terms, fit.coefficients, strict=True):
            fitted[term.effect] = AddedEffect.fitted(term, coefficients)
    return tuple(fitted[found.id] for found in diagnosis.effects if not of_torque_sweep(fitted[found.id]))


def of_torque_sweep(effect: AddedEffect) -> bool:
    """Whether an effect was described by the torque of a locked input, which says nothing of a drive that turns."""
    return "friction_nm" in effect.shape


def _effect_lines(effect: AddedEffect, found: Found, gear: DriveGeometry) -> list[str]:
    from hdopt.study.effects import effect_keys

    origin = f"of the bench ({BENCH[effect.id]})" if effect.id in BENCH else "of the drive"
    lines = [f"[effects.{effect.id}]", f"# {found.says}", f"# {origin}; fitted, with 95 % intervals:"]
    lines += [f"#   {name} = {_fitted(p)}" for name, p in found.parameters.items()]
    return lines + [f"{key} = {_toml(value)}" for key, value in effect_keys(effect, gear).items()]


def _fitted(parameter: Parameter) -> str:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    interval = f"  ({parameter.low:.4g} to {parameter.high:.4g})" if parameter.low < parameter.high else ""
    return f"{parameter.value:.4g}{unit}{interval}"


def _operation_lines(diagnosis: Diagnosis) -> list[str]:
    """The condition of the recordings, as far as they say."""
    samples = diagnosis.evidence.samples
    motion = "both" if samples.reverses else "forward" if np.median(samples.direction) > 0 else "backward"
    lines = [f'motion = "{motion}"']
    if samples.torque is not None:
        largest = float(samples.torque[np.argmax(np.abs(samples.torque))])
        lines.append(f"output_torque_nm = {largest:.6g}  # the largest recorded")
    if samples.speed is not None and (speed := float(np.median(np.abs(samples.speed)))) > 0:
        lines.append(f"speed_rpm = {speed / RPM:.6g}  # of the input, the usual one recorded")
    if samples.temperature is not None:
        rise = float(samples.temperature.max() - samples.temperature.mean())
        lines.append(f"temperature_difference_k = {rise:.6g}  # the highest recorded less the mean")
    if samples.time is not None:
        lines.append("time_s = 0")
    return lines


def _sections_of(data) -> list[str]:
    """The sections of a study but its errors and effects, as TOML."""
    lines: list[str] = []
    for name, content in data.items():
        if name in ("errors", "study", "effects", "operation"):
            continue
        if isinstance(content, str):
            lines.insert(0, f'{name} = "{content}"')
            continue
        lines.append(f"[{name}]")
        lines += [f"{key} = {_toml(value)}" for key, value in content.items()]
        lines.append("")
    return lines


def _toml(value) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return f"{value:.8g}" if isinstance(value, float) else repr(value)
