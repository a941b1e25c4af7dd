"""One drive, looked at from all sides: the results behind `hdopt ke` and `hdopt profile`."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdopt.bending import max_bending_stress, max_curvature_change
from hdopt.contact import contact_angle, homogenization_coefficient, mean_flank_pressure, meshing_teeth
from hdopt.errors import HdoptError, MissingValue
from hdopt.kinematics.extremes import extremes_arcmin, walked_peak_to_peak_arcmin
from hdopt.kinematics.lag import lag
from hdopt.kinematics.waveform import relative_turn
from hdopt.profiles import perimeter_error, tip_radius_of_curvature
from hdopt.spectrum import ModelOrder, model_orders, order_spectrum
from hdopt.study import Study

Array = NDArray[np.float64]

SAMPLES_PER_TURN = 720


@dataclass(frozen=True)
class KinematicErrorResult:
    """Kinematic error of one drive. A value that needs a number nobody gave is None, and `notes` says which number.

    `peak_to_peak_arcmin` is converged, of a single tooth pair (k_e = 1); `nonuniform_arcmin` is it times k_e;
    `sampled_peak_to_peak_arcmin` is taken only on the grid asked for. Where the study has effects, all of these are of
    the extended model; `base_peak_to_peak_arcmin` is without effects. `effects` says of each whether it counts, where
    it comes from ('drive' or 'bench') and what it adds to the peak-to-peak of the others.
    """

    study: str
    profile: str
    structure: str
    peak_to_peak_arcmin: float
    minimum_arcmin: float
    maximum_arcmin: float
    sampled_peak_to_peak_arcmin: float | None
    nonuniform_arcmin: float | None
    contact_angle_deg: float | None
    meshing_teeth: float | None
    homogenization_coefficient: float | None
    orders: tuple[dict[str, Any], ...]
    lag_arcmin: dict[str, Any] | None
    notes: tuple[str, ...]
    base_peak_to_peak_arcmin: float
    effects: tuple[dict[str, Any], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    def to_frame(self):
        """The order table."""
        import pandas as pd

        return pd.DataFrame(self.orders)


@dataclass(frozen=True)
class ProfileResult:
    """What a wave generator's profile asks of the flexspline. None where a number is missing; `notes` says which."""

    study: str
    profile: str
    semi_major_mm: float
    semi_minor_mm: float
    tip_radius_of_curvature_mm: float
    perimeter_error_mm: float
    contact_angle_deg: float | None
    meshing_teeth: float | None
    homogenization_coefficient: float | None
    max_curvature_change_per_mm: float | None
    max_bending_stress_mpa: float | None
    max_bending_stress_plate_mpa: float | None
    mean_flank_pressure_mpa: float | None
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


class _Notes:
    """Runs computations that may lack a number: the value, or None and a note of what is missing."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def value(self, function, *arguments):
        try:
            return function(*arguments)
        except MissingValue as error:
            if str(error) not in self.notes:
                self.notes.append(str(error))
            return None


@dataclass(frozen=True)
class Look:
    """One drive's kinematic error: extremes (arcmin), the driving deviation's part evened out, and the waveform over
    `theta` (rad) of one relative turn with the part that the zones drive; the orders worth a look; what effects add."""

    low: float
    high: float
    nonuniform: float | None
    theta: Array
    waveform: Array
    driven: Array
    orders: tuple[ModelOrder, ...]
    effects: tuple[dict[str, Any], ...] = ()
    notes: tuple[str, ...] = ()


def kinematic_error(
    study: Study, sampling_deg: float | None = None, turns: float | None = None
) -> KinematicErrorResult:
    """Kinematic error of the study's one drive ([errors], and [effects] where it has some): converged peak-to-peak,
    orders, contact, lag.

    The exact geometry is used throughout (Jia 2021, Eqs. (16)-(32)). `sampling_deg` asks for the peak-to-peak on a grid
    from 0 over `turns` input turns, end included; `turns` defaults to one full relative turn.
    """
    drive, errors = study.drive, study.errors
    gear = drive.geometry
    notes = _Notes()
    angle = notes.value(contact_angle, gear, drive.wave_generator.profile)
    teeth = None if angle is None else meshing_teeth(gear, angle)
    k_e = None if teeth is None else homogenization_coefficient(teeth)
    if study.effects:
        from hdopt.extended_look import extended_look
        from hdopt.included import extended_model

        model = extended_model(study)
        base_low, base_high = extremes_arcmin(drive, errors, "exact")
        look = extended_look(study, model, base_high - base_low, k_e)
    else:
        base_low, base_high = extremes_arcmin(drive, errors, "exact")
        theta, waveform = relative_turn(drive, errors, SAMPLES_PER_TURN, "exact")
        nonuniform = None if k_e is None else k_e * (base_high - base_low)
        look = Look(base_low, base_high, nonuniform, theta, waveform, waveform, model_orders(gear.ratio))
    spectrum = order_spectrum(look.theta, look.waveform, [order.order for order in look.orders])
    lost = notes.value(lag, drive, errors, look.theta, look.driven)
    return KinematicErrorResult(
        study=study.name,
        profile=drive.wave_generator.profile.name,
        structure=drive.wave_generator.structure.value,
        peak_to_peak_arcmin=look.high - look.low,
        minimum_arcmin=look.low,
        maximum_arcmin=look.high,
        sampled_peak_to_peak_arcmin=_sampled(study, sampling_deg, turns),
        nonuniform_arcmin=look.nonuniform,
        contact_angle_deg=None if angle is None else math.degrees(angle),
        meshing_teeth=teeth,
        homogenization_coefficient=k_e,
        orders=tuple(
            {
                "order": named_order.order,
                "symbol": named_order.symbol,
                "amplitude_arcmin": float(size),
                "phase_deg": math.degrees(phase),
                "origin": named_order.origin,
            }
            for named_order, size, phase in zip(look.orders, spectrum.amplitudes, spectrum.phases, strict=True)
        ),
        lag_arcmin=None if lost is None else lost.to_dict(),
        notes=(*notes.notes, *look.notes),
        base_peak_to_peak_arcmin=base_high - base_low,
        effects=look.effects,
    )


def _sampled(study: Study, sampling_deg: float | None, turns: float | None) -> float | None:
    if sampling_deg is None:
        if turns is not None:
            raise HdoptError("--turns goes with --sampling-deg; give the grid's spacing too")
        return None
    turns = study.drive.geometry.beat_phases if turns is None else turns
    if not (math.isfinite(sampling_deg) and 0 < sampling_deg <= 360):
        raise HdoptError(f"--sampling-deg is {sampling_deg!r}; it must lie above 0 and up to 360")
    if not (math.isfinite(turns) and 0 < turns <= 10_000):
        raise HdoptError(f"--turns is {turns!r}; it must lie above 0 and up to 10000")
    if turns * 360 / sampling_deg > 1e7:
        raise HdoptError(
            f"{turns:g} turns every {sampling_deg:g} deg are more than 1e7 angles; take a coarser grid or fewer turns"
        )
    if study.effects:
        from hdopt.extended_look import walked_extended_arcmin
        from hdopt.included import extended_model

        return walked_extended_arcmin(extended_model(study), math.radians(sampling_deg), turns)
    return walked_peak_to_peak_arcmin(study.drive, study.errors, math.radians(sampling_deg), turns)


def profile(study: Study) -> ProfileResult:
    """What the study's wave-generator profile asks of the flexspline: contact, curvature, stress, stretch."""
    drive = study.drive
    gear, curve = drive.geometry, drive.wave_generator.profile
    notes = _Notes()
    angle = notes.value(contact_angle, gear, curve)
    teeth = None if angle is None else meshing_teeth(gear, angle)
    return ProfileResult(
        study=study.name,
        profile=curve.name,
        semi_major_mm=curve.semi_major,
        semi_minor_mm=curve.semi_minor,
        tip_radius_of_curvature_mm=tip_radius_of_curvature(curve),
        perimeter_error_mm=perimeter_error(curve, gear.flexspline_inner_radius),
        contact_angle_deg=None if angle is None else math.degrees(angle),
        meshing_teeth=teeth,
        homogenization_coefficient=None if teeth is None else homogenization_coefficient(teeth),
        max_curvature_change_per_mm=notes.value(max_curvature_change, gear, curve),
        max_bending_stress_mpa=notes.value(max_bending_stress, drive),
        max_bending_stress_plate_mpa=notes.value(max_bending_stress, drive, True),
        mean_flank_pressure_mpa=notes.value(mean_flank_pressure, drive),
        notes=tuple(notes.notes),
    )
