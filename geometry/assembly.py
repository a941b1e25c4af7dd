"""From a drive to the parts of its wave generator: which there are, how large, and where each lies.

The cam lies between z = -b/2 and +b/2, as in the model of kinematic error; the input shaft comes from below (-z). The
parts stand in their nominal place, all slides in the middle. Sizes that nobody gave follow a rule, and every rule that
was used is listed in `WaveGeneratorModel.assumptions`.
"""

from __future__ import annotations

import math

from hdopt.drive.geometry import Drive, Structure
from hdopt.drive.profiles import TwoDisk
from hdopt.errors import HdoptError
from hdopt.geometry.budget import Bounds, plan
from hdopt.geometry.cam import Cam
from hdopt.geometry.choices import Choices
from hdopt.geometry.context import context_parts
from hdopt.geometry.cross_slide import CrossSlide
from hdopt.geometry.model import CAM_STEP_DEG, WHEEL_RADIUS, WaveGeneratorModel
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.part import Part
from hdopt.geometry.two_discs import TwoDiscs
from hdopt.geometry.walls import require_walls


def wave_generator_model(
    drive: Drive, options: ExportOptions | None = None, bounds: Bounds | None = None
) -> WaveGeneratorModel:
    """All parts of the wave generator of a `drive`.

    `options` are the sizes that were given (mm and deg, as their names say; None: every size by its rule). `bounds`
    limit its eccentricity (mm) and tilt (rad), and the fits follow from them; None for no bounds. Raises `HdoptError`
    where the numbers leave no part to make, `MissingValue` where the drive lacks a size that no rule can find.
    """
    bounds = bounds or Bounds()
    choices = Choices(options or ExportOptions(), bounds)
    profile = drive.wave_generator.profile
    carrier = TwoDiscs(drive, choices, profile) if isinstance(profile, TwoDisk) else Cam(drive, choices)
    structure = drive.wave_generator.structure
    parts = carrier.integral_parts() if structure is Structure.INTEGRAL else _sliding(carrier, structure)
    require_walls(parts, carrier.wall)
    given = {key: getattr(choices.options, key) for key in ("shaft_fit", "seat_fit")}
    gap = choices.take("axial_gap_mm", lambda: 0.0) if structure.slots else 0.0
    fits = plan(structure, parts, bounds, drive.clearances, given, gap)
    located = fits.zone(carrier.profiled_part, "wg_eccentricity")
    zone = choices.take("profile_tolerance_mm", lambda: min(0.010, located or math.inf))
    if choices.options.context:
        share = choices.take("race_share", lambda: 0.25)
        parts += context_parts(drive, carrier.bearing_thickness, share, carrier.clear_of_profile)
    step, wheel = choices.options.cam_resolution_deg or CAM_STEP_DEG, choices.options.wheel_radius_mm or WHEEL_RADIUS
    return WaveGeneratorModel(structure, parts, tuple(choices.assumptions), zone, fits, carrier.notes, step, wheel)


def _sliding(carrier: Cam | TwoDiscs, structure: Structure) -> tuple[Part, ...]:
    """Input disc, the floating disc where both directions slide, and the carrier with its slot.

    Slot 1 runs along the major axis and slot 2 along the minor one, as their lever arms in Jia 2021, Eq. (33) say; a
    one-way wave generator has the slot of the direction it frees, between input disc and cam.
    """
    if carrier.options.bolt_count:
        raise HdoptError(
            f"export.bolt_count is {carrier.options.bolt_count}, but the cam of the {structure.value} structure "
            "slides; remove it, or choose the integral structure"
        )
    slide = CrossSlide(carrier, structure)
    bore = carrier.clearance_bore()
    if isinstance(carrier, Cam):
        slot = slide.carrier_slot(carrier.room, carrier.width)
        back, driven = carrier.back, carrier.parts(bore, slot=slot)
    else:
        thickness = slide.depth + carrier.wall
        slot = slide.carrier_slot(math.inf, thickness)
        driven = carrier.parts(bore, slot.mouth_reach + carrier.wall, thickness, slot)
        back = driven[0].bottom
    between: tuple[Part, ...] = ()
    if structure is Structure.AUTOMATIC:
        disc = slide.floating_disc(back, bore)
        back, between = disc.bottom, (disc,)
    return (slide.input_disc(back), *between, *driven)
