"""The catalogue of effects: physics that the base model leaves out, one file each.

Each is built on `hdopt.effects.base.Effect`, sees neutral arrays of conditions, recorded or simulated, and knows
nothing of files, fits or studies. Dropping a file in is enough: `hdopt.effects.catalogue` finds it.
"""

from __future__ import annotations

from hdopt.effects.catalogue import find_effects

EFFECTS = find_effects(__path__, __name__)
"""Effect id -> effect, in the catalogue's order; the ids are part of the interface."""

HIGH_ORDER = tuple(effect.id for effect in EFFECTS.values() if effect.high_order)
"""Effects of so many waves a turn that they are looked for on the rows as recorded too."""
