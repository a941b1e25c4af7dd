"""The fitted drive as a study: its errors replace those of the study it was diagnosed with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hdopt.errors import HdoptError

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict import Diagnosis


def write_study(diagnosis: Diagnosis, drive: str, path: Path) -> None:
    """Write a study file that starts from `drive` and holds the fitted errors of the kinematic-error model.

    `ke`, `stack` and `search` then work on those errors. The effects found stand as comments with their parameters: the
    commands do not compute them, and nobody should take the study for the whole truth.
    """
    from hdopt.files import write_text
    from hdopt.study import load_study, shipped_drives

    if not diagnosis.base.parameters:
        raise HdoptError(
            "--write-study needs a harmonic-drive model; diagnose with --drive NAME, not with --drive none"
        )
    shipped = drive in shipped_drives()
    lines = [f'drive = "{drive}"', ""] if shipped else _sections_of(load_study(drive).data)
    lines += ["[errors]"] + [f"{key} = {p.value:.6g}" for key, p in diagnosis.base.parameters.items()]
    for found in diagnosis.effects:
        lines += ["", f"# left out of this model: {found.id}. {found.says}"]
        for name, p in found.parameters.items():
            lines.append(f"#   {name} = {p.value:.6g} {p.unit} ({p.low:.6g} to {p.high:.6g})")
    write_text(path, "\n".join(lines) + "\n")


def _sections_of(data) -> list[str]:
    """The sections of a study but its errors, as TOML."""
    lines: list[str] = []
    for name, content in data.items():
        if name in ("errors", "study"):
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
    return repr(value)
