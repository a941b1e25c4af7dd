"""The designs a search may choose from: variables with bounds and steps, choices, and how both make a drive."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache
from typing import Protocol

from hdopt.drive.geometry import TOOTH_DIFFERENCE, Drive, DriveGeometry, Structure
from hdopt.drive.profiles import Ellipse, Resal, TwoDisk, WaveGeneratorProfile
from hdopt.errors import HdoptError
from hdopt.mechanics.tooth_path import Mesh


@dataclass(frozen=True)
class Variable:
    """A design variable in the unit its name carries; `values` are the only ones allowed, where there are any."""

    name: str
    lower: float
    upper: float
    values: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not (math.isfinite(self.lower) and math.isfinite(self.upper) and self.lower < self.upper):
            raise HdoptError(
                f"{self.name} may run from {self.lower:g} to {self.upper:g}; the lower bound must be below the upper"
            )


VARIABLES: dict[str, tuple[str, str]] = {
    "pressure_angle_deg": ("Pressure angle", "deg"),
    "width_mm": ("WG width", "mm"),
    "module_mm": ("Module", "mm"),
    "deflection_ratio": ("Deflection / module", ""),
    "wrap_angle_deg": ("Wrap angle", "deg"),
}
"""Every variable there is: title and unit. `deflection_ratio` is the largest deflection w0 over the module."""

MESH_VARIABLES = ("module_mm", "deflection_ratio", "wrap_angle_deg")
"""Those that the shape of the mesh depends on."""


def _ellipse(radius: float, deflection: float, wrap: float) -> WaveGeneratorProfile:
    return Ellipse.of_equal_perimeter(radius, radius + deflection)


def _resal(radius: float, deflection: float, wrap: float) -> WaveGeneratorProfile:
    return Resal(radius, deflection)


def _two_disk(radius: float, deflection: float, wrap: float) -> WaveGeneratorProfile:
    return TwoDisk(radius, deflection, wrap)


PROFILE_MAKERS: dict[str, Callable[[float, float, float], WaveGeneratorProfile]] = {
    "ellipse": _ellipse,
    "resal": _resal,
    "two_disk": _two_disk,
}
"""Profile -> how it is made from the undeformed radius, the largest deflection (mm) and the wrap angle (rad)."""

OWN_VARIABLES = {"two_disk": ("wrap_angle_deg",)}
"""Variables that only some profiles have."""


class SizeRule(Protocol):
    """What stays when the module changes."""

    def teeth(self, baseline: DriveGeometry, module: float) -> float:
        """Teeth of the flexspline; between whole numbers while a search is under way."""

    def modules(self, baseline: DriveGeometry, lower: float, upper: float) -> tuple[float, ...]:
        """The modules allowed between two bounds; () for any."""


@dataclass(frozen=True)
class FixedToothCounts:
    """The ratio stays, the drive grows with its module."""

    def teeth(self, baseline: DriveGeometry, module: float) -> float:
        return baseline.flexspline_teeth

    def modules(self, baseline: DriveGeometry, lower: float, upper: float) -> tuple[float, ...]:
        return ()


@dataclass(frozen=True)
class FixedOutsideDiameter:
    """The circular spline's pitch circle stays, the tooth counts (and so the ratio) follow the module.

    Only modules that give even tooth counts are allowed, which keep the ratio whole.
    """

    def teeth(self, baseline: DriveGeometry, module: float) -> float:
        teeth = baseline.module * baseline.circular_spline_teeth / module - TOOTH_DIFFERENCE
        whole = round(teeth)
        # A multiple of 2^-20, so that the tooth difference is exact while the count is between whole numbers.
        return whole if abs(teeth - whole) < 1e-9 else math.ldexp(round(math.ldexp(teeth, 20)), -20)

    def modules(self, baseline: DriveGeometry, lower: float, upper: float) -> tuple[float, ...]:
        circle = baseline.module * baseline.circular_spline_teeth
        counts = range(2 * math.ceil(circle / upper / 2), 2 * math.floor(circle / lower / 2) + 1, 2)
        return tuple(sorted(circle / count for count in counts))


SIZE_RULES: dict[str, SizeRule] = {
    "fixed_tooth_counts": FixedToothCounts(),
    "fixed_outside_diameter": FixedOutsideDiameter(),
}


@dataclass(frozen=True)
class Combination:
    """One choice of profile and structure."""

    profile: str
    structure: Structure

    def __str__(self) -> str:
        return f"{self.profile}, {self.structure.value}"


@dataclass(frozen=True)
class Design:
    """One design with its drive and mesh; `values` by variable, those that do not apply left out."""

    combination: Combination
    values: Mapping[str, float]
    drive: Drive
    mesh: Mesh


@dataclass(frozen=True)
class DesignSpace:
    """Everything that may be chosen, about a `baseline` drive whose own values hold where nothing varies."""

    baseline: Drive
    wrap_angle_deg: float
    size: SizeRule
    variables: tuple[Variable, ...]
    combinations: tuple[Combination, ...]
    _meshes: Callable[[str, float, float, float], Mesh] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_meshes", lru_cache(maxsize=512)(self._mesh))

    def __reduce__(self) -> tuple[type[DesignSpace], tuple[object, ...]]:
        """What goes to another process: all but the meshes that are kept, which are made anew there."""
        return type(self), tuple(getattr(self, given.name) for given in fields(self) if given.init)

    @cached_property
    def baseline_values(self) -> dict[str, float]:
        """The baseline's value of every variable."""
        gear, generator = self.baseline.geometry, self.baseline.wave_generator
        return {
            "pressure_angle_deg": math.degrees(gear.pressure_angle),
            "width_mm": generator.width,
            "module_mm": gear.module,
            "deflection_ratio": (generator.profile.semi_major - gear.flexspline_inner_radius) / gear.module,
            "wrap_angle_deg": self.wrap_angle_deg,
        }

    def variables_of(self, combination: Combination) -> tuple[Variable, ...]:
        """Those that this combination has."""
        own = {name for names in OWN_VARIABLES.values() for name in names}
        has = OWN_VARIABLES.get(combination.profile, ())
        return tuple(variable for variable in self.variables if variable.name not in own or variable.name in has)

    def design(self, combination: Combination, values: Mapping[str, float]) -> Design:
        """The design with these values, the baseline's where one is not given. Raises `HdoptError` where impossible."""
        full = {**self.baseline_values, **values}
        mesh = self._meshes(combination.profile, full["module_mm"], full["deflection_ratio"], full["wrap_angle_deg"])
        geometry = replace(mesh.geometry, pressure_angle=math.radians(full["pressure_angle_deg"]))
        generator = replace(
            self.baseline.wave_generator,
            profile=mesh.profile,
            structure=combination.structure,
            width=float(full["width_mm"]),
        )
        shown = {name: full[name] for name in VARIABLES if name not in MESH_VARIABLES[2:]}
        if combination.profile in OWN_VARIABLES:
            shown["wrap_angle_deg"] = full["wrap_angle_deg"]
        return Design(combination, shown, replace(self.baseline, geometry=geometry, wave_generator=generator), mesh)

    def _mesh(self, profile: str, module: float, deflection_ratio: float, wrap_angle_deg: float) -> Mesh:
        geometry = scaled_geometry(self.baseline.geometry, self.size, module)
        maker = PROFILE_MAKERS[profile]
        curve = maker(geometry.flexspline_inner_radius, deflection_ratio * module, math.radians(wrap_angle_deg))
        return Mesh(geometry, curve)


def scaled_geometry(baseline: DriveGeometry, size: SizeRule, module: float) -> DriveGeometry:
    """The `baseline` gear with another `module` (mm): tooth heights grow with it, the wall keeps its thickness; `size`
    says whether the teeth keep their number or the gear its diameter.

    R_b = m Z_FS/2 - h_fF - s: the baseline's own dedendum h_fF (what its pitch radius leaves below the wall) scales.
    Tooth counts may lie between whole numbers while a search is under way; what it chooses has whole ones.
    """
    scale = module / baseline.module
    wall = baseline.flexspline_wall or 0.0
    dedendum = baseline.module * baseline.flexspline_teeth / 2 - baseline.flexspline_inner_radius - wall
    teeth = size.teeth(baseline, module)
    return replace(
        baseline,
        module=module,
        flexspline_teeth=teeth,  # type: ignore[arg-type]  # see above: a count between whole numbers, for a while
        circular_spline_teeth=teeth + TOOTH_DIFFERENCE,  # type: ignore[arg-type]  # the same
        flexspline_inner_radius=module * teeth / 2 - dedendum * scale - wall,
        flexspline_addendum=_times(baseline.flexspline_addendum, scale),
        circular_spline_addendum=_times(baseline.circular_spline_addendum, scale),
    )


def _times(value: float | None, scale: float) -> float | None:
    return None if value is None else value * scale
