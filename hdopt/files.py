"""How results leave the program: JSON that every reader accepts, and files whose failure is one sentence."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hdopt.errors import HdoptError


def to_json(result: Mapping[str, Any]) -> str:
    """JSON text of `result`; numpy numbers and arrays become plain ones, numbers that are not finite become null."""
    return json.dumps(_plain(result), indent=2, allow_nan=False)


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def write_text(path: Path, text: str) -> None:
    """Write a text file, or say in one sentence why that cannot be done."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise HdoptError(
            f"cannot write {path}: {error.strerror}; give a file in a folder that can be written"
        ) from error


def make_folder(path: Path) -> None:
    """Make a folder, its parents too, or say in one sentence why that cannot be done."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise HdoptError(f"cannot make the folder {path}: {error.strerror}; give a folder that can be made") from error
