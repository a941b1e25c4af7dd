"""What a search can minimise or limit: each quantity of a design with its slopes over the design variables.

A quantity is the largest of one or more smooth pieces. Peak-to-peak and lag bring exact slopes of the kinematic error;
the rest are smooth scalars, cheap enough for central differences (right to 1e-8 of their size).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.drive.errors import ERROR_NAMES, DriveErrors
from hdopt.drive.geometry import Drive, Structure
from hdopt.errors import HdoptError, MissingValue, unknown_name
from hdopt.kinematics.closed_form import tip_geometry
from hdopt.kinematics.gradients import Extremes, extremes_of
from hdopt.kinematics.load_sharing import misalignment_share
from hdopt.kinematics.peak_to_peak import beat_extremes_arcmin, matrix_peak_to_peak_arcmin
from hdopt.mechanics.bearing_life import (
    BearingConstants,
    axial_force,
    bearing_life_h,
    bearing_load,
    radial_force,
    ring_force,
)
from hdopt.mechanics.bending import bending_stress, fatigue_safety, ring_wall
from hdopt.mechanics.contact import FLANKS, Contact
from hdopt.mechanics.lag import cross_slide_lag_arcmin
from hdopt.optimize.design_space import Combination, Design, DesignSpace

if TYPE_CHECKING:
    from hdopt.optimize.design_effects import DesignEffects
    from hdopt.optimize.sampled_teeth import SampledTeeth


NOMINAL, ROBUST = "peak_to_peak_arcmin", "peak_to_peak_quantile_arcmin"

STEP = 1e-5
"""Step of central differences as a share of a variable's range."""
LOWEST_USED = 4
"""How many of the lowest local minima of the kinematic error count as pieces."""
TURN = np.linspace(0.0, 2 * math.pi, 361)
WG_TILT_NAMES = ("wg_tilt_major", "wg_tilt_minor")
WG_TILTS = tuple(ERROR_NAMES.index(name) for name in WG_TILT_NAMES)
"""Their columns in `DriveErrors.to_matrix`."""


@dataclass(frozen=True)
class DesignConditions:
    """What a design is judged under: errors, load, life formula, and for quantiles a fixed sample of errors.

    `torque` (N mm) and `speed` (rad/s) are those the drive works under; `reference` is the drive
    that the makers' life formula rates.
    """

    errors: DriveErrors
    reference: Drive
    bearing: BearingConstants
    torque: float | None
    speed: float | None
    face_width: float | None
    backlash: float | None
    notch_factor: float = 2.2
    mean_stress_sensitivity: float = 0.2
    k_b: float = 1.0
    sample: Array | None = None
    teeth: SampledTeeth | None = None
    """Teeth of the sample's drives where they are drawn from tolerances of pitch."""
    quantile: float = 0.9973
    added: DesignEffects | None = None
    """Effects that count beside the errors."""
    structure_costs: tuple[tuple[Structure, float], ...] = ()
    """What structures cost, as shares of the objective; those left out cost nothing."""
    over_bore: tuple[bool, bool] = (False, False)
    """Whether the wave generator's tilts, along its major and its minor axis, are callouts over its fit's length."""

    def needed(self, name: str, needed_by: str) -> float:
        """The condition `name`, such as 'torque'; where it is not given, `MissingValue` says what is `needed_by` it."""
        value: float | None = getattr(self, name)
        if value is None:
            raise MissingValue(needed_by, _KEYS[name])
        return value

    def structure_factor(self, structure: Structure) -> float:
        """What the objective of a design of this `structure` is multiplied with where designs are compared."""
        return 1 + dict(self.structure_costs).get(structure, 0.0)

    @cached_property
    def rows(self) -> Array:
        return self.errors.to_matrix()

    def tilt_factor(self, design: Design) -> float:
        """How much larger than in the reference a tilt is that is a callout over the wave generator's width."""
        return self.reference.wave_generator.width / design.drive.wave_generator.width

    def scaled(self, rows: Array, factor: float) -> Array:
        """`rows` of `DriveErrors.to_matrix` of the reference with the tilts over the bore's length times `factor`."""
        if not any(self.over_bore):
            return rows
        changed = rows.copy()
        changed[:, [column for column, over in zip(WG_TILTS, self.over_bore, strict=True) if over]] *= factor
        return changed

    def of(self, rows: Array, design: Design) -> Array:
        """`rows` of the reference's errors as they are in `design`."""
        return self.scaled(rows, self.tilt_factor(design))

    def over_bore_of(self, rows: Array) -> Array:
        """What a factor of 1 on the tilts over the bore's length adds to `rows` (n, 12): all the rest is 0."""
        return rows - self.scaled(rows, 0.0)

    def errors_of(self, design: Design) -> DriveErrors:
        """The errors of the one drive as they are in `design`."""
        if not any(self.over_bore):
            return self.errors
        names = [name for name, over in zip(WG_TILT_NAMES, self.over_bore, strict=True) if over]
        factor = self.tilt_factor(design)
        return self.errors.with_(**{name: factor * getattr(self.errors, name) for name in names})

    @cached_property
    def weights(self) -> Array:
        """Weights of the sorted sample in the quantile (Harrell and Davis 1982): it moves smoothly with the design."""
        from scipy.stats import beta

        n = len(self.drawn())
        edges = beta.cdf(np.arange(n + 1) / n, (n + 1) * self.quantile, (n + 1) * (1 - self.quantile))
        return np.diff(edges)

    def drawn(self) -> Array:
        """The fixed sample of errors, rows of `DriveErrors.to_matrix`; `MissingValue` where there is none."""
        if self.sample is None:
            raise MissingValue("a quantile of the peak-to-peak", "a [tolerances] section")
        return self.sample


_KEYS = {
    "torque": "load.torque_nm",
    "speed": "load.input_speed_rpm",
    "face_width": "load.tooth_face_width_mm",
    "backlash": "clearances.backlash_mm",
}


@dataclass(frozen=True)
class Point:
    """A design under a trade, and its neighbours for differences over the `free` variables (name, step)."""

    space: DesignSpace
    trade: DesignConditions
    combination: Combination
    values: dict[str, float]
    free: tuple[tuple[str, float], ...] = ()
    _pairs: dict[int, tuple[Design, Design]] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def design(self) -> Design:
        return self.space.design(self.combination, self.values)

    def pair(self, index: int) -> tuple[Design, Design]:
        """The designs a step below and above in one free variable."""
        if index not in self._pairs:
            name, step = self.free[index]
            below, above = (
                self.space.design(self.combination, {**self.values, name: self.values[name] + sign * step})
                for sign in (-1, 1)
            )
            self._pairs[index] = below, above
        return self._pairs[index]

    @cached_property
    def extremes(self) -> Extremes:
        """Local extremes of the one drive, with slopes along its tilts over the bore's length."""
        return self.extremes_of(self.trade.rows)

    def extremes_of(self, rows: Array) -> Extremes:
        """The same of the drives with `rows` of the reference's errors."""
        return _envelope(self.design, self.trade.of(rows, self.design), self.trade.over_bore_of(rows))

    @cached_property
    def features(self) -> Array:
        """Slopes of `tip_features` and of the factor of the tilts over the free variables, (n, 6)."""
        factor = self.slopes(self.trade.tilt_factor)
        return np.column_stack([self.slopes(tip_features), factor])

    def along(self, slopes: Array) -> Array:
        """`slopes` (k, 5) of extremes, mm of arc, over the free variables, (k, n)."""
        return np.asarray(slopes @ self.features[:, (0, 1, 2, 3, 5)].T)

    def slopes(self, function: Callable[[Design], Array | float]) -> Array:
        """Central differences of `function` over the free variables: shape (n,) or, for vectors, (n, k)."""
        if not self.free:
            return np.empty((0, *np.shape(function(self.design))))
        return np.array(
            [
                (np.asarray(function(above)) - np.asarray(function(below))) / (2 * step)
                for (below, above), (_, step) in zip(map(self.pair, range(len(self.free))), self.free, strict=True)
            ]
        )


class Quantity(Protocol):
    """One figure of merit: title, unit, and whether small or large is good."""

    @property
    def title(self) -> str: ...

    @property
    def unit(self) -> str: ...

    @property
    def small_is_good(self) -> bool: ...

    def value(self, trade: DesignConditions, design: Design) -> float: ...

    def pieces(self, point: Point) -> tuple[Array, Array]:
        """Values (k,) whose largest is the quantity, and their slopes (k, n) over the point's free variables."""


@dataclass(frozen=True)
class Scalar:
    """A smooth quantity from one function of trade and design."""

    title: str
    unit: str
    function: Callable[[DesignConditions, Design], float]
    small_is_good: bool = True

    def value(self, trade: DesignConditions, design: Design) -> float:
        return float(self.function(trade, design))

    def pieces(self, point: Point) -> tuple[Array, Array]:
        value = self.value(point.trade, point.design)
        return np.array([value]), point.slopes(lambda design: self.value(point.trade, design))[None, :]


def tip_features(design: Design) -> Array:
    """L_W, rho0, b/2 (mm), tan(alpha) and arcmin per mm of arc, shape (5,): all that the kinematic error knows of a
    `design`."""
    tip, gear = tip_geometry(design.drive), design.drive.geometry
    tan_alpha = math.tan(gear.pressure_angle)
    return np.array([tip.semi_major, tip.tip_radius, tip.half_width, tan_alpha, gear.arcmin_per_mm])


def _piece(quantity: Quantity, point: Point) -> tuple[Array, Array]:
    """A quantity as one piece, with slopes by central differences."""
    value = quantity.value(point.trade, point.design)
    return np.array([value]), point.slopes(lambda design: quantity.value(point.trade, design))[None, :]


def _envelope(design: Design, rows: Array, along: Array | None = None) -> Extremes:
    return extremes_of(tip_geometry(design.drive), math.tan(design.drive.geometry.pressure_angle), rows, along)


def _spans(found: Extremes) -> Array:
    """Every maximum of one drive less each of its lowest minima, mm of arc, (k,)."""
    return np.asarray((found.highs[0][:, None] - found.lows[0, None, :LOWEST_USED]).ravel())


@dataclass(frozen=True)
class PeakToPeak:
    """Peak-to-peak of the errors in the study, k_e = 1: the envelope over all FS phases (see `envelope`).

    With effects there is no such envelope: the relative turn is walked, and local extremes are the pieces. Nor is there
    one of measured teeth: the beat of their tables is walked, and the whole is one piece.
    """

    title: str = "Peak-to-peak"
    unit: str = "arcmin"
    small_is_good: bool = True

    def value(self, trade: DesignConditions, design: Design) -> float:
        rows = trade.of(trade.rows, design)
        if trade.added is not None:
            return trade.added.peak_to_peak_arcmin(design.drive, rows[0])
        if design.drive.has_measured_teeth:
            return float(np.ptp(beat_extremes_arcmin(design.drive, rows)))
        found = _envelope(design, rows)
        return float((found.highs.max() - found.lows.min()) * design.drive.geometry.arcmin_per_mm)

    def pieces(self, point: Point) -> tuple[Array, Array]:
        trade = point.trade
        rows = trade.of(trade.rows, point.design)
        if trade.added is not None:
            spans_of = trade.added.spans_near(point.design.drive, rows[0], LOWEST_USED)

            def moved(design: Design) -> Array:
                return spans_of(design.drive, trade.of(trade.rows, design)[0])

            return moved(point.design), point.slopes(moved).T
        if point.design.drive.has_measured_teeth:
            return _piece(self, point)
        found = point.extremes
        spans, low_slopes = _spans(found), found.low_slopes[0, :LOWEST_USED]
        slopes = (found.high_slopes[0][:, None, :] - low_slopes[None, :, :]).reshape(len(spans), -1)
        scale = point.design.drive.geometry.arcmin_per_mm
        return scale * spans, scale * point.along(slopes) + np.outer(spans, point.features[:, 4])


@dataclass(frozen=True)
class PeakToPeakQuantile:
    """Quantile of the converged peak-to-peak under the tolerances, from a fixed sample (common random numbers).

    A weighted mean of the sample's upper order statistics, so that it moves smoothly; its slopes are the same mean of
    the drives' own. With effects, or teeth that are known one by one, there are no slopes in closed form: those of
    the drives that count are central differences.
    """

    title: str = "Peak-to-peak quantile"
    unit: str = "arcmin"
    small_is_good: bool = True

    def _sample(self, trade: DesignConditions, design: Design, chosen: Index | None = None) -> Array:
        """Peak-to-peak of the sample's drives, or of the `chosen`, built as `design`, arcmin, (n,)."""
        rows = trade.of(trade.drawn() if chosen is None else trade.drawn()[chosen], design)
        if trade.teeth is not None:
            added = None if trade.added is None else trade.added.table(design.drive)
            return trade.teeth.peak_to_peak_arcmin(design.drive, rows, chosen, added)
        if trade.added is not None:
            return trade.added.peaks_to_peaks_arcmin(design.drive, rows)
        return matrix_peak_to_peak_arcmin(design.drive, rows)

    def value(self, trade: DesignConditions, design: Design) -> float:
        weights = trade.weights
        return float(weights @ np.sort(self._sample(trade, design)))

    def pieces(self, point: Point) -> tuple[Array, Array]:
        trade = point.trade
        weights = trade.weights
        values = self._sample(trade, point.design)
        order = np.argsort(values)
        if not point.free:
            return np.array([float(weights @ values[order])]), np.empty((1, 0))
        counts = weights > 2e-3 * weights.max()
        chosen, share = order[counts], weights[counts]
        value, rows = float(weights @ values[order]), trade.drawn()[chosen]
        if point.design.drive.has_measured_teeth or trade.teeth is not None or trade.added is not None:
            each = point.slopes(lambda design: self._sample(trade, design, chosen)).T
            return np.array([value]), (share @ each / share.sum())[None, :]
        found = point.extremes_of(rows)
        n = np.arange(len(chosen))
        slopes = found.high_slopes[n, found.highs.argmax(axis=1)] - found.low_slopes[:, 0]
        scale = point.design.drive.geometry.arcmin_per_mm
        each = scale * point.along(slopes) + np.outer(values[chosen] / scale, point.features[:, 4])
        return np.array([value]), (share @ each / share.sum())[None, :]


@dataclass(frozen=True)
class LargestLag:
    """Largest lag over the turn (Jia 2021, Eqs. (33)-(35)): backlash less the lowest deviation, and the cross-slide."""

    title: str = "Largest lag"
    unit: str = "arcmin"
    small_is_good: bool = True

    def _slide(self, trade: DesignConditions, drive: Drive) -> float:
        return float(np.max(cross_slide_lag_arcmin(drive, trade.errors, TURN)))

    def value(self, trade: DesignConditions, design: Design) -> float:
        backlash = trade.needed("backlash", "the lag")
        scale, rows = design.drive.geometry.arcmin_per_mm, trade.of(trade.rows, design)
        if design.drive.has_measured_teeth:
            lowest = float(beat_extremes_arcmin(design.drive, rows)[:, 0].min())
        else:
            lowest = scale * float(_envelope(design, rows).lows.min())
        return backlash * scale - lowest + self._slide(trade, design.drive)

    def pieces(self, point: Point) -> tuple[Array, Array]:
        if point.design.drive.has_measured_teeth:
            return _piece(self, point)
        trade, scale, found = point.trade, point.design.drive.geometry.arcmin_per_mm, point.extremes
        play = trade.needed("backlash", "the lag") - found.lows[0, :LOWEST_USED]
        slide = point.slopes(lambda design: self._slide(trade, design.drive))
        lows = point.along(found.low_slopes[0, :LOWEST_USED])
        slopes = np.outer(play, point.features[:, 4]) - scale * lows
        return scale * play + self._slide(trade, point.design.drive), slopes + slide


def carrying_angle(trade: DesignConditions, design: Design) -> float:
    """Half angle over which the flanks of `design` carry under the backlash of `trade`, rad (`Mesh.carrying_angle`)."""
    backlash = trade.needed("backlash", "the carrying angle")
    return design.mesh.carrying_angle(design.drive.geometry.pressure_angle, backlash)


def contact(trade: DesignConditions, design: Design) -> Contact:
    """The teeth of `design` in contact under the backlash of `trade`, which k_e and flank pressure both count: flanks
    that carry, unless the study's drive says tips."""
    counts = trade.reference.geometry.contact or FLANKS
    return design.mesh.contact(counts, design.drive.geometry.pressure_angle, trade.backlash)


def face_width(trade: DesignConditions, drive: Drive) -> float | None:
    """Width of the tooth faces of `drive` that carries, mm: that of `trade` is the reference's, and it follows the wave
    generator's width, which backs it; None where it is not given."""
    if trade.face_width is None:
        return None
    return trade.face_width * drive.wave_generator.width / trade.reference.wave_generator.width


def flank_pressure(trade: DesignConditions, design: Design) -> float:
    """Mean pressure, N/mm^2, on the flanks of the teeth of `design` in `contact` under the torque and face width of
    `trade` (`Contact.flank_pressure`)."""
    torque, face = trade.needed("torque", "the flank pressure"), face_width(trade, design.drive)
    if face is None:
        face = trade.needed("face_width", "the flank pressure")
    return contact(trade, design).flank_pressure(torque, face)


def carrying_teeth(trade: DesignConditions, design: Design) -> float:
    """Teeth of one zone of `design`, one side counted, within the `carrying_angle` that `trade` leaves."""
    return design.drive.geometry.circular_spline_teeth * carrying_angle(trade, design) / (2 * math.pi)


def largest_bending_stress(trade: DesignConditions, design: Design) -> float:
    """Largest bending stress of the ring of `design`, N/mm^2, as a free ring; it does not depend on `trade`."""
    if design.drive.material is None:
        raise MissingValue("bending stress", "material.modulus_mpa", "material.poisson")
    change = design.mesh.largest_curvature_change
    return float(bending_stress(design.drive.material, ring_wall(design.drive.geometry), change))


def bending_safety(trade: DesignConditions, design: Design) -> float:
    """Safety against fatigue by bending, which alternates, on the hoop stress, which stays (`fatigue_safety`).

    Notch factor and sensitivity to the mean stress are those of `trade`, the alternating stress is the
    `largest_bending_stress` of `design` and the mean its `ring_hoop_stress`. Raises `MissingValue` where the material
    has no endurance limit.
    """
    material = design.drive.material
    if material is None or material.endurance is None:
        raise MissingValue("the safety against bending fatigue", "material.endurance_mpa")
    notched = trade.notch_factor * largest_bending_stress(trade, design)
    return fatigue_safety(material.endurance, notched, ring_hoop_stress(trade, design), trade.mean_stress_sensitivity)


def ring_hoop_stress(trade: DesignConditions, design: Design) -> float:
    """`hoop_stress` of the ring of `design`, N/mm^2; it does not depend on `trade`."""
    if design.drive.material is None:
        raise MissingValue("hoop stress", "material.modulus_mpa", "material.poisson")
    return design.mesh.stretch * design.drive.material.modulus


def trailing_flank_room(trade: DesignConditions, design: Design) -> float:
    """Least room of the trailing flank of `design` under the backlash of `trade`, mm; below 0 the flanks jam."""
    backlash = trade.needed("backlash", "the room of the trailing flank")
    return design.mesh.trailing_flank_room(design.drive.geometry.pressure_angle, backlash)


def tip_relief(trade: DesignConditions, design: Design) -> float:
    """What the straight flanks of `design` must be relieved by for the tooth's lean under the backlash of `trade`, um
    (`Mesh.tip_relief`)."""
    backlash = trade.needed("backlash", "the relief of the tips")
    return 1000 * design.mesh.tip_relief(design.drive.geometry.pressure_angle, backlash)


def largest_radial_force(trade: DesignConditions, design: Design) -> float:
    """`radial_force` on the wave generator of `design` under the torque of `trade`, N."""
    return radial_force(design.drive.geometry, trade.needed("torque", "the radial force"))


def largest_axial_force(trade: DesignConditions, design: Design) -> float:
    """`axial_force` on the wave generator of `design` under the torque and friction of `trade`, N."""
    torque = trade.needed("torque", "the axial force")
    return axial_force(design.drive.geometry, torque, trade.bearing.friction)


def life(trade: DesignConditions, design: Design) -> float:
    """L10 of the wave generator's bearing of `design`, hours, under the torque and speed of `trade`, from the life that
    the makers rate the reference drive of `trade` for (`bearing_life_h`)."""
    torque, speed = trade.needed("torque", "the bearing's life"), trade.needed("speed", "the bearing's life")
    constants, reference = trade.bearing, trade.reference
    load = bearing_load(design.drive.geometry, torque, constants.friction, ring_load(trade, design.drive))
    rated = bearing_load(reference.geometry, constants.rated_torque, constants.friction, ring_load(trade, reference))
    width, rated_width = design.drive.wave_generator.width, reference.wave_generator.width
    return bearing_life_h(load, width, rated, rated_width, speed, constants)


def wave_generator_load(trade: DesignConditions, design: Design) -> float:
    """`bearing_load` of `design` under the torque of `trade`, N, with the ring's force as far as it is modelled."""
    torque = trade.needed("torque", "the bearing's load")
    return bearing_load(design.drive.geometry, torque, trade.bearing.friction, ring_load(trade, design.drive))


def ring_load(trade: DesignConditions, drive: Drive) -> float:
    """`ring_force` that bends the toothed ring of `drive`, N, over its `face_width` under `trade`.

    0 where wall, face width or modulus is not given.
    """
    gear = drive.geometry
    face = face_width(trade, drive)
    if drive.material is None or gear.flexspline_wall is None or face is None:
        return 0.0
    deflection = drive.wave_generator.profile.semi_major - gear.flexspline_inner_radius
    return ring_force(gear, deflection, drive.material.modulus, face)


def evened_out(trade: DesignConditions, design: Design) -> float:
    """Peak-to-peak of `design` with the errors of `trade`, times k_e of its teeth in `contact` (Jia 2021, Eq. (13)),
    arcmin. With measured teeth k_e is for sines beside them only, and misalignment has its own mean."""
    k_e = contact(trade, design).homogenization(trade.k_b)
    rows, measured = trade.of(trade.rows, design), design.drive.has_measured_teeth
    misalignment = misalignment_share(design.drive) if measured else 1.0
    if trade.added is not None:
        from hdopt.simulation.own_teeth import SharedByTeeth

        return trade.added.peak_to_peak_arcmin(design.drive, rows[0], SharedByTeeth(k_e, misalignment, k_e))
    if measured:
        return float(np.ptp(beat_extremes_arcmin(design.drive, rows, None, misalignment, k_e)))
    return PeakToPeak().value(trade, design) * k_e


def _diameter(trade: DesignConditions, design: Design) -> float:
    gear = design.drive.geometry
    return gear.module * gear.circular_spline_teeth


QUANTITIES: dict[str, Quantity] = {
    NOMINAL: PeakToPeak(),
    ROBUST: PeakToPeakQuantile(),
    "evened_out_arcmin": Scalar("Peak-to-peak times k_e", "arcmin", evened_out),
    "lag_arcmin": LargestLag(),
    "flank_pressure_mpa": Scalar("Mean flank pressure", "MPa", flank_pressure),
    "bending_stress_mpa": Scalar("Bending stress", "MPa", largest_bending_stress),
    "curvature_change_per_mm": Scalar("Curvature change", "1/mm", lambda t, d: d.mesh.largest_curvature_change),
    "hoop_stress_mpa": Scalar("Hoop stress", "MPa", ring_hoop_stress),
    "bending_safety": Scalar("Safety against bending fatigue", "", bending_safety, False),
    "contact_angle_deg": Scalar("Contact angle", "deg", lambda t, d: math.degrees(d.mesh.contact_angle), False),
    "carrying_angle_deg": Scalar("Carrying angle", "deg", lambda t, d: math.degrees(carrying_angle(t, d)), False),
    "carrying_teeth": Scalar("Carrying teeth of one zone", "", carrying_teeth, False),
    "trailing_flank_room_mm": Scalar("Room of the trailing flank", "mm", trailing_flank_room, False),
    "tip_relief_um": Scalar("Tip relief for the tooth's lean", "um", tip_relief),
    "radial_force_n": Scalar("Radial force", "N", largest_radial_force),
    "axial_force_n": Scalar("Axial force", "N", largest_axial_force),
    "bearing_load_n": Scalar("Load of the WG bearing", "N", wave_generator_load),
    "ring_force_n": Scalar("of it, bending of the ring", "N", lambda t, d: ring_load(t, d.drive)),
    "bearing_life_h": Scalar("WG bearing life L10", "h", life, False),
    "width_mm": Scalar("WG width", "mm", lambda t, d: d.drive.wave_generator.width),
    "pitch_diameter_mm": Scalar("Pitch diameter of the CS", "mm", _diameter),
    "ratio": Scalar("Ratio", "", lambda t, d: d.drive.geometry.ratio),
}
"""Study-file key -> the quantity."""


def find_quantity(key: str) -> Quantity:
    """The quantity of this key; an unknown one is an error that names the nearest."""
    if key not in QUANTITIES:
        raise HdoptError(unknown_name("quantity", key, QUANTITIES))
    return QUANTITIES[key]
