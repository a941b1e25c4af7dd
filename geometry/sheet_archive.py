"""The drawing sheets as files: a ZIP of SVG and DXF, and the checks of ZIP and PDF once they lie on disk."""

from __future__ import annotations

import io
import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

from hdopt.files import JsonReady
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.job import Job
from hdopt.geometry.part_sheets import sheets
from hdopt.geometry.sheet_dxf import dxf_of
from hdopt.geometry.zip_entry import add_entry


def names(job: Job) -> list[str]:
    """Names of the sheets of a `job`, without their endings."""
    made = [f"{number:02d}-{part.name}" for number, (part, _) in enumerate(job.made, 1)]
    return ["00-assembly", *made, f"{len(made) + 1:02d}-mating-parts"]


def write_drawings(path: Path, job: Job) -> None:
    """Write every sheet of a `job` as SVG and as DXF into one ZIP at `path`."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, sheet in zip(names(job), sheets(job), strict=True):
            for ending, text in (("svg", sheet.svg()), ("dxf", dxf_of(sheet))):
                add_entry(archive, f"{name}.{ending}", text)


def check_drawings(path: Path, job: Job, name: str) -> JsonReady:
    """Read the ZIP at `path` back: every sheet of the `job` in both forms, in mm, naming the study and saying the same
    texts. Raises `CheckFailed`, which calls the file `name`, with all that is wrong."""
    from ezdxf.filemanagement import read

    failures, count = [], 0
    with zipfile.ZipFile(path) as archive:
        for sheet in names(job):
            root = ElementTree.fromstring(archive.read(f"{sheet}.svg"))
            said = [item.text or "" for item in root.iter("{http://www.w3.org/2000/svg}text")]
            count += len(said)
            document = read(io.StringIO(archive.read(f"{sheet}.dxf").decode("utf-8")))
            if document.header.get("$INSUNITS") != 4:
                failures.append(f"{sheet}.dxf is not in millimetres")
            drawn = [entity.dxf.text for entity in document.modelspace().query("TEXT")]
            if drawn != said:
                failures.append(f"{sheet}.dxf does not say what {sheet}.svg says")
            if not any(job.identity.fingerprint in text for text in said):
                failures.append(f"{sheet}.svg does not name the study")
    if failures:
        raise CheckFailed(name, failures)
    return {"sheets": len(names(job)), "texts": count}


def check_pdf(path: Path, job: Job, name: str) -> JsonReady:
    """Read the PDF at `path` back: it is whole, with a page for every sheet of the `job`. Raises `CheckFailed`, which
    calls the file `name`, where it is not."""
    content = path.read_bytes()
    pages = len(re.findall(rb"/Type /Page\b", content))
    failures = []
    if not (content.startswith(b"%PDF-") and b"%%EOF" in content[-32:]):
        failures.append("it is not a whole PDF")
    if pages != len(names(job)):
        failures.append(f"it has {pages} pages, not {len(names(job))}")
    if failures:
        raise CheckFailed(name, failures)
    return {"pages": pages}
