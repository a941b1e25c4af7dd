"""Files that several tests read."""

from __future__ import annotations

import pytest
from wave_generators import drive

from hdopt.drive.geometry import Structure
from hdopt.geometry.export import ExportResult, export_drive
from hdopt.geometry.options import ExportOptions


@pytest.fixture(scope="session")
def exported(tmp_path_factory):
    """A function that exports a profile and structure to STEP, once a session."""
    done: dict[tuple, ExportResult] = {}

    def get(profile: str, structure: Structure = Structure.INTEGRAL, **options) -> ExportResult:
        key = (profile, structure, *sorted(options.items()))
        if key not in done:
            folder = tmp_path_factory.mktemp("export")
            section = ExportOptions(**options)
            done[key] = export_drive(drive(profile, structure), {"step": folder / "wave.step"}, section, "test study")
        return done[key]

    return get
