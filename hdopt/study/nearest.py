"""Which key was meant by one that no section has: by its unit, its section, its words, its symbol, its spelling."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence

from hdopt.errors import LONGEST_NAME, shown

SYMBOLS = {
    "ratio": ("flexspline_teeth", "circular_spline_teeth"),
    "reduction": ("flexspline_teeth", "circular_spline_teeth"),
    "i": ("flexspline_teeth", "circular_spline_teeth"),
    "n": ("flexspline_teeth", "circular_spline_teeth"),
    "teeth": ("flexspline_teeth", "circular_spline_teeth"),
    "z1": ("flexspline_teeth",),
    "z2": ("circular_spline_teeth",),
    "z_fs": ("flexspline_teeth",),
    "z_cs": ("circular_spline_teeth",),
    "m": ("module_mm",),
    "alpha": ("pressure_angle_deg",),
    "b": ("width_mm",),
    "e1": ("axis_eccentricity_mm",),
    "beta1": ("axis_eccentricity_direction_deg",),
    "beta2": ("axis_tilt_y_deg",),
    "beta3": ("axis_tilt_x_deg",),
    "e2": ("wg_eccentricity_mm",),
    "alpha1": ("wg_eccentricity_direction_deg",),
    "alpha2": ("wg_tilt_major_deg",),
    "alpha3": ("wg_tilt_minor_deg",),
    "a_cs": ("cs_tooth_amplitude_mm",),
    "a_fs": ("fs_tooth_amplitude_mm",),
    "e_t": ("backlash_mm",),
    "e_b": ("cross_slide_clearance_mm",),
    "limit": ("peak_to_peak_arcmin",),
    "runout": ("axis_eccentricity_mm", "wg_eccentricity_mm"),
}
"""What engineers call a quantity -> the keys that hold it; the paper's symbols are those of docs/conventions.md."""
MOST_KEYS = 4
MOST_KNOWN = 14
FAR_TOO_MANY = 60
"""More keys than a section has: the first of a whole study's would say nothing."""
UNIT = re.compile(r"_(?:(?:arcmin|nm)_per_(?:k|rad)|g_cm3|mm|um|deg|arcmin|nm|rpm|mpa|hz|percent|[hks])$")
"""The unit with which a key ends."""
LEAST_ALIKE = 0.75
"""Share of common letters from which a name counts as misspelt; below it 'ratio' would be like 'correlation'."""


def unknown_key(name: str, known: Sequence[str], elsewhere: Iterable[tuple[str, ...]] = ()) -> str:
    """'unknown key `name`' and which of the `known` was meant, or in which other section it stands: `elsewhere`, paths.

    Where nothing is near, the known keys follow, cut short.
    """
    said = f"unknown key {shown(name)}"
    with_unit = [key for key in known if key.startswith(f"{name}_")]
    if len(with_unit) == 1:
        return f"{said}; write {with_unit[0]!r}, with its unit"
    places = [f"[{path[0]}]" for path in elsewhere if len(path) == 2]
    if places:
        return f"{said}; it belongs into {' or '.join(places)}"
    near = near_keys(name, known)
    if near:
        return f"{said}; did you mean {' or '.join(map(repr, near))}?"
    if not known:
        return said
    if len(known) > FAR_TOO_MANY:
        return f"{said}; hdopt new NAME writes a study with every key explained"
    rest = f", ... ({len(known)} in all)" if len(known) > MOST_KNOWN else ""
    return f"{said}; known: {', '.join(known[:MOST_KNOWN])}{rest}"


def near_keys(name: str, known: Iterable[str]) -> list[str]:
    """Those of the `known` keys that `name` can mean, the likeliest first; [] where none makes sense."""
    known = list(known)
    name = name[:LONGEST_NAME]
    last = {key.rpartition(".")[2]: key for key in known}
    called = [last[key] for key in SYMBOLS.get(name.lower(), ()) if key in last]
    if called:
        return called
    spelt = _spelt_like(name, known)
    words = _words(name)
    sharing = _few([key for key in known if words and words <= _words(key)])
    if sharing and not (spelt and spelt[0] not in sharing):
        return _shortest(sharing)
    begun = _few([key for key in known if _begins(words, _words(key))])
    if begun and not (spelt and spelt[0] in begun):
        return _shortest(begun)
    return spelt


def _few(keys: list[str]) -> list[str]:
    """`keys`, [] where they are so many that naming them is no help."""
    return keys if len(keys) <= 2 * MOST_KEYS else []


def _shortest(keys: list[str]) -> list[str]:
    """Those of the `keys` with the fewest words, `MOST_KEYS` of them at most."""
    fewest = min(len(_words(key)) for key in keys)
    return [key for key in keys if len(_words(key)) == fewest][:MOST_KEYS]


def _begins(words: set[str], of: set[str]) -> bool:
    """Whether each of the `words` of somebody in a hurry begins one `of` a key's: temp, temperature."""
    return bool(words) and all(len(word) > 2 and any(one.startswith(word) for one in of) for word in words)


def _spelt_like(name: str, known: Sequence[str]) -> list[str]:
    """The one of the `known` keys whose spelling is nearest to `name`: as a whole, by its last part, or either without
    its unit, for nobody misspells the unit that he leaves out."""
    forms: dict[str, str] = {}
    for key in known:
        for form in (key, key.rpartition(".")[2]):
            forms.setdefault(form, key)
            forms.setdefault(UNIT.sub("", form), key)
    nearest = difflib.get_close_matches(name.lower(), forms, n=1, cutoff=LEAST_ALIKE)
    return [forms[form] for form in nearest]


def _words(key: str) -> set[str]:
    return {word for word in re.split(r"[^a-z0-9]+", key.lower()) if word}
