"""The text of a STEP file (ISO 10303-21) read for what it says of tolerances, without any CAD kernel."""

from __future__ import annotations

import re
from dataclasses import dataclass

KINDS = {
    "SURFACE_PROFILE_TOLERANCE": "profile",
    "CYLINDRICITY_TOLERANCE": "cylindricity",
    "COAXIALITY_TOLERANCE": "coaxiality",
    "POSITION_TOLERANCE": "position",
    "PERPENDICULARITY_TOLERANCE": "perpendicularity",
    "PARALLELISM_TOLERANCE": "parallelism",
    "SYMMETRY_TOLERANCE": "symmetry",
}

_INSTANCE = re.compile(r"#(\d+)\s*=\s*((?:'(?:[^']|'')*'|[^';])*);")
_STRING = re.compile(r"'(?:[^']|'')*'")
_REFERENCE = re.compile(r"#(\d+)")
_VALUE = re.compile(r"LENGTH_MEASURE\s*\(\s*([-+.\dEe]+)\s*\)|MEASURE_WITH_UNIT\s*\(\s*([-+.\dEe]+)\s*,")


@dataclass(frozen=True, order=True)
class StatedTolerance:
    """A geometric tolerance as the text has it: kind, zone in mm, datums in their order."""

    kind: str
    zone: float
    datums: str


@dataclass(frozen=True, order=True)
class StatedSize:
    """A size as the text has it: nominal, lower and upper deviation, mm."""

    nominal: float
    lower: float
    upper: float


@dataclass(frozen=True)
class Part21:
    """The instances of a file's DATA section: number -> what stands after the equals sign."""

    instances: dict[int, str]

    @classmethod
    def of(cls, text: str) -> Part21:
        """Read the text of a file."""
        data = text.split("DATA;", 1)[-1]
        return cls({int(number): " ".join(body.split()) for number, body in _INSTANCE.findall(data)})

    def tolerances(self) -> list[StatedTolerance]:
        """All geometric tolerances with their magnitudes and datum systems, sorted."""
        found = []
        for body in self.instances.values():
            kind = next((name for word, name in KINDS.items() if re.search(rf"\b{word}\s*\(", body)), None)
            if kind is None:
                continue
            inside = re.search(r"\bGEOMETRIC_TOLERANCE\s*\(([^)]*)\)", body) or re.search(r"\(([^)]*)\)", body)
            assert inside is not None
            magnitude = self._value(int(_REFERENCE.findall(inside.group(1))[0]))
            system = re.search(r"WITH_DATUM_REFERENCE\s*\(\s*\(([^)]*)\)", body)
            references = _REFERENCE.findall(system.group(1)) if system else []
            found.append(StatedTolerance(kind, magnitude, "".join(self._letters(int(r)) for r in references)))
        return sorted(found)

    def sizes(self) -> list[StatedSize]:
        """All sizes and distances with plus-minus tolerances, sorted."""
        nominal = {}
        for body in self._of("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"):
            dimension, representation = (int(number) for number in _REFERENCE.findall(body)[:2])
            items = re.findall(r"\(([^()]*)\)", self.instances[representation])
            numbers = [int(number) for number in _REFERENCE.findall(items[0] if items else "")]
            values = [self._value(number) for number in numbers if "MEASURE" in self.instances[number]]
            if values:
                nominal[dimension] = values[0]
        found = []
        for body in self._of("PLUS_MINUS_TOLERANCE"):
            limits, dimension = (int(number) for number in _REFERENCE.findall(body)[:2])
            low, high = (self._value(int(number)) for number in _REFERENCE.findall(self.instances[limits])[:2])
            found.append(StatedSize(nominal[dimension], low, high))
        return sorted(found)

    def products(self) -> list[tuple[str, str, str]]:
        """Identifier, name and description of every product, sorted."""
        found = []
        for body in self._of("PRODUCT"):
            said = [text[1:-1] for text in _STRING.findall(body)[:3]]
            found.append((said[0], said[1], said[2]))
        return sorted(found)

    def faces_with_tolerances(self) -> int:
        """How many faces a shape aspect with a tolerance or a datum points to."""
        usages = self._of("GEOMETRIC_ITEM_SPECIFIC_USAGE")
        items = {int(_REFERENCE.findall(body)[-1]) for body in usages}
        return sum("ADVANCED_FACE" in self.instances[item] for item in items)

    def _of(self, name: str) -> list[str]:
        return [body for body in self.instances.values() if re.match(rf"{name}\s*\(", body)]

    def _value(self, number: int) -> float:
        found = _VALUE.search(self.instances[number])
        if found is None:
            raise ValueError(f"#{number} of the STEP file holds no measure")
        return float(found.group(1) or found.group(2))

    def _letters(self, system: int) -> str:
        """The datums of a datum system in the order of its compartments."""
        letters = ""
        for number in _REFERENCE.findall(self.instances[system])[1:]:
            for reference in _REFERENCE.findall(self.instances[int(number)]):
                body = self.instances[int(reference)]
                if re.match(r"DATUM\s*\(", body):
                    letters += _STRING.findall(body)[-1][1:-1]
        return letters
