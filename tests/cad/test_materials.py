"""Materials and numbers that the study gives: on the sheets, in the parts list and as product data."""

from __future__ import annotations

import pytest
from wave_generators import drive

from hdopt.drive.geometry import Structure
from hdopt.geometry.formats import FORMATS
from hdopt.geometry.job import make_job
from hdopt.geometry.materials import mass, material
from hdopt.geometry.options import RULES, ExportOptions
from hdopt.geometry.part21 import Part21
from hdopt.geometry.part_sheets import product_data, sheets

GIVEN = ExportOptions(
    step_schema="AP242",
    part_number="HD-25",
    cam_material="16MnCr5, case-hardened",
    hub_material="EN AW-7075",
    hub_density_g_cm3=2.81,
)


def test_given_materials_and_numbers_take_the_place_of_the_assumed():
    job = make_job(drive(), GIVEN, "x")
    hub, cam = job.model.part("hub"), job.model.part("cam")
    assert mass(hub, GIVEN) == pytest.approx(2.81e-6 * hub.volume)
    assert mass(cam, GIVEN) == pytest.approx(7.85e-6 * cam.volume)
    assert material(hub, GIVEN).label == "material: EN AW-7075"
    assert material(hub, ExportOptions()).label.startswith("material (assumed): 42CrMo4")
    products = product_data(job)
    assert [product.number for product in products.values()] == ["HD-25-00", "HD-25-01", "HD-25-02"]
    assert products["cam"].material == "16MnCr5, case-hardened" and not products["cam"].assumed


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({}, "hardness (assumed): 58-62 HRC"),
        ({"cam_material": "EN AW-7075"}, "hardness: none is named with this material"),
        ({"cam_material": "16MnCr5", "cam_hardness": "60 HRC, 0.8 deep"}, "hardness: 60 HRC, 0.8 deep"),
        ({"cam_hardness": "62-64 HRC"}, "hardness: 62-64 HRC"),
    ],
)
def test_hardness_follows_the_material(options, line):
    """A sheet that asks for aluminium of 58 HRC cannot be made."""
    given = ExportOptions(**options)
    job = make_job(drive(), given, "x")
    cam = next(sheet for sheet in sheets(job) if sheet.title.startswith("cam"))
    said = [label.content for label in cam.labels]
    assert line in said
    assert [text for text in said if "HRC" in text] == ([line] if "HRC" in line else [])


@pytest.mark.parametrize(("profile", "structure"), [("two_disk", Structure.AUTOMATIC), ("ellipse", Structure.INTEGRAL)])
def test_every_part_that_is_made_has_a_material(profile, structure):
    options = ExportOptions(cam_material="A", hub_material="B", input_disc_material="C", floating_disc_material="D")
    job = make_job(drive(profile, structure), options, "x")
    named = {part.name: material(part, options).name for part in job.model.parts}
    expected = {"cam": "A", "disc_1": "A", "disc_2": "A", "hub": "B", "eccentric_hub": "B"}
    assert named == {name: (expected | {"input_disc": "C", "floating_disc": "D"})[name] for name in named}


@pytest.mark.slow
def test_product_data_of_the_step_file_name_them(tmp_path):
    job = make_job(drive(), GIVEN, "x")
    FORMATS["step"].write(tmp_path / "wave.step", job)
    text = (tmp_path / "wave.step").read_text(encoding="latin-1")
    products = Part21.of(text).products()
    assert ("HD-25-01", "hub", "EN AW-7075") in products and ("HD-25-02", "cam", "16MnCr5, case-hardened") in products
    assert "POSITIVE_RATIO_MEASURE(2.81)" in text and "named by the study" in text
    assert "assumed" not in text


def test_rules_say_what_holds_without_them():
    keys = [key for key in vars(GIVEN) if key.endswith(("_material", "_hardness", "_density_g_cm3"))]
    assert len(keys) == 12 and all(key in RULES for key in [*keys, "part_number"])
