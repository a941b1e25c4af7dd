"""Screws that hold the cam engage enough thread, whatever is given, and are such as are made."""

from __future__ import annotations

import re

import pytest
from wave_generators import drive, scaled

from hdopt.drive.geometry import Structure
from hdopt.errors import HdoptError
from hdopt.geometry.assembly import wave_generator_model
from hdopt.geometry.bought import Screws, bought
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.screws import LENGTHS, kind_of

MADE = {"M2": 20, "M3": 30, "M4": 40, "M5": 50, "M6": 60, "M8": 80}
"""Longest screws of ISO 4762, mm."""


@pytest.mark.parametrize("thread", [None, "M3", "M5"])
@pytest.mark.parametrize("material", [None, "EN AW-7075 T6"])
@pytest.mark.parametrize("scale", [0.8, 1.0, 1.3, 1.9576, 4.0])
def test_by_rule_a_screw_that_is_made_engages_enough(scale, material, thread):
    made = drive("ellipse", Structure.INTEGRAL)
    made = made if scale == 1.0 else scaled(made, scale)
    options = ExportOptions(hub=True, hub_material=material, bolt_thread=thread)
    if scale == 4.0 and thread == "M3":  # 36 mm of cam
        with pytest.raises(HdoptError, match="M3 x 30, engages 0 mm .* give a larger export.bolt_thread"):
            make_job(made, options, "x")
        return
    job = make_job(made, options, "x")
    (screws,) = (item for item in bought(job) if isinstance(item, Screws))
    cam, hub = job.model.part("cam"), job.model.part("hub")
    diameter = float(screws.thread[1:])
    assert screws.length in LENGTHS and screws.length <= MADE[screws.thread]
    # The tip stands out of no flange, and what is below the cam is in the thread.
    assert cam.size[2] + hub.body[0].height >= screws.length
    assert screws.length - cam.size[2] >= (2.0 if material else 1.0) * diameter - 1e-9
    assert f", {round(screws.length - cam.size[2], 1):g} mm in thread" in screws.words[0]


@pytest.mark.parametrize(
    ("options", "engaged", "needed", "thicker"),
    [
        ({"hub_flange_thickness_mm": 2.0}, 1.0, "3 mm are needed in steel or cast iron", 3.0),  # 9 mm of cam, M3 x 10
        ({"hub_flange_thickness_mm": 3.5, "hub_material": "AlMg3"}, 3.0, "6 mm are needed in aluminium", 7.0),
        ({"hub_flange_thickness_mm": 3.0, "bolt_thread": "M4"}, 3.0, "4 mm are needed in steel or cast iron", 7.0),
    ],
)
def test_a_flange_too_thin_is_refused_with_what_would_do(options, engaged, needed, thicker):
    made = drive("ellipse", Structure.INTEGRAL)
    with pytest.raises(HdoptError, match=f"engages {engaged:g} mm of thread.*{needed}") as refused:
        wave_generator_model(made, ExportOptions(**options))
    (said,) = re.findall(r"hub_flange_thickness_mm = ([\d.]+)", str(refused.value))
    assert float(said) == thicker
    wave_generator_model(made, ExportOptions(**{**options, "hub_flange_thickness_mm": thicker}))


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("EN AW-6082 T6", "aluminium"),
        ("AlMgSi1", "aluminium"),
        ("Aluminium 7075", "aluminium"),
        ("42CrMo4", "steel or cast iron"),
        ("C45", "steel or cast iron"),
        ("34CrAlNi7", "steel or cast iron"),
        (None, "steel or cast iron"),
    ],
)
def test_aluminium_is_known_by_its_name(name, kind):
    assert kind_of(name) == kind
