"""A rendered picture of the parts, pulled apart along the axis: PNG by VTK, off screen, in a process of its own."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdopt.arrays import Array, Index
from hdopt.errors import HdoptError
from hdopt.files import JsonReady
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.drawing import EXPLODED, pulled_apart
from hdopt.geometry.mesh import triangles
from hdopt.geometry.render import SIZE
from hdopt.geometry.views import sharp_edges

if TYPE_CHECKING:
    import cadquery as cq

    from hdopt.geometry.job import Job
    from hdopt.geometry.part import Part

LEAST_COLOURS = 20
"""A picture with fewer different colours than this shows nothing."""

TIME_LIMIT = 120.0
"""Seconds; a picture takes one or two."""


class NoPicture(HdoptError):
    """The machine has no OpenGL to render a picture with."""


def write_png(path: Path, job: Job) -> None:
    """Render the parts of a `job` in their colours, with their edges, to `path`; `NoPicture` where the machine cannot
    render off screen.

    Where OpenGL is missing VTK does not say so but ends the process it runs in, so it is given one of its own.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.npz"
        # Its keyword allow_pickle is a bool, and the arrays of a scene could bear any name, for all that types say.
        np.savez(scene, eye=np.array(EXPLODED[0]), **_scene(job))  # type: ignore[arg-type]  # see above
        command = [sys.executable, "-m", "hdopt.geometry.render", str(scene), str(path)]
        try:
            done = subprocess.run(command, capture_output=True, timeout=TIME_LIMIT).returncode
        except subprocess.TimeoutExpired:
            done = None
    if done != 0:
        raise NoPicture(
            "this machine cannot render the picture: VTK finds no OpenGL for it; install libegl1 (Debian's Mesa), or "
            "leave out --png"
        )


def check_png(path: Path, job: Job, name: str) -> JsonReady:
    """Read the picture of a `job` at `path` back: its size, and that something is to be seen. Returns width and height
    in pixels; raises `CheckFailed`, which calls the file `name`, where it is blank or of another size."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOImage import vtkPNGReader

    reader = vtkPNGReader()
    reader.SetFileName(str(path))
    reader.Update()
    image = reader.GetOutput()
    width, height, _ = image.GetDimensions()
    failures = []
    if (width, height) != SIZE:
        failures.append(f"it is {width} x {height} pixels, not {SIZE[0]} x {SIZE[1]}")
    elif _colours(vtk_to_numpy(image.GetPointData().GetScalars())) < LEAST_COLOURS:
        failures.append("it is blank")
    if failures:
        raise CheckFailed(name, failures)
    return {"width": width, "height": height}


def _colours(pixels: NDArray[np.uint8]) -> int:
    """How many colours `pixels` (n, 3 or more) of red, green and blue have."""
    seen = np.zeros((256, 256, 256), bool)
    seen[pixels[:, 0], pixels[:, 1], pixels[:, 2]] = True
    return int(np.count_nonzero(seen))


def _scene(job: Job) -> dict[str, Array | Index]:
    """Meshes, colours and edges of all parts, as arrays; parts in a context stay in their
    places."""
    made = [(part, solid) for part, solid in job.solids if not part.context]
    shapes: list[tuple[Part, cq.Solid]] = list(job.solids)
    if len(made) == len(shapes):
        shapes = list(zip((part for part, _ in made), pulled_apart(made), strict=True))
    arrays: dict[str, Array | Index] = {}
    for index, (part, shape) in enumerate(shapes):
        _, vertices, corners = triangles(shape)
        lines = sharp_edges(shape)
        arrays[f"colour{index}"] = np.array(part.colour[:3])
        arrays[f"vertices{index}"], arrays[f"corners{index}"] = vertices, corners
        arrays[f"edges{index}"] = np.concatenate(lines)
        arrays[f"lengths{index}"] = np.array([len(line) for line in lines])
    return arrays
