"""What the text of an AP242 file must keep beyond its values: the CAx Implementor Forum's recommended practices.

Read from the text alone, without any CAD kernel: "Representation and Presentation of PMI (AP242)" and "Material
Identification and Density". Of both, what concerns the entities that hdopt writes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from hdopt.geometry.part21 import KINDS, Part21

SIZE_NAMES = {"diameter", "radius", "spherical diameter", "spherical radius", "thickness", "curve length"}
LOCATION_NAMES = {"linear distance", "linear distance outer", "linear distance inner", "curved distance"}
"""Names that the practices know, of those that hdopt may need."""

ZONE_FORMS = {"cylindrical or circular", "spherical", "within a circle", "between two concentric circles"}
"""Names of tolerance zones' forms, of those that hdopt may need."""

_NUMBER = re.compile(r"#(\d+)")


def arguments(body: str) -> list[str]:
    """The arguments of a simple instance `body`, split at commas outside of strings and parentheses."""
    inside = body[body.index("(") + 1 : body.rindex(")")]
    found, depth, quoted, start = [], 0, False, 0
    for place, sign in enumerate(inside):
        if sign == "'":
            quoted = not quoted
        elif not quoted and sign in "()":
            depth += 1 if sign == "(" else -1
        elif not quoted and sign == "," and depth == 0:
            found.append(inside[start:place].strip())
            start = place + 1
    return [*found, inside[start:].strip()]


def record(body: str, name: str) -> list[str] | None:
    """The arguments of the record `name` in the `body` of an instance, simple or complex; None where it has no such
    record."""
    found = re.search(rf"(?<![A-Z_]){name}\s*\(", body)
    if found is None:
        return None
    depth, quoted = 0, False
    for place in range(found.end() - 1, len(body)):
        sign = body[place]
        quoted ^= sign == "'"
        depth += 0 if quoted else {"(": 1, ")": -1}.get(sign, 0)
        if depth == 0:
            return arguments(body[found.start() : place + 1])
    return None


def numbers(text: str) -> list[int]:
    """The instances that a piece of text refers to."""
    return [int(number) for number in _NUMBER.findall(text)]


@dataclass(frozen=True)
class Practice:
    """The instances of a file, with what refers to what."""

    instances: dict[int, str]

    def of(self, name: str) -> Iterator[tuple[int, list[str]]]:
        """Number and arguments of every instance that holds the record `name`."""
        for number, body in self.instances.items():
            found = record(body, name)
            if found is not None:
                yield number, found

    @cached_property
    def faces(self) -> dict[int, list[tuple[int, int]]]:
        """Shape aspect -> the representations and items that stand for it."""
        found: dict[int, list[tuple[int, int]]] = {}
        for _, args in self.of("GEOMETRIC_ITEM_SPECIFIC_USAGE"):
            found.setdefault(numbers(args[2])[0], []).append((numbers(args[3])[0], numbers(args[4])[0]))
        return found

    @cached_property
    def related(self) -> dict[int, list[int]]:
        """Shape aspect -> those that it is related to."""
        found: dict[int, list[int]] = {}
        for _, args in self.of("SHAPE_ASPECT_RELATIONSHIP"):
            found.setdefault(numbers(args[2])[0], []).append(numbers(args[3])[0])
        return found

    @cached_property
    def shapes(self) -> dict[int, int]:
        """PRODUCT_DEFINITION_SHAPE -> its representation."""
        return {numbers(a[0])[0]: numbers(a[1])[0] for _, a in self.of("SHAPE_DEFINITION_REPRESENTATION")}

    def owner(self, aspect: int) -> int:
        """The PRODUCT_DEFINITION_SHAPE of a shape aspect, datum, compartment or datum system."""
        body = self.instances[aspect]
        args = record(body, "SHAPE_ASPECT") or arguments(body)
        return numbers(args[2])[0]

    def without_face(self, aspect: int) -> str | None:
        """What is wrong where an `aspect`, or one that it is composed of, has no face of its own part."""
        parts = [aspect] if aspect in self.faces else self.related.get(aspect, [])
        parts = [part for part in parts if record(self.instances[part], "DATUM") is None]
        if not parts:
            return f"#{aspect} belongs to no face"
        for part in parts:
            for representation, item in self.faces.get(part, [(0, 0)]):
                if not self.instances.get(item, "").startswith("ADVANCED_FACE"):
                    return f"#{part} belongs to no face"
                if representation != self.shapes.get(self.owner(part)) or self.owner(part) != self.owner(aspect):
                    return f"#{part} belongs to a face of another part"
        return None


def departures(text: str) -> list[str]:
    """What the `text` of an AP242 file does otherwise than ISO 10303-21 and the recommended practices."""
    file = Practice(Part21.of(text).instances)
    if lost := list(_references(file)):
        return lost
    rules = (_measures, _tolerances, _zones, _datums, _systems, _sizes, _density, _products)
    return [failure for rule in rules for failure in rule(file)]


def _references(file: Practice) -> Iterator[str]:
    for number, body in file.instances.items():
        if missing := [one for one in numbers(re.sub(r"'(?:[^']|'')*'", "", body)) if one not in file.instances]:
            yield f"#{number} refers to #{missing[0]}, which is not in the file"


def _measures(file: Practice) -> Iterator[str]:
    for number, args in file.of("MEASURE_WITH_UNIT"):
        if not re.match(r"[A-Z_]+\s*\(", args[0]):
            yield f"#{number}: the measure {args[0]} has no type (ISO 10303-21: a select is named)"
        elif "LENGTH_MEASURE_WITH_UNIT" not in file.instances[number]:
            yield f"#{number}: a length is a LENGTH_MEASURE_WITH_UNIT"


def _tolerances(file: Practice) -> Iterator[str]:
    for number, args in file.of("GEOMETRIC_TOLERANCE"):
        body = file.instances[number]
        if not any(record(body, kind) is not None for kind in KINDS):
            yield f"#{number} is a geometric tolerance of no kind"
        magnitude, aspect = numbers(args[2])[0], numbers(args[3])[0]
        stated = record(file.instances[magnitude], "LENGTH_MEASURE_WITH_UNIT")
        value = re.search(r"\(\s*([-+.\dEe]+)\s*\)", stated[0]) if stated else None
        if value is None or not float(value.group(1)) > 0:
            yield f"#{number} has no magnitude above 0"
        if wrong := file.without_face(aspect):
            yield f"#{number}: {wrong}"
        systems = record(body, "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE")
        for system in numbers(systems[0]) if systems else []:
            if file.owner(system) != file.owner(aspect):
                yield f"#{number} refers to datums of another part"


def _zones(file: Practice) -> Iterator[str]:
    for number, args in file.of("TOLERANCE_ZONE"):
        form = record(file.instances[numbers(args[5])[0]], "TOLERANCE_ZONE_FORM")
        if form is None or form[0].strip("'") not in ZONE_FORMS:
            yield f"#{number} has a zone whose form the practices do not know"
        if not numbers(args[4]):
            yield f"#{number} is the zone of no tolerance"
    for number, _ in file.of("RUNOUT_ZONE_DEFINITION"):
        yield f"#{number} defines the zone of a run-out, which none of the tolerances is"


def _datums(file: Practice) -> Iterator[str]:
    letters = [args[4] for _, args in file.of("DATUM")]
    for letter in sorted({letter for letter in letters if letters.count(letter) > 1}):
        yield f"{letter.strip(chr(39))} is the letter of several datums"
    features = {number for number, body in file.instances.items() if record(body, "DATUM_FEATURE") is not None}
    for number, args in file.of("DATUM"):
        letter = args[4].strip("'")
        if not re.fullmatch("[A-HJ-NP-Z]", letter) or args[3] != ".F.":
            yield f"#{number}: a datum has one letter and is not product-definitional"
        established = [one for one, related in file.related.items() if number in related and one in features]
        if len(established) != 1:
            yield f"datum {letter} is established by {len(established)} datum features"
        for feature in established:
            if wrong := file.without_face(feature):
                yield f"datum {letter}: {wrong}"


def _systems(file: Practice) -> Iterator[str]:
    for number, args in file.of("DATUM_SYSTEM"):
        compartments = [arguments(file.instances[one]) for one in numbers(args[4])]
        bases = [numbers(compartment[4])[0] for compartment in compartments]
        if not 1 <= len(bases) <= 3 or len(set(bases)) < len(bases):
            yield f"#{number} has {len(bases)} compartments"
        if any(file.owner(base) != file.owner(number) for base in bases):
            yield f"#{number} holds a datum of another part"


def _sizes(file: Practice) -> Iterator[str]:
    nominal = {numbers(a[0])[0]: numbers(a[1])[0] for _, a in file.of("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION")}
    limits = {numbers(a[1])[0] for _, a in file.of("PLUS_MINUS_TOLERANCE")}
    sizes = [(number, args[1], args[:1], SIZE_NAMES) for number, args in file.of("DIMENSIONAL_SIZE")]
    sizes += [(number, args[0], args[2:4], LOCATION_NAMES) for number, args in file.of("DIMENSIONAL_LOCATION")]
    for number, name, aspects, known in sizes:
        if name.strip("'") not in known:
            yield f"#{number} is a dimension of the unknown kind {name}"
        for aspect in aspects:
            if wrong := file.without_face(numbers(aspect)[0]):
                yield f"#{number}: {wrong}"
        held = numbers(arguments(file.instances[nominal[number]])[1]) if number in nominal else []
        if not any("'nominal value'" in file.instances[item] for item in held):
            yield f"#{number} has no item that is called 'nominal value'"
        if number not in limits:
            yield f"#{number} has no limits"


def _density(file: Practice) -> Iterator[str]:
    for number, args in file.of("MEASURE_REPRESENTATION_ITEM"):
        if args[:1] != ["'density measure'"]:
            continue
        powers = {}
        for element in numbers(arguments(file.instances[numbers(args[2])[0]])[0]):
            unit, power = arguments(file.instances[element])
            kind = "mass" if "MASS_UNIT" in file.instances[numbers(unit)[0]] else "length"
            powers[kind] = float(power)
        if powers != {"mass": 1.0, "length": -3.0}:
            yield f"#{number}: the unit of the density has the powers {powers}, not mass / length^3"


def _products(file: Practice) -> Iterator[str]:
    names = [args[0] for _, args in file.of("PRODUCT")]
    if len(set(names)) < len(names) or "''" in names:
        yield "two products have one number, or one has none"
    for number, args in file.of("PRODUCT_DEFINITION_FORMATION"):
        if args[0] == "''":
            yield f"#{number}: the product has no revision"
    materials = {numbers(a[2])[0] for _, a in file.of("PROPERTY_DEFINITION") if a[1] == "'material name'"}
    for number in materials:
        if not file.instances[number].startswith("PRODUCT_DEFINITION("):
            yield f"#{number} has a material and is no product definition"
