"""What parts are made of: as the study says, or as is usual where it does not; and their mass."""

from __future__ import annotations

from dataclasses import dataclass

from hdopt.geometry.options import ExportOptions
from hdopt.geometry.part import Part


@dataclass(frozen=True)
class Material:
    """A material's name, its density (kg/mm^3), whether the name was assumed; and its hardness, "" where none is known.

    A hardness belongs to its material: that of an assumed material never stands beside one that the study names.
    """

    name: str
    density: float
    assumed: bool
    hardness: str
    hardness_assumed: bool

    @property
    def label(self) -> str:
        """What a title block calls it."""
        return f"material (assumed): {self.name}" if self.assumed else f"material: {self.name}"

    @property
    def hardness_label(self) -> str:
        """What a title block says of the hardness."""
        if not self.hardness:
            return "hardness: none is named with this material"
        return f"hardness{' (assumed)' * self.hardness_assumed}: {self.hardness}"

    @property
    def with_hardness(self) -> str:
        return f"{self.name}, {self.hardness}" if self.hardness else self.name


STEEL, BRONZE = 7.85e-6, 8.8e-6
"""kg/mm^3."""

USUAL = {
    "cam": ("100Cr6 (1.3505), hardened", "58-62 HRC", STEEL),
    "hub": ("42CrMo4 (1.7225), quenched and tempered", "28-32 HRC", STEEL),
    "input_disc": ("CuSn12-C (CC483K)", "90 HB", BRONZE),
    "floating_disc": ("42CrMo4 (1.7225), nitrided", "600 HV", STEEL),
}
"""How the options' keys begin -> material, hardness and density where the study gives none."""

KINDS = {"disc_1": "cam", "disc_2": "cam", "eccentric_hub": "hub"}
"""Part -> how its options' keys begin, where that is not its own name."""


def material(part: Part, options: ExportOptions) -> Material:
    """The material of a `part` that is made: that of the `options`, or the usual one."""
    kind = KINDS.get(part.name, part.name)
    name, hardness, density = USUAL[kind]
    given, own = getattr(options, f"{kind}_material"), getattr(options, f"{kind}_density_g_cm3")
    hard = getattr(options, f"{kind}_hardness")
    usual = hardness if given is None else ""
    return Material(
        given or name,
        density if own is None else 1e-6 * own,
        given is None,
        hard or usual,
        hard is None and bool(usual),
    )


def mass(part: Part, options: ExportOptions) -> float:
    """Mass of a `part` that is made, kg; its material is that of the `options`, or the usual one."""
    return part.volume * material(part, options).density
