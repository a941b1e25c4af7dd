"""Retaining rings for shafts, DIN 471 (normal type), and their grooves.

Rows of `RINGS`: nominal shaft diameter d1, ring thickness s, groove diameter d2, groove width m (H13), least width n of
the land beyond the groove, largest radial width b of the ring (opposite its gap, about); mm. Checked against public
reprints: s, d2 and b of every row in the FreeCAD Fasteners workbench (FsData/din471def.csv); all columns up to 19 mm at
capitalbolts.in/din-471; s, d2, m and b of 45 to 72 mm in the list scribd.com/document/416335815. That leaves m of 20 to
42 and of 75 mm and more, which follows the rule of the others (s + 0.1 mm up to s = 1.75 mm, s + 0.15 mm above), and n
above 19 mm, which is three times the groove's depth as below. The row for 52 mm is left out: the lists have a groove
of 49.5 mm, which no row beside it agrees with.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Ring:
    """One row of DIN 471, mm."""

    shaft: float
    thickness: float
    groove: float
    groove_width: float
    land: float
    width: float

    @property
    def name(self) -> str:
        return f"DIN 471 - {self.shaft:g} x {self.thickness:g}"

    @property
    def depth(self) -> float:
        """Depth of the groove, mm."""
        return (self.shaft - self.groove) / 2

    @property
    def groove_class(self) -> str:
        """Tolerance class of the groove's diameter."""
        return "h10" if self.shaft <= 10 else "h11" if self.shaft <= 22 else "h12"


RINGS = tuple(
    Ring(*row)
    for row in (
        (3, 0.4, 2.8, 0.5, 0.3, 0.8),
        (4, 0.4, 3.8, 0.5, 0.3, 0.9),
        (5, 0.6, 4.8, 0.7, 0.3, 1.1),
        (6, 0.7, 5.7, 0.8, 0.5, 1.3),
        (7, 0.8, 6.7, 0.9, 0.5, 1.4),
        (8, 0.8, 7.6, 0.9, 0.6, 1.5),
        (9, 1.0, 8.6, 1.1, 0.6, 1.7),
        (10, 1.0, 9.6, 1.1, 0.6, 1.8),
        (11, 1.0, 10.5, 1.1, 0.8, 1.8),
        (12, 1.0, 11.5, 1.1, 0.8, 1.8),
        (13, 1.0, 12.4, 1.1, 0.9, 2.0),
        (14, 1.0, 13.4, 1.1, 0.9, 2.1),
        (15, 1.0, 14.3, 1.1, 1.1, 2.2),
        (16, 1.0, 15.2, 1.1, 1.2, 2.2),
        (17, 1.0, 16.2, 1.1, 1.2, 2.3),
        (18, 1.2, 17.0, 1.3, 1.5, 2.4),
        (19, 1.2, 18.0, 1.3, 1.5, 2.5),
        (20, 1.2, 19.0, 1.3, 1.5, 2.6),
        (21, 1.2, 20.0, 1.3, 1.5, 2.7),
        (22, 1.2, 21.0, 1.3, 1.5, 2.8),
        (24, 1.2, 22.9, 1.3, 1.7, 3.0),
        (25, 1.2, 23.9, 1.3, 1.7, 3.0),
        (26, 1.2, 24.9, 1.3, 1.7, 3.1),
        (28, 1.5, 26.6, 1.6, 2.1, 3.2),
        (30, 1.5, 28.6, 1.6, 2.1, 3.5),
        (32, 1.5, 30.3, 1.6, 2.6, 3.6),
        (34, 1.5, 32.3, 1.6, 2.6, 3.8),
        (35, 1.5, 33.0, 1.6, 3.0, 3.9),
        (36, 1.75, 34.0, 1.85, 3.0, 4.0),
        (38, 1.75, 36.0, 1.85, 3.0, 4.2),
        (40, 1.75, 37.5, 1.85, 3.8, 4.4),
        (42, 1.75, 39.5, 1.85, 3.8, 4.5),
        (45, 1.75, 42.5, 1.85, 3.8, 4.7),
        (48, 1.75, 45.5, 1.85, 3.8, 5.0),
        (50, 2.0, 47.0, 2.15, 4.5, 5.1),
        (55, 2.0, 52.0, 2.15, 4.5, 5.4),
        (60, 2.0, 57.0, 2.15, 4.5, 5.8),
        (65, 2.5, 62.0, 2.65, 4.5, 6.3),
        (70, 2.5, 67.0, 2.65, 4.5, 6.6),
        (75, 2.5, 72.0, 2.65, 4.5, 7.0),
        (80, 2.5, 76.5, 2.65, 5.3, 7.4),
        (85, 3.0, 81.5, 3.15, 5.3, 7.8),
        (90, 3.0, 86.5, 3.15, 5.3, 8.2),
        (95, 3.0, 91.5, 3.15, 5.3, 8.6),
        (100, 3.0, 96.5, 3.15, 5.3, 9.0),
        (110, 4.0, 106.0, 4.15, 6.0, 9.6),
        (120, 4.0, 116.0, 4.15, 6.0, 10.2),
    )
)


def ring_of(diameter: float) -> Ring | None:
    """The ring of a shaft of exactly this `diameter`, mm, None where the table has none."""
    return next((ring for ring in RINGS if abs(ring.shaft - diameter) < 1e-9), None)


def smallest_ring(diameter: float, core: float) -> Ring | None:
    """The smallest ring whose shaft is at least `diameter` mm and whose groove at least `core` mm; None beyond the
    table."""
    return next((ring for ring in RINGS if ring.shaft >= diameter and ring.groove >= core), None)
