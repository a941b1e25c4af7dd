"""Texts within what goes into JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any  # Any: values of JSON


def with_texts(value: Any, old: str, new: str) -> Any:
    """`value` of JSON, with `new` for `old` in all its texts; tuples become lists."""
    if isinstance(value, str):
        return value.replace(old, new)
    if isinstance(value, Mapping):
        return {key: with_texts(item, old, new) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [with_texts(item, old, new) for item in value]
    return value
