"""Draws a scene of meshes and edges to a PNG: `python -m hdopt.geometry.render SCENE.npz PICTURE.png`."""

from __future__ import annotations

import sys
from typing import Any  # Any: objects of VTK, which brings no types

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[Any]
"""Points, indices or colours; VTK's own objects have no types."""

SIZE = (1600, 1000)
EDGE_COLOUR = (0.10, 0.13, 0.17)
FEATURE_ANGLE = 25.0
"""Facets that meet at less than this, deg, are shaded as one smooth face."""

LIGHTS = (((-0.6, 1.0, 1.0), 0.7), ((0.9, 0.2, 0.8), 0.45), ((-0.3, -0.4, 1.0), 0.3))
"""Places about the camera, and strengths."""


def render(scene: str, picture: str) -> None:
    """Render `scene` off screen with VTK and write `picture`."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (what renders; without it pictures stay blank)
    from vtkmodules.vtkIOImage import vtkPNGWriter
    from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

    arrays = np.load(scene)
    renderer = vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    for index in range(sum(name.startswith("colour") for name in arrays)):
        renderer.AddActor(_surface(*(arrays[f"{what}{index}"] for what in ("vertices", "corners", "colour"))))
        renderer.AddActor(_edges(*(arrays[f"{what}{index}"] for what in ("edges", "lengths"))))
    _lights(renderer)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(*SIZE)
    window.AddRenderer(renderer)
    _look(renderer, arrays["eye"])
    window.Render()
    image = vtkWindowToImageFilter()
    image.SetInput(window)
    image.ReadFrontBufferOff()
    writer = vtkPNGWriter()
    writer.SetFileName(picture)
    writer.SetInputConnection(image.GetOutputPort())
    writer.Write()


def _surface(vertices: Numbers, corners: Numbers, colour: Numbers) -> Any:
    from vtkmodules.vtkFiltersCore import vtkPolyDataNormals
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    data = _poly_data(vertices)
    data.SetPolys(_cells(corners.ravel(), np.full(len(corners), 3)))
    normals = vtkPolyDataNormals()
    normals.SetInputData(data)
    normals.SetFeatureAngle(FEATURE_ANGLE)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    finish = actor.GetProperty()
    finish.SetColor(*colour.tolist())
    finish.SetAmbient(0.22)
    finish.SetDiffuse(0.72)
    finish.SetSpecular(0.25)
    finish.SetSpecularPower(30)
    return actor


def _edges(points: Numbers, lengths: Numbers) -> Any:
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    data = _poly_data(points)
    data.SetLines(_cells(np.arange(len(points)), lengths))
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    # Edges lie on the surfaces; they are drawn a hair nearer to the eye.
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0, -4)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*EDGE_COLOUR)
    actor.GetProperty().SetLineWidth(1.6)
    actor.GetProperty().LightingOff()
    return actor


def _poly_data(points: Numbers) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    held = vtkPoints()
    held.SetData(numpy_to_vtk(np.ascontiguousarray(points, float), deep=True))
    data = vtkPolyData()
    data.SetPoints(held)
    return data


def _cells(indices: Numbers, lengths: Numbers) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    cells = vtkCellArray()
    cells.SetData(
        numpy_to_vtkIdTypeArray(starts, deep=True), numpy_to_vtkIdTypeArray(indices.astype(np.int64), deep=True)
    )
    return cells


def _lights(renderer: Any) -> None:
    from vtkmodules.vtkRenderingCore import vtkLight

    renderer.AutomaticLightCreationOff()
    for place, strength in LIGHTS:
        light = vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(*place)
        light.SetIntensity(strength)
        renderer.AddLight(light)


def _look(renderer: Any, eye: Numbers) -> None:
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetFocalPoint(0, 0, 0)
    camera.SetPosition(*eye.tolist())
    camera.SetViewUp(0, 1, 0)
    renderer.ResetCamera()
    camera.Zoom(1.25)
    renderer.ResetCameraClippingRange()


if __name__ == "__main__":
    render(*sys.argv[1:])
