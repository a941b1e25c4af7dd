"""Keys and keyways by the diameter of shaft and bore: DIN 6885-1 (the same sizes as ISO 773), high form.

Columns of `KEYS`: largest diameter (above the row before, up to and including), key width b and height h, depth t1 in
the shaft, depth t2 in the bore measured along the keyway's middle from the bore, all in mm. Checked against two
public reprints: Siemens FLENDER catalogue MD 31.1 (2016), p. 7/3, for 38 to 130 mm, and engineeringhardware.com, "DIN
6885 parallel keys", for 6 to 58 mm.
"""

from __future__ import annotations

from dataclasses import dataclass

from hdopt.errors import HdoptError


@dataclass(frozen=True)
class Key:
    """One row of DIN 6885-1, mm."""

    width: float
    height: float
    shaft_depth: float
    hub_depth: float

    @property
    def name(self) -> str:
        return f"{self.width:g} x {self.height:g} DIN 6885-1"

    @property
    def hub_depth_tolerance(self) -> float:
        """Upper deviation of t2, mm; the lower one is 0."""
        return 0.1 if self.height <= 6 else 0.2

    @property
    def corner_radii(self) -> tuple[float, float]:
        """Least and largest radius at the keyway's bottom, mm (column r2)."""
        return next((low, high) for widest, low, high in CORNER_RADII if self.width <= widest)

    @property
    def corner(self) -> float:
        """The radius that a solid gets at the keyway's bottom: the middle of both, mm."""
        return sum(self.corner_radii) / 2


CORNER_RADII = ((4.0, 0.08, 0.16), (8.0, 0.16, 0.25), (18.0, 0.25, 0.40), (32.0, 0.40, 0.60))
"""Widest key, least and largest radius at the bottom of its keyway, mm."""


SMALLEST_BORE = 6.0

KEYS: tuple[tuple[float, Key], ...] = (
    (8, Key(2, 2, 1.2, 1.0)),
    (10, Key(3, 3, 1.8, 1.4)),
    (12, Key(4, 4, 2.5, 1.8)),
    (17, Key(5, 5, 3.0, 2.3)),
    (22, Key(6, 6, 3.5, 2.8)),
    (30, Key(8, 7, 4.0, 3.3)),
    (38, Key(10, 8, 5.0, 3.3)),
    (44, Key(12, 8, 5.0, 3.3)),
    (50, Key(14, 9, 5.5, 3.8)),
    (58, Key(16, 10, 6.0, 4.3)),
    (65, Key(18, 11, 7.0, 4.4)),
    (75, Key(20, 12, 7.5, 4.9)),
    (85, Key(22, 14, 9.0, 5.4)),
    (95, Key(25, 14, 9.0, 5.4)),
    (110, Key(28, 16, 10.0, 6.4)),
    (130, Key(32, 18, 11.0, 7.4)),
)


def key_for_bore(diameter: float) -> Key:
    """The key of a bore of `diameter` mm; `HdoptError` where the table, 6 mm and up, has none."""
    largest = KEYS[-1][0]
    if SMALLEST_BORE <= diameter <= largest:
        return next(key for limit, key in KEYS if diameter <= limit)
    raise HdoptError(
        f"a bore of {diameter:g} mm has no keyway in DIN 6885-1 (here {SMALLEST_BORE:g} to {largest:g} mm); "
        'change export.bore_mm, or set export.mount = "d_bore" or "plain"'
    )
