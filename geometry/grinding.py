"""G-code for a two-axis cam grinder, and the cam that its wheel would leave, simulated from the code alone.

The work turns about C, the wheel's centre moves on a line through the work's axis along X. Dialect: RS-274 as LinuxCNC
and most controls read it; G21 (mm), G90 (absolute), G93 (inverse time: F is one over the minutes of a block), C in
degrees counting up over the turns, X the distance of the wheel's centre from the work's axis, as a radius. Rotary and
linear axes move evenly within a block.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.files import JsonReady
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.contour import Contour, ParallelCurve

if TYPE_CHECKING:
    from hdopt.geometry.job import Job


CODE_TOLERANCE = 1e-4
"""Largest distance between the cam and what the wheel leaves, mm."""

STEP_TOLERANCE = 2e-5
"""What straight moves between two blocks may miss of the wheel centre's path, mm."""

RETRACTION = 5.0
"""How far the wheel stands off before and after, mm."""

TURNS_PER_MINUTE = 4.0
"""Speed of the work, of the kind that finish grinding of cams uses."""

_WORD = re.compile(r"([A-Z])\s*(-?\d+\.?\d*)")


def wheel_path(contour: ParallelCurve, wheel_radius: float) -> Array:
    """For the cam's `contour`, work angle C (rad, rising from 0 to 2 pi) and distance X of the wheel's centre (mm):
    shape (n, 2).

    The centre of a wheel of `wheel_radius` mm runs on the parallel curve that far outside the cam; blocks are so short
    that even moves in C and X miss it by at most `STEP_TOLERANCE`.
    """
    if not wheel_radius > 0:
        raise HdoptError(f"the wheel's radius is {wheel_radius:g} mm; it must be above 0 (export.wheel_radius_mm)")
    path = contour.inward(-wheel_radius)
    count = 180
    while count <= 46080:
        phi = np.linspace(0, 2 * math.pi, 2 * count + 1)
        polar = _polar(path, phi)
        nodes, between = polar[::2], polar[1::2]
        share = (between[:, 0] - nodes[:-1, 0]) / np.diff(nodes[:, 0])
        straight = nodes[:-1, 1] + share * np.diff(nodes[:, 1])
        if np.abs(straight - between[:, 1]).max() <= STEP_TOLERANCE:
            return nodes
        count *= 2
    raise HdoptError(
        f"the {contour.profile.name} profile is too rough for grinding in 46,080 blocks; give the points' scatter as "
        "wave_generator.noise_um, so that the profile is smoothed"
    )


def _polar(path: ParallelCurve, phi: Array) -> Array:
    x, y = path.points(phi).T
    angle = np.unwrap(np.arctan2(x, y))
    return np.column_stack([angle, np.hypot(x, y)])


def write_gcode(path: Path, job: Job) -> None:
    """Write one turn of finish grinding for the cam of a `job` to `path`; `HdoptError` for discs, which are ground
    round."""
    contour = _cam(job)
    radius = job.model.wheel_radius
    nodes = wheel_path(contour, radius)
    start = nodes[0, 1] + RETRACTION
    lines = [
        "%",
        f"({_plain(job.identity.title)})",
        f"({_plain(job.identity.description)})",
        "(RS-274; mm; C degrees of the work; X distance of the wheel centre from the work axis, as a radius)",
        f"(WHEEL RADIUS {radius:.4f} MM)",
        "(C 0: major axis toward the wheel; C counts the direction toward the wheel, clockwise from the major axis)",
        "G21 G90 G40 G49 G80",
        f"G0 X{start:.5f} C0.00000",
        "G94",
        f"G1 X{nodes[0, 1]:.5f} F10.0",
        "G93",
    ]
    for (before, _), (angle, distance) in zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True):
        rate = TURNS_PER_MINUTE * 2 * math.pi / (angle - before)
        lines.append(f"G1 C{math.degrees(angle):.5f} X{distance:.5f} F{rate:.3f}")
    lines += ["G94", f"G0 X{start:.5f}", "M2", "%"]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def ground_cam(text: str, contour: Contour, points: Array) -> Array:
    """What the wheel of a program leaves beyond each of `points` (n, 2) of the cam, mm; below 0 where it cuts in; shape
    (n,).

    Everything is taken from the `text` of the program: wheel radius, blocks, even moves between them. The `contour`
    says which way is out.
    """
    found = re.search(r"WHEEL RADIUS (\d+\.?\d*) MM", text)
    if found is None:
        raise HdoptError("the code does not name its wheel's radius")
    radius = float(found.group(1))
    state, nodes = {"C": 0.0, "X": 0.0}, []
    for line in text.splitlines():
        words = dict(_WORD.findall(re.sub(r"\(.*?\)", "", line)))
        moved = {axis: float(words[axis]) for axis in ("C", "X") if axis in words}
        state.update(moved)
        if moved:
            nodes.append((math.radians(state["C"]), state["X"]))
    turn = np.array(nodes)
    shares = (np.arange(8) + 0.5) / 8
    angle = (turn[:-1, :1] + shares * np.diff(turn[:, 0])[:, None]).ravel()
    distance = (turn[:-1, 1:] + shares * np.diff(turn[:, 1])[:, None]).ravel()
    angle, distance = np.concatenate([angle, turn[:, 0]]), np.concatenate([distance, turn[:, 1]])
    centres = np.column_stack([distance * np.sin(angle), distance * np.cos(angle)])
    left = np.empty(len(points))
    for start in range(0, len(points), 256):
        block = points[start : start + 256]
        left[start : start + 256] = np.hypot(*(block[:, None] - centres[None]).transpose(2, 0, 1)).min(1) - radius
    return left


def check_gcode(path: Path, job: Job, name: str) -> JsonReady:
    """Simulate the wheel from the file at `path` and compare what it leaves with the cam of the `job`. Raises
    `CheckFailed`, which calls the file `name`, where that is off by more than `CODE_TOLERANCE`."""
    contour = _cam(job)
    text = path.read_text(encoding="ascii")
    # Angles that no block ends at.
    points = contour.points(np.arange(1440) * (2 * math.pi / 1440) + 0.00137)
    left = ground_cam(text, contour, points)
    worst = float(np.abs(left).max())
    if not worst <= CODE_TOLERANCE:
        raise CheckFailed(name, [f"its wheel leaves {left.max() * 1e3:.4g} um and cuts in {-left.min() * 1e3:.4g} um"])
    return {
        "blocks": text.count("\nG1 C"),
        "max_profile_deviation_um": worst * 1e3,
        "wheel_radius_mm": job.model.wheel_radius,
    }


def _cam(job: Job) -> ParallelCurve:
    contour = job.model.profiled[0].contour
    if not isinstance(contour, ParallelCurve):
        raise HdoptError("two discs are round and are ground round, on their own axes; leave out --gcode")
    return contour


def _plain(text: str) -> str:
    """Text for a comment of the code."""
    return re.sub(r"[^ -'*-~]", " ", text)
