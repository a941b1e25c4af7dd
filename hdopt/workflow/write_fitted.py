"""The fitted drive as a study: its errors and effects replace those of the study it was diagnosed with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: what a study file holds, of TOML's several kinds

import numpy as np

from hdopt.errors import HdoptError
from hdopt.simulation import EffectValues
from hdopt.simulation.operation import RPM
from hdopt.study import Study
from hdopt.workflow.recorded_drive import AnyDrive, recorded_drive

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict.diagnosis import Diagnosis
    from hdopt.diagnosis.verdict.named_effect import NamedEffect
    from hdopt.effects.estimate import Parameter


def write_study(diagnosis: Diagnosis, drive: AnyDrive, path: Path) -> None:
    """Write a study file at `path` that starts from the study of `drive` (a study, its name or its path) and holds the
    extended model of `diagnosis`: the fitted errors of the base model, each effect that was named as [effects.ID], and
    in [operation] the condition of the recordings.

    Intervals, and what the recordings left open, stand as comments. Raises `HdoptError` where there was no
    harmonic-drive model to fit.
    """
    from hdopt.files import write_text
    from hdopt.study.effects import effect_keys
    from hdopt.study.write import study_toml, with_moved_paths

    if not diagnosis.base.parameters:
        raise HdoptError(
            "--write-study needs a harmonic-drive model; diagnose with --drive NAME, not with --drive none"
        )
    study = recorded_drive(drive).study
    if study is None:
        raise HdoptError("a fitted study starts from a study; give `drive` as a study, a shipped name or a path")
    data: dict[str, Any] = {"drive": study.name}
    if not _is_shipped_drive(study):
        data = with_moved_paths(study.data, study.folder, path.parent)
        data = {name: content for name, content in data.items() if name not in REPLACED}
    comments: dict[tuple[str, ...], list[str]] = {}
    data["errors"] = {key: _digits(p.value, 8) for key, p in diagnosis.base.parameters.items()}
    effects, said = found_effects(diagnosis), {found.id: found for found in diagnosis.effects}
    if effects:
        data["operation"], notes = _operation(diagnosis)
        comments |= {("operation", key): [note] for key, note in notes.items()}
        data["effects"] = {}
    for effect in effects:
        keys = effect_keys(effect, study.drive.geometry)
        data["effects"][effect.id] = {
            key: _digits(value, 8) if isinstance(value, float) else value for key, value in keys.items()
        }
        comments["effects", effect.id] = _said_of(effect, said[effect.id])
    comments[()] = _left_open(diagnosis, {effect.id for effect in effects})
    write_text(path, study_toml(data, comments=comments))


def _is_shipped_drive(study: Study) -> bool:
    """Whether `study` is a drive that ships, unchanged: its name says it all."""
    return bool(study.recipe) and study.recipe["source"] is None and not study.recipe["overrides"]


REPLACED = ("errors", "study", "effects", "operation")
"""Sections of the study that the fit replaces."""


def _left_open(diagnosis: Diagnosis, written: set[str]) -> list[str]:
    """What the recordings say and the study cannot hold."""
    lines = [
        f"{found.says} Found in a torque sweep with the input locked: not in this model of a drive that turns."
        for found in diagnosis.effects
        if found.id not in written
    ]
    for other in diagnosis.ambiguous_with:
        lines.append(f"The recordings cannot tell these effects from: {' and '.join(other)}.")
    if diagnosis.where is not None:
        lines.append(f"{diagnosis.says} It is not in this model.")
    return lines


def found_effects(diagnosis: Diagnosis) -> tuple[EffectValues, ...]:
    """The effects that a diagnosis named, with the numbers of its fit, strongest first.

    What a fit describes without naming it, such as a sine in time, is none of them.
    """
    evidence, named = diagnosis.evidence, {found.id for found in diagnosis.effects}
    fitted: dict[str, EffectValues] = {}
    for selection in (evidence.high, evidence.selection):
        if selection is None:
            continue
        fit = selection.best.fit
        for term, coefficients in zip(fit.terms, fit.coefficients, strict=True):
            if term.effect in named:
                fitted[term.effect] = EffectValues.fitted(term, coefficients)
    return tuple(fitted[found.id] for found in diagnosis.effects if not of_torque_sweep(fitted[found.id]))


def of_torque_sweep(effect: EffectValues) -> bool:
    """Whether an effect was described by the torque of a locked input, which says nothing of a drive that turns."""
    return "friction_nm" in effect.shape


def _said_of(effect: EffectValues, found: NamedEffect) -> list[str]:
    origin = f"of the bench ({effect.effect.bench_part})" if effect.origin == "bench" else "of the drive"
    lines = [found.says, f"{origin}; fitted, with 95 % intervals:"]
    return lines + [f"  {name} = {_fitted(p)}" for name, p in found.parameters.items()]


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def _fitted(parameter: Parameter) -> str:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    interval = f"  ({parameter.low:.4g} to {parameter.high:.4g})" if parameter.low < parameter.high else ""
    return f"{parameter.value:.4g}{unit}{interval}"


def _operation(diagnosis: Diagnosis) -> tuple[dict[str, Any], dict[str, str]]:
    """The condition of the recordings, as far as they say, and a note beside each number."""
    rows = diagnosis.evidence.rows
    motion = "both" if rows.reverses else "forward" if np.median(rows.direction) > 0 else "backward"
    found: dict[str, Any] = {"motion": motion}
    notes = {}
    if rows.torque is not None:
        found["output_torque_nm"] = _digits(float(rows.torque[np.argmax(np.abs(rows.torque))]), 6)
        notes["output_torque_nm"] = "the largest recorded"
    if rows.speed is not None and (speed := float(np.median(np.abs(rows.speed)))) > 0:
        found["speed_rpm"] = _digits(speed / RPM, 6)
        notes["speed_rpm"] = "of the input, the usual one recorded"
    if rows.temperature is not None:
        rise = float(rows.temperature.max() - rows.temperature.mean())
        found["temperature_difference_k"] = _digits(rise, 6)
        notes["temperature_difference_k"] = "the highest recorded less the mean"
    if rows.time is not None:
        found["time_s"] = 0
    return found, notes
