"""Numbers of samples on the command line, also as 1e6."""

from __future__ import annotations

import re
from typing import Any  # Any: what click hands over

import click

WITH_EXPONENT = re.compile(r"(\d+)(?:\.(\d+))?[eE]\+?(\d{1,2})")


class WholeNumber(click.IntRange):
    """A whole number in a range, written out or with an exponent."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        text = str(value).strip()
        if found := WITH_EXPONENT.fullmatch(text):
            whole, part, exponent = found[1], found[2] or "", int(found[3])
            if len(part.rstrip("0")) <= exponent:
                text = whole + part.rstrip("0").ljust(exponent, "0")
        if not re.fullmatch(r"[+-]?\d+", text):
            self.fail(f"{value!r} is no whole number; write it as 100000 or 1e5", param, ctx)
        number: int = super().convert(int(text), param, ctx)
        return number
