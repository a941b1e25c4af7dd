"""One drive, looked at from all sides: the results behind `hdopt ke` and `hdopt profile`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar  # Any: values of JSON

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.drive.profiles import perimeter_error, tip_radius_of_curvature
from hdopt.errors import HdoptError
from hdopt.figures import drawn
from hdopt.files import ShownAsTable
from hdopt.kinematics.extremes import evened_out_arcmin, extremes_arcmin, walked_peak_to_peak_arcmin
from hdopt.kinematics.waveform import DEFAULT_METHOD, geometry_for
from hdopt.mechanics.bending import curvature_change, max_bending_stress, max_curvature_change
from hdopt.mechanics.contact_model import contact_of, mean_flank_pressure
from hdopt.mechanics.lag import lag
from hdopt.recordings.orders import OrderSpectrum, order_spectrum
from hdopt.report.cells import heading
from hdopt.simulation.extremes import peak_to_peak_arcmin as extended_peak_to_peak_arcmin
from hdopt.study import AnyStudy, Study, as_study, study_of_drive
from hdopt.workflow.effect_selection import inclusion
from hdopt.workflow.effect_table import effect_table, remarks, walked_extended_arcmin
from hdopt.workflow.measured_parts import words_on_measured_parts
from hdopt.workflow.placed import numbers_named
from hdopt.workflow.rough_profile import words_on_a_rough_profile
from hdopt.workflow.waveform import WaveformResult, converged_extremes_arcmin, held_arcmin, model_of, waveform_of

if TYPE_CHECKING:
    import pandas as pd
    import plotly.graph_objects as go
    from matplotlib.figure import Figure as MatplotlibFigure

T = TypeVar("T")

POINTS_OF_A_PROFILE = 721
"""Every half degree of a turn, both ends."""


@dataclass(frozen=True)
class KinematicErrorResult(ShownAsTable):
    """Kinematic error of one drive. A value that needs a number nobody gave is None, and `notes` says which number.

    `method` names the geometry: "exact" or "closed form". `peak_to_peak_arcmin` is converged, of a single tooth pair
    (k_e = 1): essential supremum less essential infimum; `tooth_width_peak_to_peak_arcmin` is what holds over the width
    of one FS tooth, which a recording can show; `nonuniform_arcmin` is it times k_e;
    `sampled_peak_to_peak_arcmin` is taken only on the grid asked for. Where the study has effects, all of these are of
    the extended model; `base_peak_to_peak_arcmin` is without effects. `effects` says of each whether it counts, where
    it comes from ('drive' or 'bench') and what it adds to the peak-to-peak of the others.
    """

    study: str
    method: str
    profile: str
    structure: str
    peak_to_peak_arcmin: float
    tooth_width_peak_to_peak_arcmin: float
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
    measured_teeth: Mapping[str, dict[str, Any]] = field(default_factory=dict)
    """By spline, what is known of teeth measured one by one; their deviation is the mean over the teeth in contact."""
    measured_roundness: Mapping[str, object] | None = None
    """What is known of a circular spline whose roundness was measured."""
    theta: Array = field(default_factory=lambda: np.empty(0), compare=False, repr=False)
    """Input angles of one relative turn, rad, shape (n,)."""
    waveform_arcmin: Array = field(default_factory=lambda: np.empty(0), compare=False, repr=False)
    """The error there, arcmin, shape (n,): of a single tooth pair, in the first direction of the motion."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready: every field but the waveform."""
        values = asdict(self)
        return {key: value for key, value in values.items() if key not in ("theta", "waveform_arcmin")}

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """The waveform over one relative turn. `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        turns = self.theta / (2 * math.pi)
        line = go.Scattergl(x=turns, y=self.waveform_arcmin, mode="lines", line={"width": 1}, name=self.study)
        layout = {"xaxis_title": "input turns", "yaxis_title": "kinematic error, arcmin"}
        layout = {"title": f"{self.study}: {self.peak_to_peak_arcmin:.4g} arcmin peak to peak", **layout}
        return drawn(go.Figure(line, layout), backend)

    def to_frame(self) -> pd.DataFrame:
        """The order table."""
        import pandas as pd

        return pd.DataFrame(self.orders, columns=["order", "symbol", "amplitude_arcmin", "phase_deg", "origin"])

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet: orders, figures, and what each effect adds where there are any."""
        import pandas as pd

        lag = {f"lag_{key}_arcmin": self.lag_arcmin[key] for key in ("mean", "min", "max")} if self.lag_arcmin else {}
        tables = {"orders": self.to_frame(), "figures": figures({**self.to_dict(), **lag})}
        return tables | ({"effects": pd.DataFrame(self.effects)} if self.effects else {})


@dataclass(frozen=True)
class ProfileResult(ShownAsTable):
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
    phi: Array = field(default_factory=lambda: np.empty(0), compare=False, repr=False)
    """Angles from the major axis over one turn, rad, shape (n,)."""
    deflection_mm: Array = field(default_factory=lambda: np.empty(0), compare=False, repr=False)
    """Of the flexspline's inner wall there, mm, shape (n,)."""
    curvature_change_per_mm: Array | None = field(default=None, compare=False, repr=False)
    """Of the ring's neutral line there, 1/mm, shape (n,)."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready: every field but the curves."""
        curves = ("phi", "deflection_mm", "curvature_change_per_mm")
        return {key: value for key, value in asdict(self).items() if key not in curves}

    def plot(self, backend: str = "plotly") -> go.Figure | MatplotlibFigure:
        """Deflection and change of curvature over the angle. `backend` is "plotly" or "matplotlib"."""
        import plotly.graph_objects as go

        angle = np.degrees(self.phi)
        layout: dict[str, Any] = {
            "title": f"{self.study}: {self.profile}",
            "xaxis_title": "angle from the major axis, deg",
            "yaxis_title": "deflection, mm",
            "showlegend": False,
        }
        lines = [go.Scatter(x=angle, y=self.deflection_mm, mode="lines")]
        if self.curvature_change_per_mm is not None:
            lines.append(go.Scatter(x=angle, y=self.curvature_change_per_mm, mode="lines", yaxis="y2"))
            lower = {"domain": [0, 0.46], "title": "change of curvature, 1/mm"}
            layout |= {"yaxis_domain": [0.54, 1], "yaxis2": lower, "xaxis_anchor": "y2"}
        return drawn(go.Figure(lines, layout), backend)

    def to_frame(self) -> pd.DataFrame:
        """One row a figure."""
        return figures(self.to_dict())

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet."""
        return {"profile": self.to_frame()}


def figures(values: Mapping[str, object]) -> pd.DataFrame:
    """The numbers and words among `values` as a table: figure, value, and unit as the name's ending says."""
    import pandas as pd

    rows = [
        (*heading(name), value)
        for name, value in values.items()
        if value is not None and isinstance(value, float | int)
    ]
    frame = pd.DataFrame(rows, columns=["figure", "unit", "value"])
    return frame[["figure", "value", "unit"]]


class _Notes:
    """Runs computations that may fail beside the one that was asked for: the value, or None and a note of why."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def value(self, function: Callable[..., T], *arguments: object) -> T | None:
        try:
            return function(*arguments)
        except HdoptError as error:
            if str(error) not in self.notes:
                self.notes.append(str(error))
            return None


@numbers_named
def kinematic_error(
    study: AnyStudy | Drive = None,
    errors: DriveErrors | None = None,
    *,
    sampling_deg: float | None = None,
    turns: float | None = None,
    method: str = DEFAULT_METHOD,
) -> KinematicErrorResult:
    """Kinematic error of the one drive of `study` ([errors], and [effects] where it has some): converged peak-to-peak,
    orders, contact, lag.

    `study` is a study, its name or its path; or the record of a drive, with its `errors`.

    Jia 2021, Eqs. (16)-(32), by `method`: "exact", or "closed form" to second order in the errors. `sampling_deg` asks
    for the peak-to-peak on a grid from 0 over `turns` input turns, end included; `turns` defaults to one full relative
    turn. Raises `HdoptError` for a method that is none, or that the profile does not allow.
    """
    study = _study_of(study, errors)
    drive, errors = study.drive, study.errors
    _check_method(drive, method)
    notes = _Notes()
    contact = notes.value(contact_of, drive)
    k_e = None if contact is None else contact.homogenization()
    base_low, base_high = extremes_arcmin(drive, errors, method)
    low, high, base = base_low, base_high, base_high - base_low
    if study.effects:
        low, high = converged_extremes_arcmin(study, method)
    shown = waveform_of(study, method)
    spectrum = order_spectrum(shown.theta, shown.waveform, [order.order for order in shown.orders])
    lost = notes.value(lag, drive, errors, shown.theta, shown.driven)
    effects, said = _effects(study, method, high - low, base)
    return KinematicErrorResult(
        study=study.name,
        method=method,
        profile=drive.wave_generator.profile.name,
        structure=drive.wave_generator.structure.value,
        peak_to_peak_arcmin=high - low,
        tooth_width_peak_to_peak_arcmin=held_arcmin(study, method),
        minimum_arcmin=low,
        maximum_arcmin=high,
        sampled_peak_to_peak_arcmin=_sampled(study, sampling_deg, turns, method),
        nonuniform_arcmin=None if k_e is None else _nonuniform(study, method, k_e),
        contact_angle_deg=None if contact is None else math.degrees(contact.angle),
        meshing_teeth=None if contact is None else contact.teeth,
        homogenization_coefficient=k_e,
        orders=_order_rows(shown, spectrum),
        lag_arcmin=None if lost is None else lost.to_dict(),
        notes=(*notes.notes, *said, *words_on_measured_parts(drive)),
        base_peak_to_peak_arcmin=base,
        effects=effects,
        measured_teeth=_measured(drive),
        theta=shown.theta,
        waveform_arcmin=shown.waveform,
        measured_roundness=_roundness(drive),
    )


def _check_method(drive: Drive, method: str) -> None:
    try:
        geometry_for(drive, method)
    except ValueError as error:
        raise HdoptError(str(error)) from None


def _nonuniform(study: Study, method: str, k_e: float) -> float:
    """Peak-to-peak (arcmin) with the driving deviation evened out by `k_e`."""
    if study.effects:
        return extended_peak_to_peak_arcmin(replace(model_of(study, method), homogenization=k_e))
    return evened_out_arcmin(study.drive, study.errors, k_e, method)


def _measured(drive: Drive) -> dict[str, dict[str, Any]]:
    """What is known of measured teeth, by spline."""
    parts = {"cs_teeth": drive.cs_teeth, "fs_teeth": drive.fs_teeth}
    return {
        name: {
            "file": teeth.source,
            "teeth": len(teeth.deviations),
            "largest_single_pitch_um": 1000 * teeth.largest_single,
            "total_cumulative_pitch_um": 1000 * teeth.total_cumulative,
            "first_harmonic_um": 1000 * teeth.eccentricity,
            "recentred": teeth.recentred,
        }
        for name, teeth in parts.items()
        if teeth is not None
    }


def _roundness(drive: Drive) -> dict[str, object] | None:
    """What is known of a measured circular spline."""
    ring = drive.cs_roundness
    if ring is None:
        return None
    return {
        "file": ring.source,
        "upr": ring.cutoff,
        "roundness_um": 1000 * ring.peak_to_valley,
        "eccentricity_um": 1000 * ring.eccentricity,
        "recentred": ring.recentred,
    }


def _effects(study: Study, method: str, whole: float, base: float) -> tuple[tuple[dict[str, Any], ...], list[str]]:
    """A row an effect, and what is to be said of them."""
    if not study.effects:
        return (), []
    model, chosen = model_of(study, method), inclusion(study, "all")
    return effect_table(study, model, chosen, whole, base), [*chosen.says, *remarks(model)]


def _order_rows(shown: WaveformResult, spectrum: OrderSpectrum) -> tuple[dict[str, Any], ...]:
    return tuple(
        {
            "order": named.order,
            "symbol": named.symbol,
            "amplitude_arcmin": float(size),
            "phase_deg": math.degrees(phase),
            "origin": named.origin,
        }
        for named, size, phase in zip(shown.orders, spectrum.amplitudes, spectrum.phases, strict=True)
    )


def _sampled(study: Study, sampling_deg: float | None, turns: float | None, method: str) -> float | None:
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
        return walked_extended_arcmin(model_of(study, method), math.radians(sampling_deg), turns)
    return walked_peak_to_peak_arcmin(study.drive, study.errors, math.radians(sampling_deg), turns, method)


def _study_of(study: AnyStudy | Drive, errors: DriveErrors | None) -> Study:
    if isinstance(study, Drive):
        return study_of_drive(study, DriveErrors() if errors is None else errors)
    if errors is not None:
        raise HdoptError("errors go with the record of a drive; a study has its own, change them with study.with_(...)")
    found = as_study(study)
    if found.sections:  # a study of records has none
        found.require(("drive", "wave_generator", "errors"), "the kinematic error of a drive")
    return found


@numbers_named
def profile(study: AnyStudy = None) -> ProfileResult:
    """What the wave-generator profile of a `study` (or its name or path) asks of the flexspline: contact, curvature,
    stress, stretch."""
    study = as_study(study)
    drive = study.drive
    gear, curve = drive.geometry, drive.wave_generator.profile
    notes = _Notes()
    contact = notes.value(contact_of, drive)
    phi = np.linspace(0, 2 * math.pi, POINTS_OF_A_PROFILE)
    return ProfileResult(
        study=study.name,
        profile=curve.name,
        semi_major_mm=curve.semi_major,
        semi_minor_mm=curve.semi_minor,
        tip_radius_of_curvature_mm=tip_radius_of_curvature(curve),
        perimeter_error_mm=perimeter_error(curve, gear.flexspline_inner_radius),
        contact_angle_deg=None if contact is None else math.degrees(contact.angle),
        meshing_teeth=None if contact is None else contact.teeth,
        homogenization_coefficient=None if contact is None else contact.homogenization(),
        max_curvature_change_per_mm=notes.value(max_curvature_change, gear, curve),
        max_bending_stress_mpa=notes.value(max_bending_stress, drive),
        max_bending_stress_plate_mpa=notes.value(max_bending_stress, drive, True),
        mean_flank_pressure_mpa=notes.value(mean_flank_pressure, drive),
        phi=phi,
        deflection_mm=curve.radius(phi) - gear.flexspline_inner_radius,
        curvature_change_per_mm=notes.value(curvature_change, gear, curve, phi),
        notes=(*words_on_a_rough_profile(drive), *notes.notes),
    )
