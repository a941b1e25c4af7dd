"""The JSON that `hdopt allocate` wrote, read back."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

from hdopt.errors import HdoptError, shown, unknown_name
from hdopt.files import line_of, read_json, read_text

if TYPE_CHECKING:
    from hdopt.study import Study

WANTED = "the file that `hdopt allocate --json FILE` wrote"


def read_allocation(path: Path, study: Study) -> dict[str, float]:
    """Tolerances by error (mm or deg), contributor or dimension, as the file `path` gives them.

    Raises `HdoptError` for a file of another kind or another study, a name that `study` neither tolerances nor calls
    out nor has as a dimension of a linear stack, and a tolerance that is not a finite number above 0.
    """
    result = read_json(path, WANTED)
    errors = result.get("errors") if isinstance(result, dict) else None
    if not isinstance(errors, dict) or not errors:
        raise HdoptError(f"{path}: holds no tolerances under 'errors'; give {WANTED}")
    if result.get("study") not in (None, study.name):
        raise HdoptError(
            f"{path}: is of the study {shown(str(result['study']))}, not of {study.name!r}; give the allocation of "
            "this study"
        )
    known, text = _tolerances_of(study), read_text(path, WANTED)
    errors_at = text.find('"errors"')
    found = {}
    for name, row in errors.items():
        value = row.get("tolerance") if isinstance(row, dict) else None
        at = f"{path}, line {line_of(text, json.dumps(name), errors_at)}"
        if name not in known:
            raise HdoptError(f"{at}: {unknown_name('tolerance', name, sorted(known))}; is it of another study?")
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= 0:
            said = shown(str(value)) if isinstance(value, int | float | str) else "no number"
            raise HdoptError(f"{at}: the tolerance of {name} is {said}; it must be a finite number above 0")
        found[name] = float(value)
    return found


def _tolerances_of(study: Study) -> set[str]:
    """Names that `study` gives a tolerance each; what else stands in those sections (correlations) is a list."""
    sections = (
        study.data.get("tolerances", {}),
        study.data.get("contributors", {}),
        study.data.get("linear_stack", {}).get("dimensions", {}),
    )
    return {name for section in sections for name, row in section.items() if isinstance(row, dict)}
