"""Every section of the kinematics and profiles in a real browser, with made-up but realistic numbers."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from hdopt.drive.profiles import Ellipse, Resal, TwoDisk, curvature
from hdopt.report import Report
from hdopt.report.html import write_report
from hdopt.report.sections.design_map import Design, Limit, pressure_angle_width_section
from hdopt.report.sections.lag import lag_section
from hdopt.report.sections.orders import spectrum_section
from hdopt.report.sections.profiles import profiles_section
from hdopt.report.sections.published import published_section
from hdopt.report.sections.structures import structures_section
from hdopt.report.sections.tornado import sensitivities_section
from hdopt.report.sections.waveform import waveform_section

RATIO = 80.0
RADIUS = 30.65
TURN = np.radians(np.arange(361.0))


def beating(theta: np.ndarray) -> np.ndarray:
    """Two zones whose larger deviation drives: kinks and a beat like those of a drive, in arcmin."""
    zones = [0.35 * np.sin(theta + s) * s + 0.2 * np.sin(2 * theta) + 0.2 * np.sin(2.025 * theta + s) for s in (1, -1)]
    return np.max(zones, axis=0)


def all_sections() -> tuple:
    theta = np.radians(np.arange(0, 360 * RATIO + 1, 2))
    structures = pd.DataFrame(
        {
            "structure": ["integral", "automatic", "one_way_major", "one_way_minor"],
            "peak_to_peak_arcmin": [1.369, 1.063, 1.062, 1.37],
            "lag_mean_arcmin": [0.5, 0.7, 0.6, 0.6],
            "lag_min_arcmin": [0.2, 0.4, 0.3, 0.3],
            "lag_max_arcmin": [0.9, 1.1, 1.0, 1.0],
        }
    )
    profiles = {
        "ellipse": Ellipse.of_equal_perimeter(RADIUS, RADIUS + 0.396),
        "resal": Resal(RADIUS, 0.396),
        "two_disk": TwoDisk(RADIUS, 0.396, np.radians(60)),
    }
    angle, width = np.linspace(8, 20, 9), np.linspace(5, 14, 10)
    error = 0.1 * angle[:, None] * np.sqrt(width / 9)
    variables = pd.DataFrame(
        {
            "variable": ["Wave generator tilt, major axis", "CS tooth amplitude", "Pressure angle"],
            "low": ["0.05 deg", "0.001 mm", "10 deg"],
            "high": ["0.15 deg", "0.003 mm", "14 deg"],
            "low_arcmin": [1.24, 1.25, 1.37],
            "high_arcmin": [1.43, 1.42, 1.5],
        }
    )
    cases = pd.DataFrame(
        {
            "case": ["base", "automatic", "α = 10°"],
            "published_arcmin": [1.329, 1.0241, 1.17],
            "sampled_arcmin": [1.3289, 1.0244, 1.172],
            "converged_arcmin": [1.369, 1.063, 1.203],
        }
    )
    interference = pd.DataFrame({"order": [2.0], "neighbour": [2.0125], "correlation": [0.98]})
    return (
        waveform_section(theta, beating(theta), requirement_arcmin=1.0),
        spectrum_section(
            np.array([1 / RATIO, 1, 2, 2.0125, 2.025, 3]),
            np.array([0.13, 0.31, 0.28, 0.13, 0.02, 0.07]),
            ["1/N", "1", "2", "2(1 + 1/2N)", "2(1 + 1/N)", "3"],
            ["input axis", "wave generator", "input axis", "both splines", "FS teeth", "zone switching"],
            RATIO,
            interference=interference,
        ),
        structures_section(structures, waveforms=(TURN, {n: beating(TURN) for n in structures["structure"]})),
        profiles_section(
            TURN,
            {name: p.radius(TURN) - RADIUS for name, p in profiles.items()},
            {name: curvature(p, TURN) - 1 / RADIUS for name, p in profiles.items()},
            RADIUS,
            pd.DataFrame({"profile": list(profiles), "contact_angle_deg": [54.56, 54.99, 57.71]}),
        ),
        pressure_angle_width_section(
            angle,
            width,
            error,
            Design("design", 9.0, 12.0),
            requirement_arcmin=1.0,
            limits=[Limit("flank pressure", error * 0 + width, 7.0)],
        ),
        sensitivities_section(variables, 1.329),
        lag_section(
            TURN, beating(TURN) - 0.2, {"Tooth backlash": beating(TURN) - 0.4, "Cross-slide": 0.2 + 0 * TURN}, 0.3
        ),
        published_section(cases, source="Jia 2021, Tables 2 and 3"),
    )


def test_every_section_is_drawn_hovered_and_printed(look_at, tmp_path):
    findings = look_at(write_report(Report("Sections", "", all_sections()), tmp_path))
    assert len(findings.figures) == 15
    assert re.search(
        r" at (10|14) deg: 1\.\d{4} arcmin| at 0\.\d+ (deg|mm): 1\.\d{4} arcmin",
        findings.labels["sensitivities-tornado"],
    )
