"""Whether a figure keeps its limit, given how well it was measured (ISO 14253-1:2017)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from hdopt.errors import HdoptError, shown, unknown_name

GUARD = 1.645
"""Guard band in standard uncertainties: conformity with a probability of 95 %, the default of ISO 14253-1, 5.3."""

LIMIT_UNITS = {"arcmin": 1.0, "arcsec": 1 / 60, "deg": 60.0, "": 1.0}
SLOPE_UNITS = {"arcmin/deg": 1.0, "arcsec/deg": 1 / 60, "": 1.0}
"""Of the slope, which is an error per degree of input."""
LIMIT_NAMES = (
    "peak_to_peak",
    "one_turn",
    "recording",
    "rms",
    "return_error",
    "repeatability",
    "slope",
    "hysteresis_loss",
)

LARGEST_LIMIT_ARCMIN = 1e6


@dataclass(frozen=True)
class Decision:
    """One limit: the `value` measured with its standard `uncertainty`, the `limit`, and `verdict` "met", "missed" or
    "not decidable" (also where there is no value). `note` says which figure was held against it."""

    name: str
    value: float | None
    uncertainty: float
    limit: float
    verdict: str
    note: str = ""

    @property
    def met(self) -> bool | None:
        """True, False, or None where that cannot be decided."""
        return {"met": True, "missed": False}.get(self.verdict)


def decide(name: str, value: float | None, uncertainty: float, limit: float, note: str = "") -> Decision:
    """Hold `value` with its standard `uncertainty` against the upper `limit` of `name`; `note` goes with it.

    Met below the limit less the guard band, missed above the limit plus the guard band, not decidable between.
    """
    if value is None:
        return Decision(name, None, uncertainty, limit, "not decidable", note)
    guard = GUARD * uncertainty
    verdict = "met" if abs(value) <= limit - guard else "missed" if abs(value) > limit + guard else "not decidable"
    return Decision(name, value, uncertainty, limit, verdict, note)


def unit_of(name: str) -> str:
    """The unit of the figure `name` of `LIMIT_NAMES`, as a limit is kept."""
    return "arcmin/deg" if name == "slope" else "arcmin"


def parse_limits(text: str | None) -> dict[str, float]:
    """`peak_to_peak=1.0arcmin,return_error=30arcsec` by name, in `unit_of` each; `text` None gives none."""
    found: dict[str, float] = {}
    for item in (text or "").split(","):
        if not item.strip():
            continue
        name, equals, rest = (part.strip() for part in item.partition("="))
        match = re.fullmatch(r"([0-9.]+(?:[eE][-+]?\d+)?)\s*([a-z/]*)", rest)
        if not equals and re.fullmatch(r"\d+\s*[a-z/]*", name):
            raise HdoptError(f"--limit {text!r} has a decimal comma; write a point, such as peak_to_peak=1.0arcmin")
        if not equals or match is None:
            raise HdoptError(f"--limit holds {item.strip()!r}; write NAME=NUMBERarcmin, such as peak_to_peak=1.0arcmin")
        if name not in LIMIT_NAMES:
            raise HdoptError(unknown_name("figure in --limit", name, LIMIT_NAMES))
        if name in found:
            raise HdoptError(f"--limit gives {name} twice; name each figure once")
        units = SLOPE_UNITS if name == "slope" else LIMIT_UNITS
        if match.group(2) not in units:
            known = ", ".join(filter(None, units))
            raise HdoptError(f"--limit gives {name} in {shown(match.group(2))}; its unit is one of {known}")
        try:
            value = float(match.group(1)) * units[match.group(2)]
        except ValueError as error:
            raise HdoptError(f"--limit gives {name} {match.group(1)!r}, which is no number") from error
        if not 0 < value < LARGEST_LIMIT_ARCMIN:
            raise HdoptError(f"--limit gives {name} {value:g} {unit_of(name)}; give a number above 0")
        found[name] = value
    return found


def checked_limits(limits: Mapping[str, float] | str) -> dict[str, float]:
    """`limits` as name -> arcmin, from such a mapping or from words as `parse_limits` takes them.

    Raises `HdoptError` for a name that is no figure and for a limit that is not above 0.
    """
    if isinstance(limits, str):
        return parse_limits(limits)
    for name, value in limits.items():
        if name not in LIMIT_NAMES:
            raise HdoptError(unknown_name("figure among the limits", str(name), LIMIT_NAMES))
        if not (isinstance(value, int | float) and 0 < value < LARGEST_LIMIT_ARCMIN):
            raise HdoptError(f"the limit of {name} is {value!r}; give a number of arcmin above 0")
    return dict(limits)


def verdict_line(decision: Decision, units: Mapping[str, str]) -> str:
    """One `decision` in words; `units` by figure, arcmin where it is not there."""
    unit = units.get(decision.name, "arcmin")
    if decision.value is None:
        return f"{decision.name}: not decidable, {decision.note or 'not measured'} (limit {decision.limit:g} {unit})"
    off = decision.limit - abs(decision.value)
    side = "below" if off >= 0 else "above"
    text = f"{decision.name}: {decision.verdict}, {abs(decision.value):.4g} {unit} is {abs(off):.3g} "
    text += f"{side} {decision.limit:g}"
    return f"{text}, guard band {GUARD * decision.uncertainty:.2g}{'; ' + decision.note if decision.note else ''}"
