"""The gears of the bench: four drives of one size, and what a drive has as it is built."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import TypeAlias

import numpy as np
from scipy.interpolate import CubicSpline

from hdopt.bench.arrays import Array

PRESSURE_ANGLE = np.deg2rad(12.0)
TURN = 2 * np.pi
# Points of a contour that is known as a table, and waves of Resal's series: the last adds 1e-9 of the deflection.
CONTOUR_POINTS, RESAL_WAVES = 4096, 200


Point: TypeAlias = tuple[Array, Array]
"""Components along the minor and the major axis."""


@dataclass(frozen=True)
class Gear:
    """One drive: teeth, the contour of its wave generator, and which eccentricity its coupling takes away.

    As built it may have harmonics of the contour (`cam`: order, um, phase), a k_e that varies round the input's turn
    (`k_e`: order, share, phase) and an error of every tooth's own place (mm).
    """

    name: str
    fs_teeth: int
    cs_teeth: int
    module_mm: float
    semi_major_mm: float
    semi_minor_mm: float
    profile: str = "ellipse"  # or "resal": a ring bent by two opposite forces
    structure: str = "integral"
    width_mm: float = 9.0
    cam: tuple[tuple[int, float, float], ...] = ()
    k_e: tuple[tuple[int, float, float], ...] = ()
    cs_pitch_mm: tuple[float, ...] = ()
    fs_pitch_mm: tuple[float, ...] = ()

    @property
    def ratio(self) -> float:
        return self.fs_teeth / (self.cs_teeth - self.fs_teeth)

    @property
    def floats_major(self) -> bool:
        return self.structure in ("automatic", "one_way_major")

    @property
    def floats_minor(self) -> bool:
        return self.structure in ("automatic", "one_way_minor")

    @property
    def radius_mm(self) -> float:
        """Inner radius of the undeformed flexspline."""
        return self.semi_major_mm - self.module_mm

    def rad_per_mm(self, theta: Array) -> Array | float:
        """Output rotation (rad) for one mm of arc at input angles `theta` (rad)."""
        share = 1.0 + sum(a * np.cos(order * theta + phase) for order, a, phase in self.k_e)
        return share * TURN / (np.pi * self.module_mm * self.fs_teeth)

    def contour(self, u: Array) -> tuple[Point, Point, Point]:
        """Contour point (mm along the minor and the major axis) at parameter `u` (rad), and both derivatives."""
        if self.profile == "ellipse" and not self.cam:
            s, c = np.sin(u), np.cos(u)
            a, b = self.semi_minor_mm, self.semi_major_mm
            return (a * s, b * c), (a * c, -b * s), (-a * s, -b * c)
        table = _radius(self.profile, self.semi_major_mm, self.semi_minor_mm, self.module_mm, self.cam)
        s, c = np.sin(u), np.cos(u)
        r, r1, r2 = (table(u % TURN, order) for order in range(3))
        return (
            (r * s, r * c),
            (r1 * s + r * c, r1 * c - r * s),
            (r2 * s + 2 * r1 * c - r * s, r2 * c - 2 * r1 * s - r * c),
        )


@cache
def _radius(
    profile: str, semi_major: float, semi_minor: float, deflection: float, cam: tuple[tuple[int, float, float], ...]
) -> CubicSpline:
    """Polar radius (mm) over the angle from the major axis, as a periodic spline."""
    phi = TURN * np.arange(CONTOUR_POINTS + 1) / CONTOUR_POINTS
    if profile == "ellipse":
        r = semi_major * semi_minor / np.hypot(semi_minor * np.cos(phi), semi_major * np.sin(phi))
    else:  # the ring's Fourier series under two opposite forces: waves n = 2, 4, ... as 1/(n^2 - 1)^2
        n = 2 * np.arange(1, RESAL_WAVES + 1)
        size = 1 / (n**2 - 1.0) ** 2
        r = semi_major - deflection + deflection * (np.cos(np.outer(phi, n)) @ size) / size.sum()
    r = r + sum(1e-3 * um * np.cos(order * phi + phase) for order, um, phase in cam)
    r[-1] = r[0]
    return CubicSpline(phi, r, bc_type="periodic")


CSF = Gear("csf-25-80", 160, 162, 0.396, 31.046, 30.318)
GEARS = {
    gear.name: gear
    for gear in (
        CSF,
        Gear("bench-30", 60, 62, 1.056, 31.046, 29.0, structure="automatic"),
        Gear("bench-100", 200, 202, 0.3168, 31.046, 30.45, profile="resal"),
        Gear("bench-160", 320, 322, 0.198, 31.046, 30.652, structure="one_way_major"),
    )
}
"""The shipped drive, and three of its size with other ratios, structures and contours."""

BUILT = ("pitch errors", "cam harmonics", "varying k_e")


def as_built(gear: Gear, kind: str, rng: np.random.Generator) -> Gear:
    """`gear` with a `kind` of thing that real ones have (`BUILT`), its size drawn by `rng`."""
    if kind == "pitch errors":
        um = rng.uniform(0.2, 0.8, 2)
        cs, fs = 1e-3 * um[0] * rng.standard_normal(gear.cs_teeth), 1e-3 * um[1] * rng.standard_normal(gear.fs_teeth)
        return replace(gear, cs_pitch_mm=tuple(cs), fs_pitch_mm=tuple(fs))
    if kind == "cam harmonics":
        orders = rng.choice(np.arange(3, 13), size=rng.integers(2, 5), replace=False)
        return replace(gear, cam=tuple((int(k), rng.uniform(0.5, 3), rng.uniform(0, TURN)) for k in orders))
    if kind == "varying k_e":
        return replace(gear, k_e=tuple((k, rng.uniform(0.02, 0.08), rng.uniform(0, TURN)) for k in (1, 2, 4)))
    raise ValueError(f"no gear is built with {kind!r}; the bench knows {', '.join(BUILT)}")


def study_text(gear: Gear) -> str:
    """A study file (TOML) with the nominal `gear`, for `hdopt diagnose --drive FILE`."""
    axes = f"semi_major_mm = {gear.semi_major_mm}\nsemi_minor_mm = {gear.semi_minor_mm}\n"
    return (
        f"[drive]\nflexspline_teeth = {gear.fs_teeth}\ncircular_spline_teeth = {gear.cs_teeth}\n"
        f"module_mm = {gear.module_mm}\npressure_angle_deg = {np.rad2deg(PRESSURE_ANGLE):.9g}\n"
        f"flexspline_inner_radius_mm = {gear.radius_mm:.9g}\n\n"
        f'[wave_generator]\nprofile = "{gear.profile}"\nstructure = "{gear.structure}"\nwidth_mm = {gear.width_mm}\n'
        + (axes if gear.profile == "ellipse" else f"semi_major_mm = {gear.semi_major_mm}\n")
    )
