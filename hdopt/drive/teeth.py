"""Measured teeth of one spline: pitch deviations tooth by tooth."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.values import DriveError, require
from hdopt.errors import HdoptError, shown
from hdopt.files import are_names, cells_of, on_commas, read_text
from hdopt.keywords import names_keywords

KINDS = ("cumulative", "single")
OTHER_LENGTH = re.compile(r"(?<![a-zA-Zµμ])(mm|cm|nm|m|mils?|thou|in|inch|inches|uin|µin|μin)(?=[\s\])]*$)", re.I)
"""A unit of length at the end of a column's name that is not the micrometre."""
FINEST = 5e-5
"""mm: half the last digit of what gear inspection writes, 0.1 um; a whole spline is never as good."""
ALIKE = 0.3
"""Correlation of neighbours below which cumulative deviations look like single ones, whose own is near nought."""


@names_keywords
@dataclass(frozen=True)
class MeasuredTeeth:
    """Cumulative pitch deviation of every tooth of a spline, mm of arc at the pitch line, mean zero.

    Tooth 1 lies at `first_angle` (rad) clockwise from the major axis at input angle 0, the others follow clockwise. A
    deviation is positive where it drives the output on, as the sines of `DriveErrors` are. `eccentricity` is the
    amplitude (mm) of the first harmonic, which a part measured off-centre shows; `recentred` whether it was taken out.
    """

    deviations: tuple[float, ...]
    first_angle: float = 0.0
    eccentricity: float = 0.0
    recentred: bool = False
    source: str = "array"
    doubts: tuple[str, ...] = ()
    """What makes one ask whether kind and unit of the table are those that were said, a sentence each."""
    backwards: bool = False
    """Whether the table that they come from numbers them counterclockwise."""
    negated: bool = False
    """Whether the table's deviations have the other sign."""

    @classmethod
    def of(
        cls, values: Array, kind: str = "cumulative", first_angle: float = 0.0, recentre: bool = True, source: str = ""
    ) -> MeasuredTeeth:
        """From the deviations `values` (mm, (n,)) of teeth 1 to n, of the `kind` "cumulative" or "single".

        The sum of single deviations is spread over all teeth: a circle closes. `recentre` takes the first harmonic out,
        which no table tells from a part held off-centre; `first_angle` (rad) and `source` as in the class.
        """
        require(kind in KINDS, f"the deviations are said to be {kind!r}; they must be one of {', '.join(KINDS)}")
        values = np.asarray(values, float)
        require(len(values) >= 8, f"{len(values)} teeth are given; at least 8 are needed")
        require(bool(np.isfinite(values).all()), f"{source or 'the table'} holds a deviation that is not finite")
        doubts = _doubts(values, kind)
        if kind == "single":
            values = np.cumsum(values - values.mean())
        values = values - values.mean()
        angles = 2 * math.pi * np.arange(len(values)) / len(values)
        wave = 2 / len(values) * np.sum(values * np.exp(-1j * angles))
        if recentre:
            values = values - np.real(wave * np.exp(1j * angles))
        return cls(tuple(map(float, values)), first_angle, float(abs(wave)), recentre, source or "array", doubts)

    def laid(self, first_angle: float, backwards: bool = False, negated: bool = False) -> MeasuredTeeth:
        """The same teeth with tooth 1 at `first_angle`, rad; in place of clockwise numbered counterclockwise, or the
        other way about, where `backwards`; each deviation with the other sign where `negated`."""
        values = np.array(self.deviations)
        if backwards:
            values = np.roll(values[::-1], 1)
        return replace(
            self,
            deviations=tuple((-values if negated else values).tolist()),
            first_angle=first_angle,
            backwards=self.backwards != backwards,
            negated=self.negated != negated,
        )

    @property
    def total_cumulative(self) -> float:
        """F_p, the range of the cumulative deviations, mm."""
        return max(self.deviations) - min(self.deviations)

    @property
    def largest_single(self) -> float:
        """f_p, the largest single pitch deviation by size, mm."""
        values = np.array(self.deviations)
        return float(np.abs(values - np.roll(values, 1)).max())


def _doubts(values: Array, kind: str) -> tuple[str, ...]:
    """Why the deviations `values` (mm, (n,)) may be of another unit, or of another kind than the `kind` told.

    Single deviations close: they add up to nothing, and neighbours are unlike. Cumulative ones begin or end at 0, and
    neighbours are alike.
    """
    doubts = []
    spread, total, largest = np.ptp(values), abs(values.sum()), np.abs(values).max()
    rounding = 3 * FINEST * math.sqrt(len(values) / 3)
    if 0 < spread < FINEST:
        doubts.append(f"all deviations lie within {1000 * spread:.2g} um, less than machines resolve: are they in um?")
    centred = values - values.mean()
    likeness = float(centred @ np.roll(centred, 1)) / max(float(centred @ centred), 1e-300)
    if kind == "single" and total > largest / 4 + rounding:
        doubts.append(
            f"the single deviations add up to {1000 * total:.3g} um where a turn closes; each was lessened by "
            f"{1000 * total / len(values):.3g} um, as if pitches had been compared with one of them. If they are "
            'cumulative, say so: deviation = "cumulative"'
        )
    elif kind == "single" and likeness > 1 - ALIKE:
        span = np.ptp(np.cumsum(centred))
        doubts.append(
            "neighbouring single deviations are alike, as cumulative ones are, and add up to as much as "
            f'{1000 * span:.3g} um. If they are cumulative, say so: deviation = "cumulative"'
        )
    off_zero = total < largest / 4 and values[0] != 0 and values[-1] != 0
    if kind == "cumulative" and off_zero and likeness < ALIKE:
        doubts.append(
            "the cumulative deviations add up to nothing, begin and end off 0, and neighbours are unlike, as "
            'those of single ones are. If they are single, say so: deviation = "single"'
        )
    return tuple(doubts)


def read_teeth(path: str | Path, teeth: int, flank: str | None = None) -> Array:
    """Deviations (mm) of teeth 1 to `teeth` from the CSV file `path` of rows tooth, flank, fp_um.

    A header line is optional, `#` starts a comment; between semicolons or tabs, numbers may have a decimal comma.
    `flank` picks one where the file has several. Raises `DriveError` with file and line for a row that is none, a
    header that says mm, a tooth that is missing, twice there, or beyond `teeth`.
    """
    path = Path(path)
    try:
        text = read_text(path, "a CSV text file", foreign=True)
    except HdoptError as error:
        raise DriveError(f"measured teeth {path}: cannot be read ({error})") from error
    rows = _rows(text, path)
    require(bool(rows), f"measured teeth {path} holds no row of tooth, flank, fp_um; give a CSV text file of them")
    flanks = sorted({row[1] for row in rows})
    named = ", ".join(flanks) or "none"
    if flank is None:
        require(len(flanks) <= 1, f"measured teeth {path} has the flanks {named}; say which one carries: flank = ...")
    else:
        require(flank in flanks, f"measured teeth {path} has no flank {flank!r}; it has {named}")
    found: dict[int, float] = {}
    for tooth, side, value in rows:
        if flank is not None and side != flank:
            continue
        renumber = "; number them from 1" if tooth == 0 else ""
        require(
            1 <= tooth <= teeth, f"measured teeth {path}: tooth {tooth}; this spline has teeth 1 to {teeth}{renumber}"
        )
        require(tooth not in found, f"measured teeth {path} gives tooth {tooth} twice; keep one row a tooth and flank")
        require(math.isfinite(value), f"measured teeth {path}: tooth {tooth} has the deviation {value}; give a number")
        found[tooth] = value / 1000
    missing = [tooth for tooth in range(1, teeth + 1) if tooth not in found]
    some = ", ".join(map(str, missing[:5])) + (" ..." if len(missing) > 5 else "")
    require(
        not missing, f"measured teeth {path}: {len(missing)} of {teeth} teeth are missing ({some}); give every tooth"
    )
    return np.array([found[tooth] for tooth in range(1, teeth + 1)])


def _rows(text: str, path: Path) -> list[tuple[int, str, float]]:
    rows = []
    header_allowed = True
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip(" ;,\t") or line.lstrip().startswith("#"):
            continue
        cells = [cell.strip() for cell in cells_of(line)]
        try:
            tooth, side, value = cells
            rows.append((int(tooth), side, float(value)))
        except ValueError:
            where = f"measured teeth {path}, line {number}: {shown(line)}"
            header = header_allowed and are_names(cells)
            require(header, f"{where}; each line must hold tooth, flank, fp_um{on_commas(line, cells, 3)}")
            unit = OTHER_LENGTH.search(cells[-1]) if len(cells) == 3 else None
            if unit is not None:
                raise DriveError(
                    f"{where}; deviations must be in um, not {unit.group()}: give them so, and name the column fp_um"
                ) from None
        header_allowed = False
    return rows
