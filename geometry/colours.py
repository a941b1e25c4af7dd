"""The colours that parts bear in STEP files, 3MF files and pictures."""

from __future__ import annotations

from hdopt.geometry.part import Colour

STEEL: Colour = (0.36, 0.52, 0.68, 1.0)
DARK_STEEL: Colour = (0.30, 0.33, 0.38, 1.0)
BRONZE: Colour = (0.80, 0.58, 0.30, 1.0)
GREEN: Colour = (0.36, 0.62, 0.48, 1.0)
LIGHT_STEEL: Colour = (0.55, 0.67, 0.78, 1.0)
