"""The page on verification: what others published beside what this program computes, with the difference.

    python -m hdopt.studies.verification docs/verification.md

writes the table anew between its two marks. `tests/unit/test_site.py` compares the page with what is computed.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hdopt.files import write_text

START = "<!-- written by: python -m hdopt.studies.verification docs/verification.md -->"
END = "<!-- end of the table -->"


@dataclass(frozen=True)
class Comparison:
    """One published figure: its `source`, what it is of, its value and `unit`, ours, and digits after the point."""

    source: str
    of: str
    published: float
    ours: float
    unit: str
    digits: int

    @property
    def row(self) -> str:
        """The row of the page's table."""
        d = self.digits
        difference = round(self.ours - self.published, d) + 0.0
        shown = f"{difference:+.{d}f}" if difference else "0"
        return f"| {self.of} | {self.published:g} | {self.ours:.{d}f} | {shown} | {self.unit} |"


def _jia() -> Iterator[Comparison]:
    from hdopt.studies.jia_2021 import SOURCE
    from hdopt.studies.paper_reproduction import misalignment_alone, peak_to_peak_table, profile_table
    from hdopt.study import load_study

    study = load_study("paper-reproduction")
    drive, errors = study.drive, study.errors
    place = f"{SOURCE}, Tables 2 and 3: peak-to-peak on the paper's grid of 10 deg over 80 input turns"
    for row in peak_to_peak_table(drive, errors).to_dict("records"):
        yield Comparison(place, row["case"], row["published_arcmin"], row["sampled_arcmin"], "arcmin", 4)
    alone = misalignment_alone(drive, errors)
    of = "no tooth errors, converged (read off a figure)"
    yield Comparison(place, of, alone["published_arcmin"], alone["converged_arcmin"], "arcmin", 2)
    place = f"{SOURCE}, Table 4: profiles"
    for row in profile_table(drive, errors).to_dict("records"):
        name = row["profile"]
        yield Comparison(
            place, f"{name}: contact angle", row["published_contact_angle_deg"], row["contact_angle_deg"], "deg", 2
        )
        yield Comparison(place, f"{name}: k_e", row["published_k_e"], row["k_e"], "", 3)


def _chase() -> Iterator[Comparison]:
    from hdopt.workflow.allocate import allocate

    place = "Chase 1999, ADCATS Report 99-6: least cost of shaft and housing"
    for rule, cost in (("worst_case", 11.07783), ("rss", 8.053611)):
        found = allocate("chase-shaft-housing", rule, compare=False)
        yield Comparison(place, f"{rule.replace('_', ' ')} rule", cost, found.total_cost, "", 5)
    yield Comparison(place, "original tolerances", 9.3359, found.present_cost, "", 4)


def _grades() -> Iterator[Comparison]:
    from hdopt.allocation.grades import iso_1328_pitch, it_grade

    for grade, size, published in (("IT5", 62.0, 13.0), ("IT6", 62.0, 19.0), ("IT7", 50.0, 25.0), ("IT8", 3.0, 14.0)):
        ours = 1000 * it_grade(grade, size).tolerance
        yield Comparison("ISO 286-1, Table 1", f"{grade} at {size:g} mm", published, ours, "µm", 1)
    ours = 1000 * iso_1328_pitch(5, 50.0, 2.0).tolerance
    yield Comparison("ISO 1328-1, formula for F_p", "class 5, d = 50 mm, m = 2 mm", 17.389, ours, "µm", 3)


def _bearing() -> Iterator[Comparison]:
    from dataclasses import replace
    from math import radians

    from hdopt.mechanics.bearing_life import axial_force
    from hdopt.study import load_study

    gear = load_study("csf-25-80").drive.geometry
    size_32 = replace(gear, module=32 * 2.54 / gear.flexspline_teeth, pressure_angle=radians(30))
    place = "Harmonic Drive SE, Engineering Data HFUS-2A, Eq. 34.4 with its worked example"
    yield Comparison(place, "axial force, 200 N m", 215, axial_force(size_32, 200_000.0, 0.07) + 16, "N", 0)


def comparisons() -> list[Comparison]:
    """Every published figure beside ours, computed now."""
    return [*_jia(), *_chase(), *_grades(), *_bearing()]


def table() -> str:
    """The tables of the page, one for each source."""
    lines: list[str] = []
    source = ""
    for comparison in comparisons():
        if comparison.source != source:
            source = comparison.source
            lines += [
                "",
                f"### {source}",
                "",
                "| figure | published | hdopt | difference | unit |",
                "|---|---|---|---|---|",
            ]
        lines.append(comparison.row)
    return "\n".join(lines[1:])


def renewed(page: str) -> str:
    """`page` with the tables between their marks as they come out now. Raises `ValueError` where a mark is missing."""
    before, start, rest = page.partition(START)
    _, end, after = rest.partition(END)
    if not start or not end:
        raise ValueError(f"the page has no lines {START!r} and {END!r}; put them where the tables belong")
    return f"{before}{START}\n\n{table()}\n\n{END}{after}"


def main(arguments: list[str]) -> int:
    """Write the tables into the page that `arguments` name. Returns the exit status."""
    for name in arguments:
        path = Path(name)
        write_text(path, renewed(path.read_text(encoding="utf-8")))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
