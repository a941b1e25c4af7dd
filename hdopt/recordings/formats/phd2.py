"""PHD2 guide logs: the right-ascension error of a telescope mount, frame by frame.

A section begins at "Guiding Begins"; its header states the pixel scale. The longest section is read. A mount's worm or
strain wave gear turns at a known rate, so the input angle is computed, by `input_rate_deg_per_s`, from the time.
"""

from __future__ import annotations

import csv
import gzip
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hdopt.errors import HdoptError
from hdopt.recordings.table import Channel, Table

SIDEREAL_DEG_PER_S = 360 / 86164.0905
"""Rate of the sky, and of a mount's output (IAU: 86 164.0905 s a turn)."""


@dataclass(frozen=True)
class GuidingSection:
    """One "Guiding Begins" ... "Guiding Ends": its header text, column names and rows of cells."""

    scale_arcsec: float
    declination_deg: float
    names: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """Channels time (s), ra_raw, dec_raw, ra_guide (arcsec) and output_sidereal_deg of the longest guiding section.

    `ra_raw` is the mount's error as the camera saw it. Corrections that guiding sent act on the next frames, so
    `ra_unguided` is the error with the sum of all corrections taken back: what a drive does by itself.

    `path` of the file; `wanted` names the columns that will be used, None for all.
    """
    opener = gzip.open if path.suffix.lower() == ".gz" else open
    with opener(path, "rt", encoding="utf-8", errors="replace") as stream:
        sections = _sections(stream.read().splitlines())
    if not sections:
        raise HdoptError(f"{path.name} is a PHD2 log without a guiding section; guide for some minutes")
    section = max(sections, key=lambda s: len(s.rows))
    place = {name: index for index, name in enumerate(section.names)}
    missing = {"Time", "RARawDistance", "RAGuideDistance"} - set(place)
    if missing:
        raise HdoptError(f"{path.name}: its guiding section has no column {', '.join(sorted(missing))}")

    def column(name: str) -> np.ndarray:
        return np.array([_number(row[place[name]]) for row in section.rows])

    time, scale = column("Time"), section.scale_arcsec
    raw, guide = column("RARawDistance") * scale, np.nan_to_num(column("RAGuideDistance")) * scale
    sent = np.r_[0.0, np.cumsum(guide)[:-1]]
    channels = {
        "time": Channel(time, "s"),
        "ra_raw": Channel(raw, "arcsec"),
        "ra_guide": Channel(guide, "arcsec"),
        "ra_unguided": Channel(raw + sent, "arcsec"),
        "output_sidereal_deg": Channel(time * SIDEREAL_DEG_PER_S, "deg"),
    }
    if "DECRawDistance" in place:
        channels["dec_raw"] = Channel(column("DECRawDistance") * scale, "arcsec")
    note = (
        f"PHD2 guide log, the longest of {len(sections)} guiding sections, {scale:.3g} arcsec a pixel; no encoder: the "
        "output angle is computed from the sidereal rate; ra_unguided takes the corrections back"
    )
    return Table(channels, (note,))


def _sections(lines: Sequence[str]) -> list[GuidingSection]:
    found: list[GuidingSection] = []
    names: tuple[str, ...] = ()
    rows: list[tuple[str, ...]] = []
    scale, declination, inside = 1.0, 0.0, False
    for line in lines:
        if line.startswith("Guiding Begins"):
            inside, names, rows, scale, declination = True, (), [], 1.0, 0.0
        elif line.startswith("Guiding Ends") and inside:
            found.append(GuidingSection(scale, declination, names, tuple(rows)))
            inside = False
        elif inside and not names:
            if match := re.search(r"Pixel scale = ([\d.]+) arc-sec/px", line):
                scale = float(match.group(1))
            if match := re.search(r"Dec = (-?[\d.]+) deg", line):
                declination = float(match.group(1))
            if line.startswith("Frame,"):
                names = tuple(cell.strip().strip('"') for cell in line.split(","))
        elif inside and re.match(r"\d+,", line) and "DROP" not in line:
            cells = tuple(next(csv.reader([line])))
            if len(cells) >= len(names) - 1:
                rows.append(cells)
    if inside and rows:
        found.append(GuidingSection(scale, declination, names, tuple(rows)))
    return [section for section in found if section.rows]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")
