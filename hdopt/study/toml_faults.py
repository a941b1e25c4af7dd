"""Why a text is no TOML, in the words of whoever wrote the study: a decimal comma, a unit after a number, no quotes."""

from __future__ import annotations

import re
import tomllib

_AT_LINE = re.compile(r"\(at line (\d+), column (\d+)\)")
_COMMA = re.compile(r"(?<![\w.])([+-]?\d+),(\d+)(?![\w.])")
_UNIT = re.compile(r"=\s*([+-]?\d+(?:\.\d+)?)\s*([A-Za-zµ°%]+)\s*(#.*)?$")
_WORD = re.compile(r"=\s*([A-Za-z][\w-]*)\s*(#.*)?$")
_STRING = re.compile(r"\"[^\"]*\"|'[^']*'")
LONGEST = 80


def why_no_toml(error: tomllib.TOMLDecodeError, text: str) -> str:
    """What is wrong with `text`, which the parser refused with `error`, and what to write instead."""
    place = _AT_LINE.search(str(error))
    if place is None:
        last = text.rstrip("\n").count("\n") + 1
        return f"is not valid TOML: {error}".replace("at end of document", f"at the end, line {last}")
    number, column = int(place[1]), int(place[2])
    line = text.split("\n")[number - 1].strip() if number <= text.count("\n") + 1 else ""
    hint = _hint(str(error), line, column)
    return f"is not valid TOML: {error}" if hint is None else f"is not valid TOML, line {number}, {hint}"


def _hint(message: str, line: str, column: int) -> str | None:
    if len(line) > LONGEST * 4:
        return None
    bare = _STRING.sub('""', line)
    if (comma := _COMMA.search(bare)) and "[" not in bare:
        return f"{line[:LONGEST]}: a decimal point is needed, not a comma: {comma[1]}.{comma[2]}"
    if unit := _UNIT.search(bare):
        return f"{line[:LONGEST]}: a number stands alone, {unit[1]}, in the unit that ends the key's name"
    if (word := _WORD.search(bare)) and word[1] not in ("true", "false", "inf", "nan"):
        return f'{line[:LONGEST]}: a text needs quotation marks, "{word[1]}"'
    if "Cannot overwrite" in message and line == "[drive]":
        return (
            'drive = "NAME" takes a shipped drive and [drive] describes your own; keep one of them '
            "('hdopt new NAME --from csf-25-80' writes the shipped one out, to be changed)"
        )
    if "Cannot declare" in message:
        return f"{line[:LONGEST]}: the file has this section twice; put its keys together"
    return None
