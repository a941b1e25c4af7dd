"""What every effect is, and what each may say of itself beyond the minimum: a base class with defaults."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import Category, Declared, Numbers, Quantity, Sines, needed
from hdopt.effects.estimate import FitEstimate, Parameter, counted
from hdopt.effects.grid_search import Axis, search_on_grid
from hdopt.effects.met import Met
from hdopt.effects.probe import Probe
from hdopt.effects.requirements import requirement
from hdopt.effects.term import Shape, Term

Keys = Mapping[str, object]
"""Keys of [effects.ID] with their values, those left out missing."""


class Explanation(ABC):
    """What may explain a part of a kinematic error: an effect of the catalogue, or a description that competes."""

    id: ClassVar[str]
    domain: ClassVar[str]
    """Where it lives: order, angle, direction, reversal, torque, speed, temperature or time."""
    needs_base: ClassVar[bool] = False
    """Whether it acts on or through the base model's zones."""
    high_order: ClassVar[bool] = False
    """Whether it has so many waves a turn that it is looked for on the rows as recorded too."""
    exact_shape: ClassVar[bool] = False
    """Whether its columns are known to the last digit, so that nothing of it is left for another to explain."""
    leaves_nothing: ClassVar[bool] = False
    """Whether it reaches no orders but its own."""
    sudden: ClassVar[bool] = False
    """Whether it happens within a few rows, so that it may be sharper than the shape that is fitted to it."""
    has_parts: ClassVar[bool] = False
    """Whether `every_part_shows` asks anything."""
    excites: ClassVar[bool] = False
    """Whether its columns move the drive's output, as whatever acts in the zones does."""
    driven: ClassVar[bool] = False
    """Whether its columns follow the drive's own motion (`response`)."""
    at_once: ClassVar[bool] = False
    """Whether what is `driven` answers in each row to the motion of that row alone."""

    same_each_time: ClassVar[bool] = False
    """Whether it is the same each time that it is met, turn by turn."""

    aside: ClassVar[bool] = False
    """Whether the search asks for it once, when all others are weighed, and not among them."""

    special_case_of: ClassVar[str] = ""
    """The effect of which this one is a special case: both at once are unlikely."""

    @abstractmethod
    def lacks(self, conditions: Conditions) -> str | None:
        """What the recordings would need to show it, or None where they can."""

    @abstractmethod
    def search(self, probe: Probe) -> Sequence[Term]:
        """The best terms for this residual, one for each variant worth considering."""

    @abstractmethod
    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        """The term at a given shape, kept to what the recordings can show.

        `motion` (n,), arcmin, is the drive's own error before its spring, which only what is `driven` needs.
        """

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        """Whether a fit has all that the term stands for; asked only where `has_parts`."""
        return True

    def may_imitate(self, term: Term, estimate: FitEstimate) -> bool:
        """Whether the `term`, as it imitates another effect, has numbers that it may have."""
        return self.every_part_shows(term, estimate)

    def beyond_search(self, probe: Probe) -> Sequence[Term]:
        """Further terms by which it could imitate what `probe` sees, that no search need look at: none for most."""
        return ()

    def trimmed(self, term: Term, coefficients: Array) -> Shape | None:
        """The shape of what shows of a fitted term, or None where all of it does."""
        return None

    def shortened(self, term: Term) -> Sequence[Shape]:
        """Shapes that bend less than the term's own, the widest first."""
        return ()

    def is_part_of(self, shape: Shape, other: Shape) -> bool:
        """Whether this effect at `shape` belongs to the same at `other`, such as a cycle to an encoder's lines."""
        return False

    def in_zones(self, shape: Shape) -> Sequence[Shape]:
        """Shapes of the same inside the meshing zones, to be tried in its place; none for most."""
        return ()

    def reads_input(self, shape: Shape) -> bool:
        """Whether at `shape` it is an error of the input angle as it is read: by so much the drive stands elsewhere."""
        return False

    def other_laws(self, conditions: Conditions, term: Term, motion: Array) -> Mapping[str, Sequence[Array]]:
        """Columns like those of its `term`, each (n, p), by other laws than its own, those of the "speed", the "time"
        and the "direction"; none for most. Where one of these explains better, it is not this effect that is there.
        `motion` (n,), arcmin, is the drive's own error."""
        return {}

    def other_forms(self, shape: Shape) -> Sequence[Shape]:
        """Shapes of the same physics in other forms, of which a real part may have any: an interval takes in what each
        that explains as well says. None for most."""
        return ()

    def at_the_same_orders(self, conditions: Conditions, term: Term) -> Sequence[Term]:
        """Other terms of the same that stand at the orders of `term`: what tells them apart is how the drive moves
        beside them, which no look at what is left shows. None for most."""
        return ()

    def tooth_by_tooth(self, term: Term, coefficients: Array, ratio: float) -> Sequence[Shape]:
        """Shapes of the same with a height of every tooth's own, all alike, from which a fit of them begins: those of
        `term` in the zones with these `coefficients`, on a drive of this `ratio`. None for most."""
        return ()

    def response(self, conditions: Conditions, shape: Shape, coefficients: Array, motions: Array) -> Array:
        """What a `driven` term adds at these coefficients where each of `motions` (n, k) excites it, (n, k), arcmin."""
        raise NotImplementedError(f"{self.id} follows no motion")


def terms_at(effect: Explanation, conditions: Conditions, shapes: Sequence[Shape]) -> list[Term]:
    """`effect` at `shapes` that every search of the same rows looks at: made once, and remembered with their
    `conditions`.
    """
    made = []
    for shape in shapes:
        key = (effect.id, *sorted(shape.items()))
        if key not in conditions.remembered:
            conditions.remembered[key] = replace(effect.term(conditions, shape), kept=True)
        made.append(conditions.remembered[key])
    return made


class Effect(Explanation):
    """One physics left out of the base model: one file that says all that is known of it.

    The least that an effect says: `id`, `domain`, `separating`, `declared`, and its `columns` (or `met`, or `zones`).
    What follows from these by default may be said otherwise by any effect.
    """

    place: ClassVar[int] = 1000
    """Where it stands in lists of the catalogue; effects of the same place by their ids."""
    title: ClassVar[str] = ""
    """Its name in a heading, where the id does not make it."""
    separating: ClassVar[str]
    """The measurement that would show it apart from others."""
    declared: ClassVar[tuple[Declared, ...]] = ()
    """Its numbers and categories."""
    examples: ClassVar[tuple[Keys, ...]] = ()
    """Keys of [effects.ID], one set a variant, for tests and for the docs."""
    acts: ClassVar[str] = "beside"
    """'zones': it adds to the deviation of each meshing zone; 'beside': to the kinematic error. For the docs."""
    bench_part: ClassVar[str] = ""
    """Part of the bench which measures that it comes from; '' for an effect of the drive."""
    nuisance: ClassVar[str] = ""
    """The nuisance of a diagnosis that takes up all that it can do, so that beside it it is not looked for."""
    signed_by_error: ClassVar[tuple[str, ...]] = ()
    """Its numbers in a diagnosis whose sign is the error's: it turns where the angles are counted the other way."""
    needs_strain_wave: ClassVar[bool] = False
    """Whether it stands at the orders of a strain wave gear's teeth or bearing: of another gear they mean nothing."""
    radial: ClassVar[bool] = False
    """Whether it is a radial deviation, of which the pressure angle makes the arc."""
    needs: ClassVar[Mapping[str, str]] = {}
    """Numbers of an operating condition that it needs, with their study keys."""
    needs_said: ClassVar[str] = ""
    """The same for the docs, where it depends on the shape."""
    shifts_one_way: ClassVar[bool] = False
    """Whether it only shifts a motion in one direction."""

    # What it does

    def columns(self, conditions: Conditions, shape: Shape) -> Array | None:
        """What it adds to the kinematic error, arcmin per coefficient, (n, p): first the declared quantities with a
        scale, then sine and cosine of each of the declared sines; None where it acts in the zones."""
        return None

    def met(self, shape: Shape) -> Met | None:
        """The deviation on a spline's teeth or rim, which each zone meets where its deepest point is, mm of arc per
        coefficient; None where it stands on neither."""
        return None

    def zones(self, conditions: Conditions, shape: Shape) -> Array | None:
        """What it adds to the deviation of zones 1 and 2 otherwise, mm of arc per coefficient, (2, n, p)."""
        return None

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        kept = dict(shape)
        steps = {}
        for axis in self._axes:
            kept[axis.name] = axis.inside(kept[axis.name])
            steps[axis.name] = axis.step(kept[axis.name])
        trials = float(max(self._grid_size, 1))
        columns, zones = self.columns(conditions, kept), self.zones(conditions, kept)
        return Term(self.id, kept, columns=columns, zones=zones, met=self.met(kept), steps=steps, trials=trials)

    def predict(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        """The same physics where it is simulated: without the limits of a record, and settled where it has a memory."""
        return self.term(conditions, shape, motion)

    def lasting(self, shape: Shape) -> int | None:
        """How many of its columns last, where others fade after the start of a recording; None for all."""
        return None

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        """Orders (cycles an input turn) that it adds to the spectrum, where it is made of sines."""
        return []

    def named_orders(self, shape: Shape, ratio: float) -> list[float]:
        """Of these the ones that say where it lives; of an effect with none the strongest are measured."""
        return self.orders(shape, ratio)

    def orders_of_columns(self, term: Term, ratio: float) -> list[float]:
        """Orders (cycles an input turn) of its sines, one for each sine and cosine with which the columns of `term`
        begin, on a drive of this `ratio`; none where they are no sines."""
        orders = self.orders(term.shape, ratio)
        return orders * (term.width // (2 * len(orders))) if orders else []

    def highest_order(self, shape: Shape, ratio: float) -> float:
        """The highest order that a sampling of it must resolve."""
        return max(self.orders(shape, ratio), default=0.0)

    # What a recording must hold, and how it is looked for

    def lacks(self, conditions: Conditions) -> str | None:
        return requirement(self.domain, conditions)

    def search(self, probe: Probe) -> Sequence[Term]:
        return search_on_grid(probe, self._axes, self._discrete, lambda shape: self.term(probe.samples, shape))

    @property
    def _shape_quantities(self) -> list[Quantity]:
        return [d for d in self.declared if isinstance(d, Quantity) and d.scale is None]

    @property
    def _axes(self) -> list[Axis]:
        """The continuous numbers of its shape, with their prior ranges."""
        return [Axis(q.key, *q.prior) for q in self._shape_quantities if not q.whole and q.prior is not None]

    @property
    def _discrete(self) -> dict[str, list[object]]:
        """Its categories and whole numbers, each with the values that a search tries."""
        found: dict[str, list[object]] = {d.key: list(d.choices) for d in self.declared if isinstance(d, Category)}
        for q in self._shape_quantities:
            if q.whole and q.prior is not None:
                found[q.key] = list(range(int(q.prior[0]), int(q.prior[1]) + 1))
        return found

    @property
    def _grid_size(self) -> int:
        size = 1
        for axis in self._axes:
            size *= len(axis.grid)
        for values in self._discrete.values():
            size *= len(values)
        return size

    # Its numbers: in a study, and from a fit

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        """Shape and coefficients of an effect whose [effects.ID] has these `keys`, on a drive with this `gear`.

        Raises `HdoptError` for keys that do not go together.
        """
        shape: dict[str, object] = {}
        coefficients: list[float] = []
        for item in self.declared:
            if isinstance(item, Category):
                shape[item.key] = item.choices(str(keys[item.key]))
            elif isinstance(item, Quantity) and item.scale is None:
                value = needed(keys, item.key)
                shape[item.key] = int(value) if item.whole else value
            elif isinstance(item, Quantity) and item.scale is not None:
                coefficients.append(needed(keys, item.key) / item.scale)
        for item in self.declared:
            if isinstance(item, Sines):
                coefficients += item.coefficients(item.given(self.id, keys), item.members)
        return shape, tuple(coefficients)

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        """The inverse: the keys of [effects.ID] that stand for an effect."""
        found: dict[str, object] = {}
        at = 0
        for item in self.declared:
            if isinstance(item, Category):
                found[item.key] = str(shape[item.key])
            elif isinstance(item, Quantity) and item.scale is None:
                found[item.key] = shape[item.key]
            elif isinstance(item, Quantity) and item.scale is not None:
                found[item.key] = coefficients[at] * item.scale
                at += 1
        for item in self.declared:
            if isinstance(item, Sines):
                found |= item.written(item.members, coefficients[at : at + 2 * len(item.members)])
                at += 2 * len(item.members)
        return found

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        """The effect's numbers with units and intervals, by their names in a diagnosis."""
        found: dict[str, Parameter] = {}
        at = 0
        for item in self.declared:
            if isinstance(item, Quantity) and item.scale is not None:
                found[item.name] = estimate.parameter(at, item.unit, scale=item.scale)
                at += 1
        for item in self.declared:
            if isinstance(item, Sines):
                for amplitude, phase in item.members.values():
                    found[amplitude] = estimate.amplitude(at, at + 1, item.unit, scale=1 / item.scale)
                    found[phase] = estimate.phase_deg(at, at + 1)
                    at += 2
        free = list(term.steps)
        for quantity in self._shape_quantities:
            if quantity.key in term.steps:
                found[quantity.name] = estimate.parameter(term.width + free.index(quantity.key), quantity.unit)
            elif quantity.whole and quantity.key in term.shape:
                found[quantity.name] = counted(term.shape[quantity.key])
        return found

    def as_seen(
        self, parameters: dict[str, Parameter], term: Term, conditions: Conditions, contribution: Array
    ) -> dict[str, Parameter]:
        """The `parameters` of a fitted `term` as the recordings show them, by their rows (`conditions`) and what the
        term adds there, `contribution` (n,) arcmin. The same for most."""
        return parameters

    def may_be_part_of(self, parameters: Mapping[str, Parameter]) -> tuple[str, ...]:
        """Ids of effects that, beside it, would explain as much where it has such `parameters`: any of them may be what
        a part of it was taken for. None for most."""
        return ()

    def categories(self, shape: Shape) -> dict[str, str]:
        """The categories of a fitted shape by their declared names, such as the shaft of an encoder."""
        return {d.key: str(shape[d.key]) for d in self.declared if isinstance(d, Category) and d.key in shape}

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        """One plain sentence for an engineer."""
        return f"{self.heading}: {rms_arcmin:.2g} arcmin rms."

    # What else is known of it

    @property
    def heading(self) -> str:
        """Its name as a heading."""
        return self.title or self.id.replace("_", " ").capitalize()

    @property
    def origin(self) -> str:
        """'bench' or 'drive'."""
        return "bench" if self.bench_part else "drive"

    def needs_of(self, shape: Shape) -> Mapping[str, str]:
        """The numbers of an operating condition that it needs at this shape, with their study keys."""
        return self.needs

    def remark(self, shape: Shape, both_ways: bool) -> str | None:
        """What the operating condition keeps from showing, in plain words; `both_ways`: the motion reverses."""
        if self.shifts_one_way and not both_ways:
            return (
                f"{self.id} only shifts a one-way motion, which leaves its peak-to-peak as it is; "
                'operation.motion = "both" shows it'
            )
        return None

    def flat_declared(self) -> list[Quantity | Numbers | Category]:
        """Its study keys one by one, sines as amplitudes and phases."""
        flat: list[Quantity | Numbers | Category] = []
        for item in self.declared:
            flat += item.quantities() if isinstance(item, Sines) else [item]
        return flat
