"""Triangle meshes for printing: STL (all parts in place) and 3MF (named, coloured objects), checked from disk."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.files import JsonReady
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.zip_entry import add_entry

if TYPE_CHECKING:
    import cadquery as cq

    from hdopt.geometry.job import Job
    from hdopt.geometry.part import Part

CHORD = 0.005
"""Largest distance between a mesh and its solid, mm: a tenth of what printers resolve."""

ANGLE = 0.05
"""Largest turn between two triangles on a curved face, rad."""

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006/"

Triangles = Array
"""Shape (n, 3, 3): corners of n triangles, counter-clockwise seen from outside."""


def triangles(solid: cq.Solid) -> tuple[Triangles, Array, Index]:
    """A solid's mesh as triangles, and as its vertices (n, 3) with the indices of each triangle's corners."""
    found, corners = solid.tessellate(CHORD, ANGLE)
    vertices = np.array([vertex.toTuple() for vertex in found])
    # Faces mesh their common edge with the same points; to a nanometre they are one.
    _, first, same = np.unique(np.round(vertices, 6), axis=0, return_index=True, return_inverse=True)
    vertices, indices = vertices[first], same.reshape(-1)[np.array(corners)]
    indices = indices[(indices != np.roll(indices, 1, axis=1)).all(axis=1)]
    return vertices[indices], vertices, indices


def write_stl(path: Path, job: Job) -> None:
    """Write a binary STL of every part of a `job` that is made, in its place, to `path`."""
    mesh = np.concatenate([triangles(solid)[0] for part, solid in job.solids if not part.context])
    normal = np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    records = np.zeros(len(mesh), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    records["normal"], records["corners"] = normal / np.where(length > 0, length, 1), mesh
    # A header that starts with "solid" would make readers take the file for text.
    header = f"hdopt {job.identity.fingerprint} mm".encode("ascii").ljust(80)[:80]
    path.write_bytes(header + np.uint32(len(mesh)).tobytes() + records.tobytes())


def check_stl(path: Path, job: Job, name: str) -> JsonReady:
    """Read the STL at `path` back: its mesh is closed and has the volume and extents of the parts of the `job`. Raises
    `CheckFailed`, which calls the file `name`, with all that is wrong."""
    content = path.read_bytes()
    count = int(np.frombuffer(content, "<u4", 1, 80)[0])
    records = np.frombuffer(content, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")], count, 84)
    made = [part for part in job.model.parts if not part.context]
    failures = _faults(records["corners"].astype(float), made, job, "it")
    if failures:
        raise CheckFailed(name, failures)
    return {"triangles": count, "chord_mm": CHORD}


def write_3mf(path: Path, job: Job) -> None:
    """Write a 3MF of a `job` to `path`: one object a part, with its name and colour. CadQuery's own writer has no
    names."""
    made = [(part, solid) for part, solid in job.solids if not part.context]
    model = ElementTree.Element("model", {"xmlns": CORE, "unit": "millimeter", "xml:lang": "en-US"})
    for key, text in (("Title", job.identity.title), ("Description", job.identity.description)):
        ElementTree.SubElement(model, "metadata", name=key).text = text
    resources = ElementTree.SubElement(model, "resources")
    materials = ElementTree.SubElement(resources, "basematerials", id="1")
    for part, _ in made:
        colour = "#" + "".join(f"{round(255 * share):02X}" for share in part.colour)
        ElementTree.SubElement(materials, "base", name=part.name, displaycolor=colour)
    for index, (part, solid) in enumerate(made):
        attributes = {"id": str(index + 2), "name": part.name, "type": "model", "pid": "1", "pindex": str(index)}
        mesh = ElementTree.SubElement(ElementTree.SubElement(resources, "object", attributes), "mesh")
        _, vertices, indices = triangles(solid)
        points = ElementTree.SubElement(mesh, "vertices")
        for x, y, z in vertices.tolist():
            ElementTree.SubElement(points, "vertex", x=f"{x:.7g}", y=f"{y:.7g}", z=f"{z:.7g}")
        faces = ElementTree.SubElement(mesh, "triangles")
        for a, b, c in indices.tolist():
            ElementTree.SubElement(faces, "triangle", v1=str(a), v2=str(b), v3=str(c))
    build = ElementTree.SubElement(model, "build")
    for index in range(len(made)):
        ElementTree.SubElement(build, "item", objectid=str(index + 2))
    types = (
        f'<Types xmlns="{_PACKAGE}content-types">'
        f'<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        f'<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
    )
    relation = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
    relations = (
        f'<Relationships xmlns="{_PACKAGE}relationships">'
        f'<Relationship Id="rel0" Target="/3D/3dmodel.model" Type="{relation}"/></Relationships>'
    )
    declaration = '<?xml version="1.0" encoding="UTF-8"?>\n'
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry, text in (
            ("[Content_Types].xml", types),
            ("_rels/.rels", relations),
            ("3D/3dmodel.model", ElementTree.tostring(model, encoding="unicode")),
        ):
            add_entry(archive, entry, declaration + text)


def check_3mf(path: Path, job: Job, name: str) -> JsonReady:
    """Read the 3MF at `path` back: the parts by name, each mesh closed and with the volume and extents of the parts of
    the `job`. Raises `CheckFailed`, which calls the file `name`, with all that is wrong."""
    with zipfile.ZipFile(path) as archive:
        model = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    failures = []
    if model.get("unit") != "millimeter":
        failures.append("its unit is not the millimetre")
    made = [part for part in job.model.parts if not part.context]
    objects = {item.get("name"): item for item in model.iter(f"{{{CORE}}}object")}
    if list(objects) != [part.name for part in made]:
        failures.append(f"it holds {', '.join(map(str, objects))}, not {', '.join(part.name for part in made)}")
    count = 0
    for part in made:
        item = objects.get(part.name)
        if item is None:
            continue
        vertices = np.array([[float(v.get(axis, "nan")) for axis in "xyz"] for v in item.iter(f"{{{CORE}}}vertex")])
        indices = [[int(t.get(f"v{k}", "0")) for k in (1, 2, 3)] for t in item.iter(f"{{{CORE}}}triangle")]
        count += len(indices)
        failures += _faults(vertices[np.array(indices)], [part], job, part.name)
    if failures:
        raise CheckFailed(name, failures)
    return {"triangles": count, "chord_mm": CHORD, "objects": list(objects)}


def _faults(mesh: Triangles, parts: list[Part], job: Job, what: str) -> list[str]:
    """What is wrong with a mesh of these parts: holes, volume, extents."""
    failures = []
    _, corners = np.unique(np.round(mesh.reshape(-1, 3), 4), axis=0, return_inverse=True)
    corners = corners.reshape(-1, 3)
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]].astype(np.int64)
    # Every edge is walked as often forth as back.
    ways = edges @ np.array([[int(corners.max()) + 1, 1], [1, int(corners.max()) + 1]])
    if not np.array_equal(np.sort(ways[:, 0]), np.sort(ways[:, 1])):
        failures.append(f"{what} is not closed: an edge lacks its neighbour")
    volume = float(np.einsum("ij,ij->i", mesh[:, 0], np.cross(mesh[:, 1], mesh[:, 2])).sum() / 6)
    expected = sum(part.volume for part in parts)
    names = {part.name for part in parts}
    area = sum(solid.Area() for part, solid in job.solids if part.name in names)
    if not abs(volume - expected) <= CHORD * area:
        failures.append(f"{what} has a volume of {volume:.3f} mm^3, not {expected:.3f}")
    boxes = np.array([part.box for part in parts])
    low, high = boxes[:, :3].min(0), boxes[:, 3:].max(0)
    if np.abs(np.concatenate([mesh.min((0, 1)) - low, mesh.max((0, 1)) - high])).max() > CHORD:
        failures.append(f"{what} does not span the extents of its parts")
    return failures
