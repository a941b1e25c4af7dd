"""Drives with what an export needs, and files that several tests read."""

from __future__ import annotations

from dataclasses import replace

import cases
import pytest

from hdopt.drive import Clearances, Drive, Structure
from hdopt.geometry.export import ExportResult, export
from hdopt.study.export import ExportSection

CLEARANCES = Clearances(backlash=0.01, cross_slide=0.02, slot_1_width=6.0, slot_2_width=6.0, disc_radius=15.0)


def drive(profile: str = "ellipse", structure: Structure = Structure.INTEGRAL, **generator) -> Drive:
    """The CSF-25-80 with a profile and a structure, and with changes to its wave generator."""
    made = replace(cases.drive(cases.PROFILES[profile], structure), clearances=CLEARANCES)
    return replace(made, wave_generator=replace(made.wave_generator, **generator))


@pytest.fixture(scope="session")
def exported(tmp_path_factory):
    """A function that exports a profile and structure to STEP, once a session."""
    done: dict[tuple, ExportResult] = {}

    def get(profile: str, structure: Structure = Structure.INTEGRAL, **options) -> ExportResult:
        key = (profile, structure, *sorted(options.items()))
        if key not in done:
            folder = tmp_path_factory.mktemp("export")
            section = ExportSection(**options)
            done[key] = export(drive(profile, structure), {"step": folder / "wave.step"}, section, "test study")
        return done[key]

    return get
