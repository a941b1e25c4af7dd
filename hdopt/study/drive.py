"""The sections that describe a drive, and how they become the frozen records of `hdopt.drive.geometry`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from hdopt.arrays import Array
from hdopt.drive.errors import PHASE_OF, STUDY_KEYS, DriveErrors, study_key
from hdopt.drive.geometry import Clearances, DriveGeometry, Load, Material, Structure, WaveGenerator
from hdopt.drive.profiles import Ellipse, MeasuredProfile, Resal, TwoDisk, WaveGeneratorProfile, parallel_profile
from hdopt.drive.roundness import MeasuredRoundness, read_roundness
from hdopt.drive.teeth import MeasuredTeeth, read_teeth
from hdopt.errors import HdoptError, MissingValue
from hdopt.study.base import Section

MOST_TEETH = 2000
"""Strain wave gears have 60 to 640 teeth; what is computed grows with the number."""
LARGEST_MM = 2000.0
"""Flexsplines have a radius of 8 to 300 mm."""
LARGEST_ERROR_MM = 5.0
"""Errors are small beside the drive: the model is of first order in them, and real ones are below 0.1 mm."""
STEEPEST_DEG = 5.0
"""The same for tilts; real ones are below 0.5 deg."""

Size = Annotated[float, Field(gt=0, le=LARGEST_MM)]
NotNegativeSize = Annotated[float, Field(ge=0, le=LARGEST_MM)]


class StudySection(Section):
    """[study]: what the study is called and what `hdopt run` does with it."""

    title: str | None = None
    """A line for reports and `hdopt studies`."""
    description: str | None = None
    """What the study is for, in sentences."""
    steps: list[str] | None = None
    """What `hdopt run` does, in this order; all that the study has data for if omitted."""


class DriveSection(Section):
    """[drive]: teeth and sizes of the drive; or `drive = "csf-25-80"` at the top of the file for a shipped one."""

    flexspline_teeth: int = Field(gt=0, le=MOST_TEETH)
    """Teeth of the flexspline, Z_FS; the ratio is Z_FS/(Z_CS - Z_FS)."""
    circular_spline_teeth: int = Field(gt=0, le=MOST_TEETH + 2)
    """Teeth of the circular spline, Z_CS: two more than the flexspline has."""
    module_mm: float = Field(ge=0.01, le=50)
    """Module m."""
    pressure_angle_deg: float = Field(gt=0, lt=45)
    """Pressure angle of the teeth, alpha."""
    flexspline_inner_radius_mm: Size
    """Radius of the undeformed inner wall, R_b."""
    flexspline_addendum_mm: Size | None = None
    """Addendum of the flexspline's teeth; for contact angle, k_e and flank pressure."""
    circular_spline_addendum_mm: Size | None = None
    """Addendum of the circular spline's teeth; for the same."""
    flexspline_wall_mm: Size | None = None
    """Thickness of the flexspline's wall under the teeth; for curvature and bending."""
    contact: Literal["tips", "flanks"] | None = None
    """What counts as contact, for k_e and flank pressure alike: tips that overlap, as published, or flanks that carry
    under the backlash; if omitted, tips, and in a search flanks."""

    def build(self) -> DriveGeometry:
        return DriveGeometry(
            flexspline_teeth=self.flexspline_teeth,
            circular_spline_teeth=self.circular_spline_teeth,
            module=self.module_mm,
            pressure_angle=math.radians(self.pressure_angle_deg),
            flexspline_inner_radius=self.flexspline_inner_radius_mm,
            flexspline_addendum=self.flexspline_addendum_mm,
            circular_spline_addendum=self.circular_spline_addendum_mm,
            flexspline_wall=self.flexspline_wall_mm,
            contact=self.contact,
        )


MOST_DEFLECTION = 3.0
"""Modules; makers' drives have 0.8 to 1.2, and beyond 3 the sizes are those of two drives."""


class WaveGeneratorSection(Section):
    """[wave_generator]: profile, structure and size of the wave generator."""

    profile: Literal["ellipse", "resal", "two_disk", "measured"] = "ellipse"
    """Shape of the flexspline's inner wall on the wave generator."""
    structure: Literal["integral", "automatic", "one_way_major", "one_way_minor"] = "integral"
    """How the wave generator sits on the shaft: fixed, or free to align itself."""
    width_mm: float = Field(ge=0.1, le=LARGEST_MM)
    """Axial width b."""
    semi_major_mm: Size | None = None
    """If omitted, the flexspline's inner radius plus the module, which is the usual greatest deflection."""
    semi_minor_mm: Size | None = None
    """Of the ellipse only; if omitted, that of equal perimeter."""
    wrap_angle_deg: float | None = Field(default=None, ge=0, lt=90)
    """Of the two-disk profile only."""
    file: str | None = None
    """Of the measured profile only: CSV of angle_deg,radius_mm, relative to the study file."""
    surface: Literal["cam", "bearing"] | None = None
    """Of the measured profile only: whether the file gives the cam itself or the outside of the bearing on it."""
    noise_um: float = Field(default=0.0, ge=0, le=1000)
    """Of the measured profile only: standard deviation of a measured radius; the curve is smoothed within it."""
    bearing_thickness_mm: Size | None = None
    """Radial thickness of the flexible bearing: the cam lies that far inside the profile."""

    def build(self, drive: DriveGeometry, folder: Path) -> WaveGenerator:
        return WaveGenerator(
            self.build_profile(drive, folder), Structure(self.structure), self.width_mm, self.bearing_thickness_mm
        )

    def build_profile(self, drive: DriveGeometry, folder: Path) -> WaveGeneratorProfile:
        undeformed = drive.flexspline_inner_radius
        semi_major = undeformed + drive.module if self.semi_major_mm is None else self.semi_major_mm
        if self.profile != "measured":
            remedy = "give the sizes of one drive, or leave semi_major_mm and semi_minor_mm out"
            _check_deflection(semi_major - undeformed, drive, f"semi_major_mm is {self.semi_major_mm}", remedy)
        if self.profile == "ellipse":
            if self.semi_minor_mm is None:
                return Ellipse.of_equal_perimeter(undeformed, semi_major)
            return Ellipse(semi_major, self.semi_minor_mm)
        if self.profile == "resal":
            return Resal(undeformed, semi_major - undeformed)
        if self.profile == "two_disk":
            if self.wrap_angle_deg is None:
                raise MissingValue("the two-disk profile", "wave_generator.wrap_angle_deg")
            return TwoDisk(undeformed, semi_major - undeformed, math.radians(self.wrap_angle_deg))
        if self.file is None:
            raise MissingValue("the measured profile", "wave_generator.file")
        measured = self._measured(folder / self.file)
        table = (
            f"the table {self.file} puts the flexspline's inner wall at {measured.semi_major:.5g} mm on the major axis"
        )
        remedy = (
            "measure radii in mm from the axis, and say by surface whether they are those of the cam or the bearing"
        )
        _check_deflection(measured.semi_major - undeformed, drive, table, remedy)
        return measured

    def _measured(self, file: Path) -> WaveGeneratorProfile:
        """The flexspline's inner wall: the measured table itself, or the bearing's thickness outside it."""
        if self.surface is None:
            raise HdoptError(
                'wave_generator.surface is not given; say what the measured file shows: surface = "cam" for the cam '
                'itself, "bearing" for the outside of the flexible bearing on it (the flexspline\'s inner wall)'
            )
        measured = MeasuredProfile.from_csv(file, self.noise_um / 1000)
        if self.surface == "bearing":
            return measured
        if self.bearing_thickness_mm is None:
            raise MissingValue("a measured cam", "wave_generator.bearing_thickness_mm")
        return parallel_profile(measured, self.bearing_thickness_mm)


def _check_deflection(deflection: float, drive: DriveGeometry, said: str, remedy: str) -> None:
    """Refuse a wave generator of another `drive`, that would deflect the flexspline by `deflection`, mm, which is far
    from a module; `said` begins the message and `remedy` ends it."""
    if not 0 < deflection <= MOST_DEFLECTION * drive.module:
        raise HdoptError(
            f"{said}, {abs(deflection):.4g} mm {'beyond' if deflection > 0 else 'below'} "
            f"drive.flexspline_inner_radius_mm = {drive.flexspline_inner_radius:g}; a wave generator deflects the "
            f"flexspline by about one module, {drive.module:g} mm here: {remedy}"
        )


class TeethSection(Section):
    """[cs_teeth] and [fs_teeth]: teeth that were measured one by one."""

    file: str
    """CSV of tooth, flank, fp_um, or XML (.xml), relative to the study file."""
    deviation: Literal["cumulative", "single"]
    """What the file gives: the deviation from tooth 1's pitch, or from the tooth before."""
    flank: str | None = None
    """Which flank carries, where the file has both."""
    xml_path: str | None = None
    """Of XML only: where the deviations stand, as XPath without namespaces; left out, fitting paths are listed."""
    xml_unit: Literal["um", "mm"] | None = None
    """Of XML only: the unit of its deviations."""
    first_tooth_deg: float = 0.0
    """Where tooth 1 lies, clockwise from the major axis at input angle 0."""
    numbered: Literal["clockwise", "counterclockwise"] = "clockwise"
    """Which way the file numbers the teeth, seen as input angles are."""
    sign: Literal[1, -1] = 1
    """-1 where a positive deviation of the file holds the output back."""
    recentre: bool = True
    """Take the first harmonic out, which a part held off-centre shows; false keeps it, where centring is trusted."""
    sine: Literal["instead", "beside"] = "instead"
    """Whether the table stands instead of the spline's tooth amplitude in [errors] and [tolerances], or beside it."""

    def build(self, teeth: int, module: float, folder: Path) -> MeasuredTeeth:
        """The record for a spline of so many `teeth` of a `module`, mm; the file lies in `folder`."""
        path = folder / self.file
        first = math.radians(self.first_tooth_deg)
        measured = MeasuredTeeth.of(self._values(teeth, path), self.deviation, first, self.recentre, source=self.file)
        measured = measured.laid(first, self.numbered == "counterclockwise", self.sign < 0)
        pitch = math.pi * module
        if measured.largest_single > pitch / 2:
            raise HdoptError(
                f"{path}: a tooth is {1000 * measured.largest_single:.0f} um off its neighbour's pitch of "
                f"{1000 * pitch:.0f} um; deviations must be in um"
            )
        return measured

    def _values(self, teeth: int, path: Path) -> Array:
        if path.suffix.lower() == ".xml":
            if self.flank is not None:
                raise HdoptError(f"{path} is XML: its flank is said by xml_path, [@attribute='value']; leave flank out")
            from hdopt.drive.teeth_xml import read_teeth_xml

            return read_teeth_xml(path, teeth, self.xml_path, self.xml_unit)
        if self.xml_path is not None or self.xml_unit is not None:
            raise HdoptError(f"{path} is no XML file (.xml): leave xml_path and xml_unit out")
        return read_teeth(path, teeth, self.flank)


class RoundnessSection(Section):
    """[cs_roundness]: a circular spline whose roundness was measured. It acts beside its teeth's pitch."""

    file: str
    """CSV of angle_deg, radius_mm, relative to the study file; any radius of the ring that the teeth follow."""
    upr: int = Field(default=50, ge=2, le=500)
    """Cut-off of the Gaussian filter (ISO 12181-2), undulations per revolution: half of such a wave is kept."""
    zero_deg: float = 0.0
    """Where the file's angle 0 lies, clockwise from the major axis at input angle 0."""
    angles: Literal["clockwise", "counterclockwise"] = "clockwise"
    """How the file's angles count, seen as the study's directions are."""
    recentre: bool = True
    """Take the first wave out, as roundness does; false keeps the ring's eccentricity against the file's centre."""

    def build(self, module: float, folder: Path) -> MeasuredRoundness:
        """The record for a spline of a `module`, mm; the file lies in `folder`."""
        path = folder / self.file
        points = read_roundness(path)
        ring = MeasuredRoundness.of(
            *points,
            self.upr,
            zero=math.radians(self.zero_deg),
            counterclockwise=self.angles == "counterclockwise",
            recentre=self.recentre,
            source=self.file,
        )
        if ring.peak_to_valley > module:
            raise HdoptError(
                f"{path}: the ring is {ring.peak_to_valley:.4g} mm out of round, more than the module of {module:g} "
                "mm; radii must be in mm"
            )
        return ring


class ErrorsSection(Section):
    """[errors]: one drive's errors. One that is not listed is zero, or that of the shipped drive that the study starts
    from; a listed size needs its direction or phase."""

    axis_eccentricity_mm: float = Field(default=0.0, ge=0, le=LARGEST_ERROR_MM)
    axis_eccentricity_direction_deg: float | None = None
    axis_tilt_y_deg: float = Field(default=0.0, ge=-STEEPEST_DEG, le=STEEPEST_DEG)
    axis_tilt_x_deg: float = Field(default=0.0, ge=-STEEPEST_DEG, le=STEEPEST_DEG)
    wg_eccentricity_mm: float = Field(default=0.0, ge=0, le=LARGEST_ERROR_MM)
    wg_eccentricity_direction_deg: float | None = None
    wg_tilt_major_deg: float = Field(default=0.0, ge=-STEEPEST_DEG, le=STEEPEST_DEG)
    wg_tilt_minor_deg: float = Field(default=0.0, ge=-STEEPEST_DEG, le=STEEPEST_DEG)
    cs_tooth_amplitude_mm: float = Field(default=0.0, ge=0, le=LARGEST_ERROR_MM)
    cs_tooth_phase_deg: float | None = None
    fs_tooth_amplitude_mm: float = Field(default=0.0, ge=0, le=LARGEST_ERROR_MM)
    fs_tooth_phase_deg: float | None = None

    def build(self) -> DriveErrors:
        for size, direction in PHASE_OF.items():
            if getattr(self, study_key(size)) > 0 and getattr(self, study_key(direction)) is None:
                raise MissingValue(f"errors.{study_key(size)}", f"errors.{study_key(direction)}")
        values = {}
        for key, name in STUDY_KEYS.items():
            value = getattr(self, key) or 0.0
            values[name] = math.radians(value) if key.endswith("_deg") else value
        return DriveErrors(**values)


class ClearancesSection(Section):
    """[clearances]: what lag and the cross-slide need."""

    backlash_mm: NotNegativeSize | None = None
    """Backlash e_t at the pitch line; for the lag at reversal."""
    cross_slide_clearance_mm: NotNegativeSize | None = None
    """Play e_b between block and slot of a cross-slide; for its lag."""
    slot_1_width_mm: Size | None = None
    """Width of the slot along the major axis."""
    slot_2_width_mm: Size | None = None
    """Width of the slot along the minor axis."""
    disc_radius_mm: Size | None = None
    """Radius of the floating disc, R_w."""

    def build(self) -> Clearances:
        return Clearances(
            self.backlash_mm,
            self.cross_slide_clearance_mm,
            self.slot_1_width_mm,
            self.slot_2_width_mm,
            self.disc_radius_mm,
        )


class MaterialSection(Section):
    """[material]: of the flexspline."""

    modulus_mpa: float = Field(gt=0, le=2e6)
    """Young's modulus of the flexspline."""
    poisson: float = Field(ge=0, lt=0.5)
    """Poisson's ratio."""
    endurance_mpa: float | None = Field(default=None, gt=0, le=1e5)
    """Endurance limit under alternating bending; for the safety against fatigue."""

    def build(self) -> Material:
        return Material(self.modulus_mpa, self.poisson, self.endurance_mpa)


class LoadSection(Section):
    """[load]: what the drive carries, for flank pressure and design searches."""

    torque_nm: float | None = Field(default=None, ge=0, le=1e6)
    """Torque at the output."""
    input_speed_rpm: float | None = Field(default=None, ge=0, le=1e6)
    """Speed of the input."""
    tooth_face_width_mm: Size | None = None
    """Face width of the teeth."""

    def build(self) -> Load:
        return Load(
            None if self.torque_nm is None else 1000 * self.torque_nm,
            None if self.input_speed_rpm is None else self.input_speed_rpm * 2 * math.pi / 60,
            self.tooth_face_width_mm,
        )
