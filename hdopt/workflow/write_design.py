"""The chosen design as a study file of its own, ready for every other command."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any  # Any: what a study file holds, of TOML's several kinds

from hdopt.drive.profiles import TwoDisk
from hdopt.errors import HdoptError
from hdopt.optimize.objectives import WG_TILT_NAMES
from hdopt.optimize.records import SearchResult
from hdopt.study import Study
from hdopt.study.write import study_toml, with_moved_paths

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


def chosen_study_toml(study: Study, result: SearchResult, folder: Path | None = None) -> str:
    """Text of a study file with the drive and wave generator that `result` chose; all else as in the searched
    `study`. Files that it names are relative to the `folder` it will lie in; absolute where None."""
    drive = result.setup.space.design(result.chosen.combination, result.chosen.values).drive
    gear, generator = drive.geometry, drive.wave_generator
    if not isinstance(gear.flexspline_teeth, int):
        raise HdoptError(f"the chosen module gives {gear.flexspline_teeth:.3f} teeth; there is no such drive to write")
    profile: dict[str, Any] = {
        "profile": generator.profile.name,
        "structure": generator.structure.value,
        "width_mm": generator.width,
        "semi_major_mm": generator.profile.semi_major,
        "bearing_thickness_mm": generator.bearing_thickness,
    }
    if isinstance(generator.profile, TwoDisk):
        profile["wrap_angle_deg"] = math.degrees(generator.profile.wrap_angle)
    geometry = asdict(gear)
    sizes = {f"{k}_mm": v for k, v in geometry.items() if not k.endswith("_teeth") and k != "pressure_angle"}
    teeth = {key: value for key, value in geometry.items() if key.endswith("_teeth")}
    sections: dict[str, Mapping[str, Any]] = {
        "study": {"title": f"{study.title}: the chosen wave generator"},
        "drive": {**teeth, "pressure_angle_deg": math.degrees(gear.pressure_angle), **sizes},
        "wave_generator": profile,
    }
    sections = {name: _rounded(content) for name, content in sections.items()}
    kept = _on_width({name: study.data[name] for name in KEPT if name in study.data}, result)
    head = (
        f"Chosen by a search of {study.name} from {len(result.solutions)} combinations of profile and structure.",
        f"{result.best.name}: {result.best.quantities[result.objective]:.4f} arcmin ({result.objective}).",
    )
    return study_toml(sections | with_moved_paths(kept, study.folder, folder), head)


def _on_width(kept: Mapping[str, Any], result: SearchResult) -> dict[str, Any]:
    """The sections `kept` with what follows the wave generator's width: tilts over its bore, the length of the callouts
    that feed them, and the face that carries."""
    trade = result.setup.trade
    factor = trade.tilt_factor(result.setup.space.design(result.chosen.combination, result.chosen.values))
    changed = {name: dict(content) for name, content in kept.items()}
    tilts = [f"{name}_deg" for name, over in zip(WG_TILT_NAMES, trade.over_bore, strict=True) if over]
    for section, key in itertools.product(("errors", "tolerances"), tilts):
        if key in changed.get(section, {}):
            changed[section][key] = _scaled(changed[section][key], factor)
    for name, row in changed.get("contributors", {}).items():
        if row.get("feeds", "").startswith("wg_tilt") and "length_mm" in row and tilts:
            changed["contributors"][name] = {**row, "length_mm": row["length_mm"] / factor}
    if "tooth_face_width_mm" in changed.get("load", {}):
        changed["load"]["tooth_face_width_mm"] = round(changed["load"]["tooth_face_width_mm"] / factor, DECIMALS)
    return changed


def _scaled(value: Any, factor: float) -> Any:
    """An error, or the sizes of a tolerance's distribution, times `factor`."""
    if isinstance(value, Mapping):
        shape = ("a", "b", "log_std", "cost")
        return {key: inner if key in shape else _scaled(inner, factor) for key, inner in value.items()}
    return round(value * factor, DECIMALS) if isinstance(value, int | float) else value


def _rounded(content: Mapping[str, Any]) -> dict[str, Any]:
    """Lengths and angles to a nanometre and a millionth of a degree: what is beyond is rounding."""
    return {key: round(value, DECIMALS) if isinstance(value, float) else value for key, value in content.items()}
