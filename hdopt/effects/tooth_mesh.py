"""Tooth-to-tooth (short-wave) deviation: a ripple at the tooth-mesh order.

Every input turn the wave generator passes Z_CS teeth of the circular spline and Z_FS (1 + 1/N) = Z_CS of the
flexspline, so single-pitch and profile deviations (ISO 1328-1, f_pt and F_alpha) ripple at order Z_CS, with sidebands
where the depth of mesh varies over the turn (orders Z_CS +- 1, +- 2) and, farther out, where the driving zone changes,
each zone having a phase of its own: the short-wave part that Jia 2021, Sec. 2.2, leaves out. With two lobes and a tooth
difference of 2, Z_CS = 2 (N + 1). Needs more than 2 Z_CS samples a turn. Units: arcmin at the output, or um of arc
where it acts inside the zones, and also decides which one drives. Prior: 0 to 2 arcmin, 0 to 20 um.

Where every tooth has a height of its own, no few sidebands hold it, and the heights' slow part moves the driving zone
too: then the form of a flank within its pitch, h ((1 - cos p)/2 + s sin p), is met with the height h of each tooth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects.base import Effect, Keys
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import UM, Numbers, Quantity, Sines, number, smallest_set
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.met import Spline, ToothForms, ZoneWaves
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Shape, Term
from hdopt.errors import HdoptError

Sides = tuple[int, ...]

SIDEBANDS: tuple[Sides, ...] = (
    (0,),
    (0, -2, 2),
    (0, -1, 1, -2, 2),
    (0, -2, 2, -4, 4),
    *((0, *range(-k, 0), *range(1, k + 1)) for k in (4, 7, 11)),
)
FEW = SIDEBANDS[:3]
"""The variants of few lines."""
ZONE_SIDEBANDS: tuple[Sides, ...] = tuple(
    (0, *(side for k in range(1, most + 1) for side in (-k, k))) for most in (0, 1, 2, 5, 11)
)
"""Inside the zones, whose change needs no sidebands of its own: those of teeth that differ in height, slowly round the
rim. Each holds those of the one before, in their order."""
ZONE = 100
"""Members ZONE z + k of the sines are the sideband k of the ripple inside zone z."""


def _keys_of(offset: int) -> tuple[str, str]:
    if offset == 0:
        return "amplitude_arcmin", "phase_deg"
    side = f"{'plus' if offset > 0 else 'minus'}_{abs(offset)}"
    return f"amplitude_{side}_arcmin", f"phase_{side}_deg"


def _zone_keys(zone: int, offset: int) -> tuple[str, str]:
    amplitude, phase = _keys_of(offset)
    return f"zone_{zone}_{amplitude.replace('arcmin', 'um')}", f"zone_{zone}_{phase}"


BESIDE = Sines(
    {k: _keys_of(k) for k in sorted({k for group in SIDEBANDS for k in group}, key=abs)},
    "arcmin",
    "at order Z_CS, and K cycles a turn beside it",
    prior=(0.0, 2.0),
    shown="`amplitude_arcmin`, `phase_deg`; `amplitude_plus_K_arcmin`, `amplitude_minus_K_arcmin` with phases, "
    "K 1 to 11",
)
INSIDE = Sines(
    {ZONE * zone + k: _zone_keys(zone, k) for zone in (1, 2) for k in ZONE_SIDEBANDS[-1]},
    "um",
    "of arc, the same inside zone Z",
    prior=(0.0, 20.0),
    scale=UM,
    shown="`zone_Z_amplitude_um`, `zone_Z_amplitude_plus_K_um`, ... with phases, Z 1 and 2, K 1 to 11",
)
HEIGHTS = Numbers(
    "form_heights_um", "um", "of arc, the form of each flank of the circular spline, Z_CS of them", "h", (-20.0, 20.0)
)
SKEW = Quantity(
    "form_skew", "1", "part of the form that is a sine over the pitch", "s", (-1.0, 1.0), None, at_least=-1, at_most=1
)
START = Quantity(
    "form_start", "1", "where the first of these teeth begins, in pitches", "q", (0.0, 1.0), None, at_least=0, at_most=1
)
SKEW_STEP = 0.02
LARGEST_SKEW = 1.0
"""Skew up to which the form is one of a flank: beyond it the sine is all of it."""
MOST_SKEW = 0.5
"""Skew up to which a fit of heights begins."""


def mesh_order(ratio: float) -> float:
    """Z_CS: teeth that the wave generator passes an input turn, for two lobes and a `ratio` N."""
    return 2.0 * round(ratio + 1)


def _zone_members(sides: Sides) -> list[int]:
    return [ZONE * zone + k for zone in (1, 2) for k in sides]


class ToothMesh(Effect):
    id = "tooth_mesh"
    place = 30
    domain = "order"
    high_order = True
    excites = True
    needs_strain_wave = True
    acts = "beside, or zones"
    separating = "sample more than twice per tooth, at two speeds: the mesh ripple stays at Z_CS cycles a turn"
    declared = (BESIDE, INSIDE, HEIGHTS, SKEW, START)
    examples = (
        {"amplitude_arcmin": 0.05, "phase_deg": 10.0},
        {
            "amplitude_arcmin": 0.05,
            "phase_deg": 10.0,
            "amplitude_minus_2_arcmin": 0.02,
            "phase_minus_2_deg": 20.0,
            "amplitude_plus_2_arcmin": 0.01,
            "phase_plus_2_deg": 30.0,
        },
        {
            "zone_1_amplitude_um": 1.0,
            "zone_1_phase_deg": 10.0,
            "zone_2_amplitude_um": 1.5,
            "zone_2_phase_deg": 20.0,
            "zone_2_amplitude_minus_1_um": 0.2,
            "zone_2_phase_minus_1_deg": 30.0,
        },
        {
            "form_heights_um": [2.0 + 0.1 * (7 * tooth % 11) for tooth in range(162)],
            "form_skew": 0.2,
            "form_start": 0.25,
        },
    )

    def lacks(self, conditions: Conditions) -> str | None:
        need = 2.05 * mesh_order(conditions.ratio)
        if conditions.rows_per_turn < need:
            return f"more than {need:.0f} samples an input turn (there are {conditions.rows_per_turn:.0f})"
        return None

    def search(self, probe: Probe) -> Sequence[Term]:
        if not probe.order_range[0] < mesh_order(probe.samples.ratio) < probe.order_range[1]:
            return []
        # Not remembered: on the rows as recorded these are the widest columns of all.
        terms = [self.term(probe.samples, {"sidebands": sides}) for sides in SIDEBANDS]
        ranked = best_terms(probe, terms, len(terms))
        # The best of the few-line variants beside the best of all: many sidebands also bend to what is none.
        few = next(term for term in ranked if term.shape["sidebands"] in FEW)
        return [few] if few is ranked[0] else [few, ranked[0]]

    def in_zones(self, shape: Shape) -> Sequence[Shape]:
        return [{"sidebands": sides, "zones": True} for sides in ZONE_SIDEBANDS]

    def tooth_by_tooth(self, term: Term, coefficients: Array, ratio: float) -> Sequence[Shape]:
        """The wave of the mesh's order as a form of all teeth: of teeth that begin where the spline's angle says, and
        of teeth without a skew."""
        half = term.width // 2
        sine, cosine = (coefficients[:2] + coefficients[half : half + 2]) / 2
        teeth = int(mesh_order(ratio))
        height = max(2 * float(np.hypot(sine, cosine)), 1e-9)
        skew = float(np.clip(-sine / (2 * cosine) if cosine else 0.0, -MOST_SKEW, MOST_SKEW))
        start = float(np.arctan2(-sine, -cosine) / (2 * np.pi)) % 1
        return [
            {"heights": (height,) * teeth, "skew": skew, "start": 0.0},
            {"heights": (height,) * teeth, "skew": 0.0, "start": start},
        ]

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        if "heights" in shape:
            heights = np.array(shape["heights"])[:, None]
            kept = {**shape, "skew": float(np.clip(shape["skew"], -LARGEST_SKEW, LARGEST_SKEW))}
            met = ToothForms(Spline.CIRCULAR, heights, kept["skew"], kept["start"])
            return Term(self.id, kept, met=met, steps={"skew": SKEW_STEP}, trials=len(ZONE_SIDEBANDS))
        orders = tuple(self.orders(shape, conditions.ratio))
        if "zones" in shape:
            return Term(self.id, dict(shape), met=ZoneWaves(Spline.CIRCULAR, orders), trials=len(ZONE_SIDEBANDS))
        return Term(self.id, dict(shape), columns=sine_columns(conditions.theta, orders), trials=len(SIDEBANDS))

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        return [mesh_order(ratio) + k for k in shape.get("sidebands", (0,))]

    def highest_order(self, shape: Shape, ratio: float) -> float:
        """Heights that change from tooth to tooth have waves up to half as many again as the mesh."""
        return 1.5 * mesh_order(ratio) if "heights" in shape else super().highest_order(shape, ratio)

    def named_orders(self, shape: Shape, ratio: float) -> list[float]:
        return []

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        beside, inside = BESIDE.given(self.id, keys), INSIDE.given(self.id, keys)
        heights = HEIGHTS.given(keys)
        if heights is not None:
            return self._heights(heights, keys, gear, bool(beside or inside))
        if others := [one.key for one in (SKEW, START) if number(keys, one.key) is not None]:
            raise HdoptError(f"effects.{self.id} has {others[0]} without {HEIGHTS.key}; give the heights of all teeth")
        BESIDE.some(self.id, beside | inside)
        if not inside:
            sides = smallest_set(SIDEBANDS, beside)
            return {"sidebands": sides}, BESIDE.coefficients(beside, sides)
        if beside:
            raise HdoptError(
                f"effects.{self.id} has both sines at the output and sines inside the zones; give those in _arcmin or "
                "in _um"
            )
        sides = smallest_set(ZONE_SIDEBANDS, [member - ZONE * round(member / ZONE) for member in inside])
        return {"sidebands": sides, "zones": True}, INSIDE.coefficients(inside, _zone_members(sides))

    def _heights(
        self, heights: tuple[float, ...], keys: Keys, gear: DriveGeometry, sines: bool
    ) -> tuple[Shape, tuple[float, ...]]:
        teeth = int(mesh_order(gear.ratio))
        if len(heights) != teeth:
            raise HdoptError(
                f"effects.{self.id}.{HEIGHTS.key} has {len(heights)} heights; give one for each of the {teeth} teeth "
                "of the circular spline"
            )
        if sines:
            raise HdoptError(f"effects.{self.id} has both sines and {HEIGHTS.key}; give one of them")
        size = float(np.sqrt(np.mean(np.square(heights))))
        if not size:
            raise HdoptError(f"effects.{self.id}.{HEIGHTS.key} are all 0; give heights, or leave the effect out")
        shape = {"heights": tuple(one / size for one in heights)}
        numbers = {"skew": number(keys, SKEW.key) or 0.0, "start": number(keys, START.key) or 0.0}
        return shape | numbers, (UM * size,)

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        if "heights" in shape:
            heights = [one * coefficients[0] / UM for one in shape["heights"]]
            return {HEIGHTS.key: heights, SKEW.key: shape["skew"], START.key: shape["start"]}
        if "zones" in shape:
            return dict(INSIDE.written(_zone_members(shape["sidebands"]), coefficients))
        return dict(BESIDE.written(shape["sidebands"], coefficients))

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        if "heights" in term.shape:
            return {"form_height_um": estimate.parameter(0, "um", scale=1e3)}
        if "zones" in term.shape:
            second = term.width // 2
            return {
                "zone_1_amplitude_um": estimate.amplitude(0, 1, "um", scale=1e3),
                "zone_1_phase_deg": estimate.phase_deg(0, 1),
                "zone_2_amplitude_um": estimate.amplitude(second, second + 1, "um", scale=1e3),
                "zone_2_phase_deg": estimate.phase_deg(second, second + 1),
            }
        return {"amplitude_arcmin": estimate.amplitude(0, 1), "phase_deg": estimate.phase_deg(0, 1)}

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        said = (
            f"A ripple at the tooth-mesh order, {rms_arcmin:.2g} arcmin rms: tooth-to-tooth pitch or profile deviation"
        )
        if "heights" not in shape:
            return f"{said}."
        # By quartiles: a tooth that hardly ever drives may be told any height.
        spread = float(np.ptp(np.quantile(shape["heights"], (0.25, 0.75)))) * parameters["form_height_um"].value
        return f"{said}, its height different from tooth to tooth: half of them lie within {spread:.2g} um of arc."
