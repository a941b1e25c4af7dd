"""Standard grades: values from the standards' tables, and the flag where a standard does not reach."""

import pytest

from hdopt.allocation.grades import iso_1328_pitch, it_grade, jis_1702_pitch
from hdopt.errors import HdoptError


@pytest.mark.parametrize(
    ("grade", "nominal", "tolerance"),
    [("IT5", 62.0, 0.013), ("IT6", 62.0, 0.019), ("IT7", 50.0, 0.025), ("IT7", 50.1, 0.030), ("IT8", 3.0, 0.014)],
)
def test_it_grades(grade, nominal, tolerance):
    assert it_grade(grade, nominal).tolerance == pytest.approx(tolerance)


def test_iso_1328_class_5_by_its_formula():
    """d = 50, m = 2: 0.1 + 3.889 + 1.4 + 12 = 17.39 um; two classes coarser double it."""
    assert iso_1328_pitch(5, 50.0, 2.0).tolerance == pytest.approx(17.389e-3, rel=1e-4)
    assert iso_1328_pitch(7, 50.0, 2.0).tolerance == pytest.approx(2 * 17.389e-3, rel=1e-4)
    assert iso_1328_pitch(5, 50.0, 2.0).extrapolated == ""


def test_this_drives_module_is_below_iso_1328():
    value = iso_1328_pitch(3, 63.36, 0.396)
    assert value.extrapolated == "ISO 1328-1 holds for modules 0.5 to 70 mm, this gear has 0.396 mm"
    assert "this is 0" in iso_1328_pitch(0, 63.36, 1.0).extrapolated


def test_fine_pitch_grades_reach_this_drive():
    """JIS B 1702-1976 grade 0: 2 W + 5.6 um, W = 63.36^(1/3) + 0.65 x 0.396 = 4.244."""
    value = jis_1702_pitch(0, 63.36, 0.396)
    assert value.tolerance == pytest.approx((2 * (63.36 ** (1 / 3) + 0.2574) + 5.6) / 1000)
    assert value.extrapolated == ""
    assert jis_1702_pitch(0, 5.0, 0.1).extrapolated != ""


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: it_grade("IT99", 10.0), "unknown IT grade 'IT99'"),
        (lambda: it_grade("IT5", 600.0), "up to 500 mm"),
        (lambda: jis_1702_pitch(9, 60.0, 0.4), "its grades are 0 to 8"),
        (lambda: iso_1328_pitch(5, 0.0, 0.4), "both must be above 0"),
    ],
)
def test_bad_grades(make, message):
    with pytest.raises(HdoptError, match=message):
        make()
