"""Random settings of the explorer, and what Python's closed form says of them.

    python tests/browser/explorer_reference.py     # renews explorer_reference.npy: some minutes

The peak-to-peak values are kept because Python's search takes 10 ms a setting; `test_explorer.py` looks every time
whether a sample of them is still what Python says.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from hdopt.drive.errors import ERROR_NAMES, DriveErrors
from hdopt.drive.geometry import Drive, DriveGeometry, Structure, WaveGenerator
from hdopt.drive.profiles import Ellipse, Resal, TwoDisk
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.kinematics.waveform import CLOSED_FORM

FILE = Path(__file__).with_suffix(".npy")
COUNT = 10_000

GEARS = (
    DriveGeometry(160, 162, 0.396, math.radians(12), 30.65, 0.277, 0.257, 0.74),
    DriveGeometry(100, 102, 0.5, math.radians(20), 24.0, 0.35, 0.32, 0.6),
    DriveGeometry(121, 123, 0.3, math.radians(15), 17.5, 0.21, 0.2, 0.4),
)
"""The CSF-25-80, a smaller ratio, and an odd number of teeth, whose beat has twice the turns."""
LARGEST = {"tilt": math.radians(0.6), "eccentricity": 0.045, "amplitude": 0.009}
"""Three times the tolerances of the shipped drive: as far as the sliders go."""


def setting(index: int) -> dict[str, Any]:
    """Setting `index`: every structure with every profile in turn, the rest at random, in mm and rad."""
    random = np.random.default_rng([18, index])
    profile = ("ellipse", "resal", "two_disk")[index % 3]
    structure = list(Structure)[index // 3 % 4].value
    share = random.choice([1 / 3, 1.0])
    errors = []
    for name in ERROR_NAMES:
        kind = next((kind for kind in LARGEST if name.endswith(kind) or f"_{kind}_" in f"{name}_"), "")
        if name.endswith(("direction", "phase")):
            errors.append(random.uniform(0, 2 * math.pi))
        else:
            low = -1.0 if kind == "tilt" else 0.0
            errors.append(float(share * LARGEST[kind] * random.uniform(low, 1.0) * (random.random() > 0.1)))
    return {
        "gear": index // 12 % len(GEARS),
        "profile": profile,
        "structure": structure,
        "wrapAngle": random.uniform(0, math.radians(80)),
        "pressureAngle": random.uniform(math.radians(5), math.radians(30)),
        "width": random.uniform(4.5, 18.0),
        "errors": errors,
    }


def drive(one: dict[str, Any]) -> Drive:
    """The drive that a setting describes."""
    gear = GEARS[one["gear"]]
    radius, deflection = gear.flexspline_inner_radius, gear.module
    profile = {
        "ellipse": lambda: Ellipse.of_equal_perimeter(radius, radius + deflection),
        "resal": lambda: Resal(radius, deflection),
        "two_disk": lambda: TwoDisk(radius, deflection, one["wrapAngle"]),
    }[one["profile"]]()
    sizes = {**vars(gear), "pressure_angle": one["pressureAngle"]}
    return Drive(DriveGeometry(**sizes), WaveGenerator(profile, Structure(one["structure"]), one["width"]))


def errors(one: dict[str, Any]) -> DriveErrors:
    return DriveErrors.from_matrix(one["errors"])


def script_gear(index: int) -> dict[str, float | None]:
    """A gear as closed_form.js takes it."""
    gear = GEARS[index]
    radius = gear.flexspline_inner_radius
    return {
        "fsTeeth": gear.flexspline_teeth,
        "csTeeth": gear.circular_spline_teeth,
        "module": gear.module,
        "innerRadius": radius,
        "fsAddendum": gear.flexspline_addendum,
        "csAddendum": gear.circular_spline_addendum,
        "wall": gear.flexspline_wall,
        "semiMajor": radius + gear.module,
        "semiMinor": Ellipse.of_equal_perimeter(radius, radius + gear.module).semi_minor,
        "modulus": 206000.0,
    }


def peak_to_peak(one: dict[str, Any]) -> float:
    return converged_peak_to_peak_arcmin(drive(one), errors(one), CLOSED_FORM)


if __name__ == "__main__":
    np.save(FILE, np.array([peak_to_peak(setting(index)) for index in range(COUNT)], dtype=np.float32))
