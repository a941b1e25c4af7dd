"""The chosen design as a study file of its own, ready for every other command."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from hdopt.errors import HdoptError
from hdopt.study import Study
from hdopt.trade.run import SearchResult
from hdopt.trade.space import OWN_VARIABLES

KEPT = (
    "errors",
    "effects",
    "operation",
    "tolerances",
    "requirement",
    "contributors",
    "clearances",
    "material",
    "load",
    "export",
)
"""Sections of the searched study that the chosen design keeps."""
DECIMALS = 6
"""Of lengths in mm and angles in deg: a nanometre."""


def chosen_study_toml(study: Study, result: SearchResult) -> str:
    """Text of a study file with the chosen drive and wave generator; all else as in the searched study."""
    drive = result.setup.space.design(result.chosen.combination, result.chosen.values).drive
    gear, generator = drive.geometry, drive.wave_generator
    if not isinstance(gear.flexspline_teeth, int):
        raise HdoptError(f"the chosen module gives {gear.flexspline_teeth:.3f} teeth; there is no such drive to write")
    profile = {
        "profile": generator.profile.name,
        "structure": generator.structure.value,
        "width_mm": generator.width,
        "semi_major_mm": generator.profile.semi_major,
        "bearing_thickness_mm": generator.bearing_thickness,
    }
    if generator.profile.name in OWN_VARIABLES:
        profile["wrap_angle_deg"] = math.degrees(generator.profile.wrap_angle)
    geometry = asdict(gear)
    sizes = {f"{k}_mm": v for k, v in geometry.items() if not k.endswith("_teeth") and k != "pressure_angle"}
    teeth = {key: value for key, value in geometry.items() if key.endswith("_teeth")}
    sections: dict[str, Mapping[str, Any]] = {
        "study": {"title": f"{study.title}: the chosen wave generator"},
        "drive": {**teeth, "pressure_angle_deg": math.degrees(gear.pressure_angle), **sizes},
        "wave_generator": profile,
    }
    sections |= {name: study.data[name] for name in KEPT if name in study.data}
    head = (
        f"# Chosen by `hdopt run {study.name}` from {len(result.solutions)} combinations of profile and structure.\n"
        f"# {result.best.name}: {result.best.quantities[result.objective]:.4f} arcmin ({result.objective}).\n"
    )
    return head + "".join(_table(name, content) for name, content in sections.items())


def _table(name: str, content: Mapping[str, Any]) -> str:
    lines = [f"{key} = {_value(value)}" for key, value in content.items() if value is not None]
    return "\n".join(["", f"[{name}]", *lines, ""])


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(round(value, DECIMALS)) if abs(value) < 1e15 else repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in value.items() if item is not None) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    raise TypeError(f"a study file cannot hold {value!r}")
