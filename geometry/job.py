"""One export before any file is written: the parts, their key dimensions, and what the files say of their origin."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass
from enum import Enum
from functools import cached_property
from importlib.metadata import version
from typing import TYPE_CHECKING, Any  # Any: whatever records hold, on its way into JSON

from hdopt.drive.geometry import Drive
from hdopt.files import JsonReady
from hdopt.geometry.assembly import wave_generator_model
from hdopt.geometry.budget import CalloutTables, bounds_from
from hdopt.geometry.dimensions import Dimension, key_dimensions
from hdopt.geometry.mating import MatingRow, mating_rows
from hdopt.geometry.model import WaveGeneratorModel
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.part import Part
from hdopt.geometry.step import Identity

if TYPE_CHECKING:
    import cadquery as cq


@dataclass(frozen=True)
class Job:
    """What every format needs to write its file: the model, its solids (built once), and what the files say."""

    drive: Drive
    model: WaveGeneratorModel
    options: ExportOptions
    dimensions: tuple[Dimension, ...]
    identity: Identity
    mating: tuple[MatingRow, ...]
    """What the parts around the wave generator must keep."""
    bounds: Mapping[str, float]
    contributors: CalloutTables

    @cached_property
    def solids(self) -> tuple[tuple[Part, cq.Solid], ...]:
        return tuple((part, part.build()) for part in self.model.parts)

    @property
    def made(self) -> tuple[tuple[Part, cq.Solid], ...]:
        """The solids of the parts that are made, without their surroundings."""
        return tuple((part, solid) for part, solid in self.solids if not part.context)


def make_job(
    drive: Drive,
    options: ExportOptions,
    name: str,
    bounds: Mapping[str, float] | None = None,
    contributors: CalloutTables | None = None,
) -> Job:
    """Everything that is known before a solid is made: the parts, their key dimensions, and what files will say.

    `drive` with its wave generator, `options` the sizes that were given, `name` of the study. `bounds` are tolerances
    by study key (mm or deg) or contributor, `contributors` the study's callouts. Raises `HdoptError` where the numbers
    leave no part to make.
    """
    bounds, contributors = bounds or {}, contributors or {}
    model = wave_generator_model(drive, options, bounds_from(bounds, contributors))
    table = key_dimensions(model, drive.wave_generator.width, bounds, contributors)
    mating = mating_rows(drive, model, bounds, contributors)
    budgets = [budget.to_dict() for budget in model.plan.budgets]
    tolerances = [*budgets, *(row.to_dict() for row in table), *(row.to_dict() for row in mating)]
    identity = Identity(f"wave generator {name}", name, fingerprint(drive, options, tolerances), version("hdopt"))
    return Job(drive, model, options, table, identity, mating, bounds, contributors)


def fingerprint(drive: Drive, options: ExportOptions, tolerances: Sequence[JsonReady] = ()) -> str:
    """Twelve hexadecimal digits that change with all that the sheets and the tolerances in STEP files say.

    That is the wave generator and the clearances of a `drive`, the `options`, and the `tolerances`: the rows of key
    dimensions, budgets and mating parts. A tolerance of which none of them speaks, as the teeth's, changes nothing.
    """
    plain = json.dumps(
        [_plain(drive.wave_generator), _plain(drive.clearances), asdict(options), list(tolerances)], sort_keys=True
    )
    return hashlib.sha256(plain.encode()).hexdigest()[:12]


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        numbers = {field.name: getattr(value, field.name) for field in fields(value) if not field.name.startswith("_")}
        value = {"kind": type(value).__name__, **numbers}
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, Enum):
        return value.value
    return value.tolist() if hasattr(value, "tolist") else value
