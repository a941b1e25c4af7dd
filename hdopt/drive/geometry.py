"""What a drive is made of: gear geometry, wave generator, clearances, material and load.

Every class here is a frozen record in base units (mm, N, rad, s) that refuses impossible values when it is made.
Nothing is computed from physics here; derived sizes are plain properties.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from hdopt.drive.profiles import WaveGeneratorProfile
from hdopt.drive.roundness import MeasuredRoundness
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.drive.values import require, require_not_negative, require_positive, require_positive_if_given
from hdopt.keywords import names_keywords

ARCMIN = math.pi / 10800.0
"""One arcmin in rad."""

TOOTH_DIFFERENCE = 2
"""CS teeth minus FS teeth: the model is of wave generators with two lobes, one tooth of difference a lobe."""


@names_keywords
@dataclass(frozen=True)
class DriveGeometry:
    """Teeth and sizes of flexspline (FS) and circular spline (CS); Jia 2021, Table 1.

    Lengths in mm, `pressure_angle` in rad. The circular spline stands still, the flexspline is the output.
    """

    flexspline_teeth: int
    circular_spline_teeth: int
    module: float
    pressure_angle: float
    flexspline_inner_radius: float
    flexspline_addendum: float | None = None
    circular_spline_addendum: float | None = None
    flexspline_wall: float | None = None
    contact: str | None = None
    """What counts as contact, "tips" or "flanks" (`hdopt.mechanics.contact`); None leaves it to what is computed."""

    def __post_init__(self) -> None:
        z_fs, z_cs = self.flexspline_teeth, self.circular_spline_teeth
        require_positive(flexspline_teeth=z_fs, circular_spline_teeth=z_cs)
        require(
            z_cs > z_fs,
            f"circular_spline_teeth is {z_cs}, flexspline_teeth is {z_fs}; "
            "the circular spline must have more teeth than the flexspline",
        )
        require(
            z_cs - z_fs == TOOTH_DIFFERENCE,
            f"the tooth difference is {z_cs - z_fs} ({z_cs} - {z_fs}); the model is of two-lobed wave generators, "
            f"which need a difference of exactly {TOOTH_DIFFERENCE}",
        )
        require_positive(module=self.module, flexspline_inner_radius=self.flexspline_inner_radius)
        require(
            math.isfinite(self.pressure_angle) and 0 < self.pressure_angle < math.pi / 4,
            f"pressure_angle is {math.degrees(self.pressure_angle):g} deg; it must lie between 0 and 45 deg",
        )
        require_positive_if_given(
            flexspline_addendum=self.flexspline_addendum,
            circular_spline_addendum=self.circular_spline_addendum,
            flexspline_wall=self.flexspline_wall,
        )

    @property
    def ratio(self) -> float:
        """Reduction ratio N = Z_FS/(Z_CS - Z_FS)."""
        return self.flexspline_teeth / (self.circular_spline_teeth - self.flexspline_teeth)

    @property
    def flexspline_pitch_length(self) -> float:
        """l_FS = pi m Z_FS, mm."""
        return math.pi * self.module * self.flexspline_teeth

    @property
    def arcmin_per_mm(self) -> float:
        """Output rotation for one mm of arc on the FS pitch line, 2 pi/l_FS in arcmin (Jia 2021, Eq. (32))."""
        return 2 * math.pi / self.flexspline_pitch_length / ARCMIN

    @property
    def flexspline_advance(self) -> float:
        """Z_CS/Z_FS: angle by which the FS tooth under the major axis moves on, for one rad of input angle."""
        return self.circular_spline_teeth / self.flexspline_teeth

    @property
    def beat_phases(self) -> int:
        """How many different FS phases meet one wave-generator angle in a full relative turn of FS and CS."""
        return self.flexspline_teeth // math.gcd(self.flexspline_teeth, self.circular_spline_teeth)


class Structure(Enum):
    """How the wave generator hangs on the input shaft, and which eccentricity that takes away (Jia 2021, Sec. 4).

    `passes_major` says whether eccentricity along the major axis (E_a) reaches the teeth, `passes_minor` the same
    for the minor axis (E_l); `slots` are the cross-slide slots that have clearance.
    """

    INTEGRAL = "integral"
    AUTOMATIC = "automatic"
    ONE_WAY_MAJOR = "one_way_major"
    ONE_WAY_MINOR = "one_way_minor"

    @property
    def passes_major(self) -> bool:
        return self in (Structure.INTEGRAL, Structure.ONE_WAY_MINOR)

    @property
    def passes_minor(self) -> bool:
        return self in (Structure.INTEGRAL, Structure.ONE_WAY_MAJOR)

    @property
    def slots(self) -> tuple[int, ...]:
        return {"automatic": (1, 2), "one_way_major": (1,), "one_way_minor": (2,)}.get(self.value, ())


@names_keywords
@dataclass(frozen=True)
class WaveGenerator:
    """A wave generator: its profile (the FS inner wall it makes), its structure and its axial width, mm.

    `bearing_thickness` is the radial thickness of the flexible bearing, mm: the cam is the profile less it.
    """

    profile: WaveGeneratorProfile
    structure: Structure
    width: float
    bearing_thickness: float | None = None

    def __post_init__(self) -> None:
        require_positive(width=self.width)
        require_positive_if_given(bearing_thickness=self.bearing_thickness)


@names_keywords
@dataclass(frozen=True)
class Clearances:
    """Clearances that make lag at reversal (Jia 2021, Eqs. (33)-(35)); mm.

    `backlash` e_t at the pitch line; `cross_slide` e_b between block and slot; `slot_1_width` b1, `slot_2_width` b2;
    `disc_radius` R_w of the floating disc.
    """

    backlash: float | None = None
    cross_slide: float | None = None
    slot_1_width: float | None = None
    slot_2_width: float | None = None
    disc_radius: float | None = None

    def __post_init__(self) -> None:
        require_not_negative("a clearance", backlash=self.backlash, cross_slide=self.cross_slide)
        slots = {"slot_1_width": self.slot_1_width, "slot_2_width": self.slot_2_width}
        require_positive_if_given(**slots, disc_radius=self.disc_radius)
        for name, width in slots.items():
            if width is not None and self.disc_radius is not None:
                require(
                    width < 2 * self.disc_radius,
                    f"{name} is {width:g} mm; a slot must be narrower than the disc ({2 * self.disc_radius:g} mm)",
                )


@names_keywords
@dataclass(frozen=True)
class Material:
    """The flexspline's material: Young's modulus and endurance limit in MPa (N/mm^2), Poisson's ratio."""

    modulus: float
    poisson: float
    endurance: float | None = None

    def __post_init__(self) -> None:
        require_positive(modulus=self.modulus)
        require(0 <= self.poisson < 0.5, f"poisson is {self.poisson!r}; it must lie in 0 to 0.5")
        require_positive_if_given(endurance=self.endurance)


@names_keywords
@dataclass(frozen=True)
class Load:
    """What the drive works under: output torque in N mm, input speed in rad/s, tooth face width in mm."""

    torque: float | None = None
    input_speed: float | None = None
    tooth_face_width: float | None = None

    def __post_init__(self) -> None:
        require_not_negative("it", torque=self.torque, input_speed=self.input_speed)
        require_positive_if_given(tooth_face_width=self.tooth_face_width)


@names_keywords
@dataclass(frozen=True)
class Drive:
    """One design: gear geometry and wave generator, with what is known of clearances, material and load."""

    geometry: DriveGeometry
    wave_generator: WaveGenerator
    clearances: Clearances = field(default_factory=Clearances)
    material: Material | None = None
    load: Load = field(default_factory=Load)
    cs_teeth: MeasuredTeeth | None = None
    fs_teeth: MeasuredTeeth | None = None
    cs_roundness: MeasuredRoundness | None = None

    @property
    def has_measured_teeth(self) -> bool:
        """Whether the teeth of either spline are known one by one, in pitch or in radius."""
        return self.cs_teeth is not None or self.fs_teeth is not None or self.cs_roundness is not None
