"""Wave-generator profiles: the closed curve that the loaded flexspline's inner wall takes.

A profile is a polar curve r(phi), phi in rad measured from the MAJOR axis, r in mm. The analytic ones are symmetric
about both axes. Every profile gives r, r' and r'' as exact functions; curvature and perimeter follow from them.
"""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.polar_points import last_place, require_one_point_an_angle, without_closing_point
from hdopt.drive.values import DriveError, require, require_positive
from hdopt.errors import HdoptError, shown
from hdopt.files import are_names, cells_of, on_commas, read_text
from hdopt.keywords import names_keywords
from hdopt.words import counted

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(64)


@runtime_checkable
class WaveGeneratorProfile(Protocol):
    """What every profile offers; see `PROFILES` for the registered kinds."""

    @property
    def name(self) -> str: ...

    @property
    def semi_major(self) -> float:
        """Radius at phi = 0 (L_W), mm."""

    @property
    def semi_minor(self) -> float:
        """Radius at phi = pi/2 (D_W), mm."""

    @property
    def tip_is_smooth(self) -> bool:
        """Whether both tips are alike and well described by one radius of curvature (the closed form needs that)."""

    def radius(self, phi: ArrayLike, derivative: int = 0) -> Array:
        """r(phi) in mm, or its first or second derivative in mm/rad, mm/rad^2; same shape as `phi`."""

    def perimeter(self) -> float:
        """Length of the closed curve, mm."""


def curvature(profile: WaveGeneratorProfile, phi: ArrayLike) -> Array:
    """Curvature kappa(phi) = (r^2 + 2 r'^2 - r r'')/(r^2 + r'^2)^1.5 of the profile, 1/mm; same shape as `phi`."""
    r, r1, r2 = (profile.radius(phi, order) for order in (0, 1, 2))
    return polar_curvature(r, r1, r2)


def polar_curvature(r: Array, r1: Array, r2: Array) -> Array:
    """Curvature of a polar curve, 1/mm: (r^2 + 2 r'^2 - r r'')/(r^2 + r'^2)^1.5.

    `r` is the radius, mm, `r1` (mm/rad) and `r2` (mm/rad^2) its derivatives over the angle; all of one shape. Above
    zero where the curve bends around the centre; 1/r for a circle.
    """
    return (r**2 + 2 * r1**2 - r * r2) / (r**2 + r1**2) ** 1.5


def tip_radius_of_curvature(profile: WaveGeneratorProfile) -> float:
    """rho0: the radius of curvature where the profile meets its major axis, mm (ellipse: D_W^2/L_W)."""
    return float(1.0 / curvature(profile, 0.0))


def perimeter_error(profile: WaveGeneratorProfile, flexspline_inner_radius: float) -> float:
    """Perimeter of `profile` less that of the undeformed FS inner wall of `flexspline_inner_radius`, mm.

    Above zero, the profile stretches the flexspline.
    """
    return profile.perimeter() - 2 * math.pi * flexspline_inner_radius


def _arc_length(profile: WaveGeneratorProfile, start: float, end: float) -> float:
    """Length of the profile between two angles, by 64-point Gauss quadrature (no kink may lie between them)."""
    half = (end - start) / 2
    phi = start + half * (1 + _GAUSS_NODES)
    return half * float(_GAUSS_WEIGHTS @ np.hypot(profile.radius(phi), profile.radius(phi, 1)))


def _fold(phi: ArrayLike) -> tuple[Array, Array]:
    """Angle folded into 0..pi/2 by the symmetry about both axes, and the sign that odd derivatives take."""
    half_turn: Array = np.mod(np.asarray(phi, float), math.pi)
    second = half_turn > math.pi / 2
    return np.where(second, math.pi - half_turn, half_turn), np.where(second, -1.0, 1.0)


def _check_derivative(derivative: int) -> None:
    if derivative not in (0, 1, 2):
        raise ValueError(f"derivative is {derivative!r}; it must be 0, 1 or 2")


@names_keywords
@dataclass(frozen=True)
class Ellipse:
    """Ellipse with the given semi-axes, mm (Jia 2021, Eq. (36) when both have the flexspline's perimeter)."""

    semi_major: float
    semi_minor: float
    name = "ellipse"
    tip_is_smooth = True

    def __post_init__(self) -> None:
        require_positive(semi_major=self.semi_major, semi_minor=self.semi_minor)
        require(
            self.semi_minor < self.semi_major,
            f"semi_minor is {self.semi_minor:g} mm, semi_major {self.semi_major:g} mm; "
            "the minor axis must be the shorter one",
        )

    @classmethod
    def of_equal_perimeter(cls, undeformed_radius: float, semi_major: float) -> Ellipse:
        """The ellipse as long as the circle of `undeformed_radius`, mm (Jia 2021, Eq. (36))."""
        from scipy.optimize import brentq

        _check_deflection(undeformed_radius, semi_major - undeformed_radius)

        def excess(semi_minor: float) -> float:
            return cls(semi_major, semi_minor).perimeter() - 2 * math.pi * undeformed_radius

        lowest = undeformed_radius - 3 * (semi_major - undeformed_radius)
        return cls(semi_major, brentq(excess, lowest, undeformed_radius, xtol=1e-13, rtol=1e-15))

    def radius(self, phi: ArrayLike, derivative: int = 0) -> Array:
        _check_derivative(derivative)
        a, b = self.semi_major, self.semi_minor
        phi = np.asarray(phi, float)
        g: Array = (b * np.cos(phi)) ** 2 + (a * np.sin(phi)) ** 2
        g1: Array = (a * a - b * b) * np.sin(2 * phi)
        g2: Array = 2 * (a * a - b * b) * np.cos(2 * phi)
        found: Array
        if derivative == 0:
            found = a * b / np.sqrt(g)
        elif derivative == 1:
            found = -0.5 * a * b * g1 * g**-1.5
        else:
            found = a * b * (0.75 * g1 * g1 * g**-2.5 - 0.5 * g2 * g**-1.5)
        return found

    def perimeter(self) -> float:
        from scipy.special import ellipe

        return float(4 * self.semi_major * ellipe(1 - (self.semi_minor / self.semi_major) ** 2))


@names_keywords
@dataclass(frozen=True)
class TwoDisk:
    """Ring bent by two discs, in contact over the wrap angle gamma to either side of the major axis (Eq. (38)).

    `undeformed_radius` R and `max_deflection` w0 in mm, `wrap_angle` gamma in rad, 0 <= gamma < pi/2.
    w and its first two derivatives are continuous at gamma.
    """

    undeformed_radius: float
    max_deflection: float
    wrap_angle: float
    name = "two_disk"
    tip_is_smooth = True

    def __post_init__(self) -> None:
        _check_deflection(self.undeformed_radius, self.max_deflection)
        require(
            math.isfinite(self.wrap_angle) and 0 <= self.wrap_angle < math.pi / 2,
            f"wrap angle is {math.degrees(self.wrap_angle):g} deg; it must lie between 0 and 90 deg",
        )

    @property
    def semi_major(self) -> float:
        return self.undeformed_radius + self.max_deflection

    @property
    def semi_minor(self) -> float:
        return float(self.radius(math.pi / 2))

    @property
    def _constants(self) -> tuple[float, float]:
        """A and B of Eq. (38)."""
        gamma, rest = self.wrap_angle, math.pi / 2 - self.wrap_angle
        a = rest - math.sin(gamma) * math.cos(gamma)
        b = 4 / math.pi * (math.cos(gamma) - rest * math.sin(gamma))
        return a, b

    def radius(self, phi: ArrayLike, derivative: int = 0) -> Array:
        _check_derivative(derivative)
        a, b = self._constants
        scale = self.max_deflection / (a - b)
        sin_gamma = math.sin(self.wrap_angle)
        phi, sign = _fold(phi)
        rest = math.pi / 2 - phi
        sin, cos = np.sin(phi), np.cos(phi)
        on_disc = phi <= self.wrap_angle
        if derivative == 0:
            free = (1 + sin_gamma**2) * sin + rest * cos - 2 * sin_gamma - b
            return self.undeformed_radius + scale * np.where(on_disc, a * cos - b, free)
        if derivative == 1:
            return sign * scale * np.where(on_disc, -a * sin, sin_gamma**2 * cos - rest * sin)
        return scale * np.where(on_disc, -a * cos, (1 - sin_gamma**2) * sin - rest * cos)

    def perimeter(self) -> float:
        return 4 * (_arc_length(self, 0.0, self.wrap_angle) + _arc_length(self, self.wrap_angle, math.pi / 2))


@names_keywords
@dataclass(frozen=True)
class Resal:
    """Ring bent by two opposite radial forces (Resal's curve, Jia 2021, Eq. (37)): the two-disk curve of zero wrap.

    `undeformed_radius` R and `max_deflection` w0 in mm.
    """

    undeformed_radius: float
    max_deflection: float
    name = "resal"
    tip_is_smooth = True

    def __post_init__(self) -> None:
        _check_deflection(self.undeformed_radius, self.max_deflection)

    @property
    def semi_major(self) -> float:
        return self.undeformed_radius + self.max_deflection

    @property
    def semi_minor(self) -> float:
        return float(self.radius(math.pi / 2))

    def radius(self, phi: ArrayLike, derivative: int = 0) -> Array:
        _check_derivative(derivative)
        phi, sign = _fold(phi)
        t = math.pi / 2 - phi
        scale = self.max_deflection / (1 / math.pi - math.pi / 8)
        if derivative == 0:
            return self.undeformed_radius + scale * (1 / math.pi - (t * np.sin(t) + np.cos(t)) / 4)
        if derivative == 1:
            return sign * scale * t * np.cos(t) / 4
        return -scale * (np.cos(t) - t * np.sin(t)) / 4

    def perimeter(self) -> float:
        return 4 * _arc_length(self, 0.0, math.pi / 2)


@names_keywords
@dataclass(frozen=True)
class MeasuredProfile:
    """A measured profile: polar points joined by a periodic quintic spline that may smooth them.

    `angles` in rad from the major axis, over one turn, and `radii` in mm, both of shape (n,), n >= 16. `noise` is
    the standard deviation of a point's radius, mm: the spline is the smoothest that stays within it; 0 interpolates.
    The curve's own centre and shape are kept, so its two tips may differ: kinematics searches its contour.
    """

    angles: Array
    radii: Array
    noise: float = 0.0
    source: str = "array"
    _spline: tuple[Array, Array, int] = field(init=False, repr=False, compare=False)
    _inside: tuple[MeasuredProfile, float] | None = field(init=False, repr=False, compare=False, default=None)
    name = "measured"
    tip_is_smooth = False

    MINIMUM_POINTS = 16
    LARGEST_GAP = math.radians(30)
    AXIS_TOLERANCE = math.radians(10)

    def __post_init__(self) -> None:
        from scipy.interpolate import splrep

        angles = np.mod(np.asarray(self.angles, float), 2 * math.pi)
        radii = np.asarray(self.radii, float)
        where = f"measured profile {self.source}"
        require(angles.ndim == 1 and angles.shape == radii.shape, f"{where}: angles and radii must be two equal lists")
        require(
            len(angles) >= self.MINIMUM_POINTS,
            f"{where} has {counted(len(angles), 'point')}; at least {self.MINIMUM_POINTS} are needed",
        )
        require(
            bool(np.all(np.isfinite(angles)) and np.all(np.isfinite(radii))),
            f"{where} holds an angle or a radius that is not finite; leave the point out",
        )
        least = radii.argmin()
        require(
            radii[least] > 0,
            f"{where} has the radius {radii[least]:.6g} mm at {math.degrees(angles[least]):.6g} deg; radii must be "
            "above 0, in the second column",
        )
        require(
            math.isfinite(self.noise) and self.noise >= 0, f"{where}: noise is {self.noise!r} mm; it must be 0 or above"
        )
        require_one_point_an_angle(angles, where)
        order = np.argsort(angles)
        angles, radii = angles[order], radii[order]
        gaps = np.diff(np.append(angles, angles[0] + 2 * math.pi))
        # A whole turn in rad, read as deg.
        of_radians = "; these look like angles in rad, give them in deg" if math.degrees(np.ptp(angles)) < 6.3 else ""
        require(
            gaps.max() <= self.LARGEST_GAP,
            f"{where} has no point for {math.degrees(gaps.max()):.3g} deg after "
            f"{math.degrees(angles[gaps.argmax()]):.4g} deg; gaps of up to {math.degrees(self.LARGEST_GAP):g} deg "
            f"are allowed{of_radians}",
        )
        closed = np.append(angles, angles[0] + 2 * math.pi), np.append(radii, radii[0])
        weights = np.full(len(angles) + 1, 1 / self.noise if self.noise else 1.0)
        spline = splrep(*closed, w=weights, k=5, s=len(angles) if self.noise else 0, per=True)
        for name, value in (("angles", angles), ("radii", radii), ("_spline", spline)):
            object.__setattr__(self, name, value)
        two_lobes = np.angle(np.sum(self.radius(grid := np.arange(720) * math.pi / 360) * np.exp(2j * grid))) / 2
        require(
            abs(two_lobes) <= self.AXIS_TOLERANCE,
            f"{where} has its major axis at {math.degrees(two_lobes):.3g} deg; measure angles from the major axis "
            f"(within {math.degrees(self.AXIS_TOLERANCE):g} deg)",
        )

    @classmethod
    def from_csv(cls, path: str | Path, noise: float = 0.0) -> MeasuredProfile:
        """Read the rows of `read_polar`, angle_deg, radius_mm; `noise`, mm, as in the class."""
        return cls(*read_polar(Path(path), "measured profile"), noise, source=str(path))

    @property
    def semi_major(self) -> float:
        """Mean of the radii at both tips, mm."""
        return float(np.mean(self.radius([0.0, math.pi])))

    @property
    def semi_minor(self) -> float:
        """Mean of the radii on the minor axis, mm."""
        return float(np.mean(self.radius([math.pi / 2, 3 * math.pi / 2])))

    def radius(self, phi: ArrayLike, derivative: int = 0) -> Array:
        from scipy.interpolate import splev

        _check_derivative(derivative)
        start = self._spline[0][5]
        in_turn: Array = start + np.mod(np.asarray(phi, float) - start, 2 * math.pi)
        return np.asarray(splev(in_turn, self._spline, der=derivative))

    def perimeter(self) -> float:
        knots = np.unique(np.clip(self._spline[0], self._spline[0][5], self._spline[0][5] + 2 * math.pi))
        return sum(_arc_length(self, a, b) for a, b in itertools.pairwise(knots))

    @property
    def table(self) -> MeasuredProfile:
        """The profile through the points that were measured: another one where this is its parallel curve."""
        return self if self._inside is None else self._inside[0]

    def smoothed(self, noise: float) -> MeasuredProfile:
        """The profile of the same points with another `noise`, mm."""
        if self._inside is None:
            return MeasuredProfile(self.angles, self.radii, noise, self.source)
        table, distance = self._inside
        return parallel_profile(table.smoothed(noise), distance)

    @property
    def off_centre(self) -> float:
        """How far the centroid of the area within the curve lies from the origin of its angles, mm."""
        phi = np.arange(3600) * (math.pi / 1800)
        r = self.radius(phi)
        return float(abs(np.sum(r**3 * np.exp(1j * phi)) / 3) / (np.sum(r**2) / 2))


POLAR = ("angle_deg", "radius_mm")
"""Names of the columns of a measured curve."""
_OTHER_UNIT = re.compile(r"(?<![a-zA-Z])(?:rad|gon|arcmin|turns?|[uµμ]m|inch|cm|x_mm|y_mm|diameter)(?![a-zA-Z])", re.I)
"""What a header says of angles that are not in deg, or of lengths that are no radii in mm."""


def read_polar(path: Path, what: str) -> tuple[Array, Array]:
    """Angles (rad) and radii (mm) from the CSV file `path` of rows angle_deg, radius_mm, (n,) each, as they stand; a
    last point that closes the turn is left out (`without_closing_point`).

    A header line is optional, `#` starts a comment; between semicolons or tabs, numbers may have a decimal comma. A
    header with both names may have more columns, and in any order, and stand below lines of words. Raises
    `DriveError`, for a header that names other units too, that names `what`, file and line.
    """
    try:
        text = read_text(path, "a CSV text file", foreign=True)
    except HdoptError as error:
        raise DriveError(f"{what} {path}: cannot be read ({error})") from error
    points: list[tuple[float, float, float]] = []
    names: list[str] = []
    header_allowed = True
    lines = [
        (number, line, [cell.strip() for cell in cells_of(line)])
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    for number, line, cells in lines[_above_names(lines) :]:
        where = f"{what} {path}, line {number}: {shown(line)}"
        if header_allowed and are_names(cells):
            names = _named(cells, where)
        else:
            points.append(
                _point(cells, names, f"{where}; each line must hold", on_commas(line, cells, len(names) or 2))
            )
        header_allowed = False
    require(bool(points), f"{what} {path} holds no points; give lines of angle_deg,radius_mm")
    angles, radii, places = np.array(points).T
    return without_closing_point(angles, radii, float(places.min()), f"{what} {path}")


def _above_names(lines: list[tuple[int, str, list[str]]]) -> int:
    """How many of the `lines` of a table (number, text, cells) stand above a header with both names and hold words, as
    what a measuring machine writes there; 0 where there is no such header, or numbers are above it."""
    at = next((i for i, (_, _, cells) in enumerate(lines) if set(POLAR) <= set(cells)), 0)
    return at if all(are_names(cells[:1]) for _, _, cells in lines[:at]) else 0


def _named(names: list[str], where: str) -> list[str]:
    """The `names` of a header that has those of angle and radius; none where it has other words for the two. `where`
    begins the message of a header that does not fit."""
    if set(POLAR) <= set(names):
        return names
    other = _OTHER_UNIT.search(" ".join(names))
    require(
        other is None,
        f"{where} names {other[0] if other else ''}; give angles in deg and radii in mm, and name the columns "
        f"{','.join(POLAR)}",
    )
    return []


def _point(cells: list[str], names: list[str], where: str, hint: str) -> tuple[float, float, float]:
    """Angle (rad), radius (mm) and the unit of the radius's last digit (mm) of a row of `cells`, by the `names` of
    their columns where a header gave them; `where` begins and `hint` ends the message of a row that holds something
    else."""
    beyond = bool(names) and any(cells[len(names) :])
    try:
        told, radius_told = [cells[names.index(name)] for name in POLAR] if names and not beyond else cells
        angle, radius = float(told), float(radius_told)
    except (ValueError, IndexError):
        raise DriveError(f"{where} two numbers, {','.join(POLAR)}{hint}") from None
    require(math.isfinite(angle) and math.isfinite(radius), f"{where} finite numbers; leave the point out")
    return math.radians(angle), radius, last_place(radius_told)


def parallel_profile(profile: WaveGeneratorProfile, distance: float, points: int = 1440) -> MeasuredProfile:
    """The profile at a constant `distance` mm outside another one, through `points` points moved along its normals.

    So the flexspline's inner wall follows from a measured cam and the thickness of the flexible bearing on it.
    """
    phi = np.arange(points, dtype=np.float64) * (2 * math.pi / points)
    r, r1 = profile.radius(phi), profile.radius(phi, 1)
    length = np.hypot(r, r1)
    # In polar components the unit normal is (r, -r') / sqrt(r^2 + r'^2): outward, and against the slope.
    outward, along = r + distance * r / length, -distance * r1 / length
    source = f"{getattr(profile, 'source', profile.name)}, {distance:g} mm outside"
    angles = np.asarray(phi + np.arctan2(along, outward), float)
    found = MeasuredProfile(angles, np.asarray(np.hypot(outward, along), float), source=source)
    if isinstance(profile, MeasuredProfile):
        object.__setattr__(found, "_inside", (profile, distance))
    return found


PROFILES: dict[str, type] = {"ellipse": Ellipse, "resal": Resal, "two_disk": TwoDisk, "measured": MeasuredProfile}
"""The registered profiles by the name a study file uses."""


def _check_deflection(undeformed_radius: float, max_deflection: float) -> None:
    require_positive(undeformed_radius=undeformed_radius, max_deflection=max_deflection)
    require(
        max_deflection < undeformed_radius / 5,
        f"the maximum deflection is {max_deflection:g} mm on a radius of {undeformed_radius:g} mm; "
        "the ring formulas hold for small deflection, below a fifth of the radius",
    )
