"""The sections that describe a drive, and how they become the frozen records of `hdopt.drive`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

from pydantic import Field

from hdopt.deviations import PHASE_OF, STUDY_KEYS, DriveErrors, study_key
from hdopt.drive import Clearances, DriveGeometry, Load, Material, Structure, WaveGenerator
from hdopt.errors import MissingValue
from hdopt.profiles import Ellipse, MeasuredProfile, Resal, TwoDisk, WaveGeneratorProfile
from hdopt.study.base import NotNegative, Positive, Section


class StudySection(Section):
    """[study]: what the study is called and what `hdopt run` does with it."""

    title: str | None = None
    description: str | None = None
    steps: list[str] | None = None


class DriveSection(Section):
    """[drive]"""

    flexspline_teeth: int = Field(gt=0)
    circular_spline_teeth: int = Field(gt=0)
    module_mm: Positive
    pressure_angle_deg: float = Field(gt=0, lt=45)
    flexspline_inner_radius_mm: Positive
    flexspline_addendum_mm: Positive | None = None
    circular_spline_addendum_mm: Positive | None = None
    flexspline_wall_mm: Positive | None = None

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
        )


class WaveGeneratorSection(Section):
    """[wave_generator]"""

    profile: Literal["ellipse", "resal", "two_disk", "measured"] = "ellipse"
    structure: Literal["integral", "automatic", "one_way_major", "one_way_minor"] = "integral"
    width_mm: Positive
    semi_major_mm: Positive | None = None
    """If omitted, the flexspline's inner radius plus the module, which is the usual greatest deflection."""
    semi_minor_mm: Positive | None = None
    """Of the ellipse only; if omitted, that of equal perimeter."""
    wrap_angle_deg: float | None = Field(default=None, ge=0, lt=90)
    """Of the two-disk profile only."""
    file: str | None = None
    """Of the measured profile only: CSV of angle_deg,radius_mm, relative to the study file."""
    noise_um: NotNegative = 0.0
    """Of the measured profile only: standard deviation of a measured radius; the curve is smoothed within it."""
    bearing_thickness_mm: Positive | None = None

    def build(self, drive: DriveGeometry, folder: Path) -> WaveGenerator:
        return WaveGenerator(
            self.build_profile(drive, folder), Structure(self.structure), self.width_mm, self.bearing_thickness_mm
        )

    def build_profile(self, drive: DriveGeometry, folder: Path) -> WaveGeneratorProfile:
        undeformed = drive.flexspline_inner_radius
        semi_major = undeformed + drive.module if self.semi_major_mm is None else self.semi_major_mm
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
        return MeasuredProfile.from_csv(folder / self.file, self.noise_um / 1000)


class ErrorsSection(Section):
    """[errors]: one drive's errors. An error that is not listed is zero; a listed size needs its direction or phase."""

    axis_eccentricity_mm: NotNegative = 0.0
    axis_eccentricity_direction_deg: float | None = None
    axis_tilt_y_deg: float = Field(default=0.0, gt=-45, lt=45)
    axis_tilt_x_deg: float = Field(default=0.0, gt=-45, lt=45)
    wg_eccentricity_mm: NotNegative = 0.0
    wg_eccentricity_direction_deg: float | None = None
    wg_tilt_major_deg: float = Field(default=0.0, gt=-45, lt=45)
    wg_tilt_minor_deg: float = Field(default=0.0, gt=-45, lt=45)
    cs_tooth_amplitude_mm: NotNegative = 0.0
    cs_tooth_phase_deg: float | None = None
    fs_tooth_amplitude_mm: NotNegative = 0.0
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
    """[clearances]"""

    backlash_mm: NotNegative | None = None
    cross_slide_clearance_mm: NotNegative | None = None
    slot_1_width_mm: Positive | None = None
    slot_2_width_mm: Positive | None = None
    disc_radius_mm: Positive | None = None

    def build(self) -> Clearances:
        return Clearances(
            self.backlash_mm,
            self.cross_slide_clearance_mm,
            self.slot_1_width_mm,
            self.slot_2_width_mm,
            self.disc_radius_mm,
        )


class MaterialSection(Section):
    """[material]: of the flexspline"""

    modulus_mpa: Positive
    poisson: float = Field(ge=0, lt=0.5)
    endurance_mpa: Positive | None = None

    def build(self) -> Material:
        return Material(self.modulus_mpa, self.poisson, self.endurance_mpa)


class LoadSection(Section):
    """[load]"""

    torque_nm: NotNegative | None = None
    input_speed_rpm: NotNegative | None = None
    tooth_face_width_mm: Positive | None = None

    def build(self) -> Load:
        return Load(
            None if self.torque_nm is None else 1000 * self.torque_nm,
            None if self.input_speed_rpm is None else self.input_speed_rpm * 2 * math.pi / 60,
            self.tooth_face_width_mm,
        )
