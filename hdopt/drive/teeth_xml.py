"""Measured teeth from XML, as gear inspection writes it: the numbers stand where the reader of the file says.

Machines write the Gear Data Exchange format of VDI/VDE 2610 and formats of their own. Their schemas are not public, so
that no path is built in: it is given as XPath, and where it is not the paths of the file that hold as many numbers as
the spline has teeth are listed.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Any  # Any: an element has the type of its parser
from xml.etree import ElementTree

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.values import DriveError, require
from hdopt.errors import shown

UNITS = {"um": 1e-3, "mm": 1.0}
"""mm in one unit of the file's numbers."""
MOST_BYTES = 50_000_000
"""A file of all that was measured on a gear has a few MB."""
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
LISTED = 6
"""Paths listed in a message."""


class _Elements(ElementTree.TreeBuilder):
    """Elements without their namespaces; a DOCTYPE, which may hold entities without end, is refused."""

    def start(self, tag: str, attrs: dict[str, str]) -> Any:
        return super().start(tag.rpartition("}")[2], {key.rpartition("}")[2]: attrs[key] for key in attrs})

    def end(self, tag: str) -> Any:
        return super().end(tag.rpartition("}")[2])

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise DriveError("it has a DOCTYPE, which may hold entities without end; save it without")


def read_teeth_xml(path: str | Path, teeth: int, where: str | None, unit: str | None) -> Array:
    """Deviations (mm) of teeth 1 to `teeth` from the XML file `path`, (teeth,): all numbers in the text of the elements
    that the XPath `where` finds, in the order of the file, in `unit` ('um' or 'mm').

    Namespaces are left out of `where`; of XPath it may hold what `xml.etree` knows ('.//Pitch[@flank="left"]/Value').
    Raises `DriveError` where the file is no XML, `where` or `unit` is not given or finds other than so many numbers:
    the message lists paths that do.
    """
    path = Path(path)
    root = _root(path)
    require(
        where is not None,
        f"measured teeth {path}: say where its deviations stand, as xml_path = './/NAME'; {_listed(root, teeth)}",
    )
    require(unit in UNITS, f"measured teeth {path}: say the unit of its deviations: xml_unit = 'um' or 'mm'")
    assert where is not None and unit is not None, "both were required"
    try:
        found = root.findall(where)
    except (SyntaxError, LookupError, TypeError, ValueError) as error:  # a path cut short fails in its parser
        raise DriveError(
            f"measured teeth {path}: xml_path {shown(where)} is no path below the file's root, as './/NAME' is; "
            f"{_listed(root, teeth)}"
        ) from error
    values: list[float] = []
    for element in found:
        numbers = _numbers(element)
        require(
            numbers is not None,
            f"measured teeth {path}: {shown(where)} finds text that is no number; {_listed(root, teeth)}",
        )
        values += numbers or []
    require(
        len(values) == teeth,
        f"measured teeth {path}: {shown(where)} finds {len(values)} numbers; this spline has {teeth} teeth. "
        + _listed(root, teeth),
    )
    return UNITS[unit] * np.array(values)


def _root(path: Path) -> Any:
    try:
        require(path.stat().st_size <= MOST_BYTES, f"it has more than {MOST_BYTES // 1_000_000} MB")
        return ElementTree.parse(path, ElementTree.XMLParser(target=_Elements())).getroot()
    except (OSError, ElementTree.ParseError, DriveError, LookupError, ValueError) as error:
        raise DriveError(f"measured teeth {path}: cannot be read as XML ({error})") from error


def _numbers(element: Any) -> list[float] | None:
    """The numbers in the text of an `element`, apart by spaces, commas or semicolons; None where it holds others.

    A comma between digits, one in what spaces and semicolons part, is that of a decimal number.
    """
    words: list[str] = []
    for word in (element.text or "").replace(";", " ").split():
        words += [word.replace(",", ".")] if DECIMAL_COMMA.fullmatch(word) else filter(None, word.split(","))
    try:
        return [float(word) for word in words]
    except ValueError:
        return None


def _listed(root: Any, teeth: int) -> str:
    """The paths of the file below its `root` that hold as many numbers as there are `teeth`, as a sentence."""
    counts: Counter[str] = Counter()

    def visit(element: Any, way: tuple[str, ...]) -> None:
        counts["/".join((".", *way))] += len(_numbers(element) or ())
        for child in element:
            visit(child, (*way, child.tag))

    visit(root, ())
    fitting = [way for way, count in counts.items() if count == teeth]
    several = [f"{way} ({count})" for way, count in counts.most_common(LISTED) if count > teeth]
    if fitting:
        return f"with {teeth} numbers the file has {', '.join(map(shown, fitting[:LISTED]))}"
    if several:
        return (
            f"no path of the file has {teeth} numbers; more have {', '.join(several)}: choose by [@attribute='value']"
        )
    return f"no path of the file has {teeth} numbers or more"
