"""Sections of a study file, key by key: what they take, what they mean without a word, and what they say of a fault."""

import numpy as np
import pytest

from hdopt.errors import HdoptError
from hdopt.study import load_study
from hdopt.study.costs import AllocateSection, Cost
from hdopt.study.drive import ErrorsSection
from hdopt.study.schema import sections_in
from hdopt.study.tolerances import AnyRow, DimensionRow, TolerancesSection, _check_size
from hdopt.study.toml_faults import LONGEST
from hdopt.tolerance.distributions import Uniform

TILTS = [name for name in ErrorsSection.model_fields if "tilt" in name]


@pytest.fixture
def study(tmp_path):
    """The study of the CSF-25-80 with these lines besides, or what is said of it."""

    def read(text, overrides=()):
        path = tmp_path / "own.toml"
        path.write_text(f'drive = "csf-25-80"\n{text}\n', encoding="utf-8")
        return load_study(path, overrides)

    return read


@pytest.mark.parametrize("tilt", TILTS)
def test_a_tilt_goes_either_way(study, tilt):
    """Faults caught: a lower end that is 0, or missing."""
    turned = study(f"[errors]\n{tilt} = -0.02")
    assert float(getattr(turned.errors, tilt.removesuffix("_deg"))) == pytest.approx(np.radians(-0.02))
    for beyond in (-89.0, 89.0):
        with pytest.raises(HdoptError, match=tilt):
            study(f"[errors]\n{tilt} = {beyond}")


def test_what_a_section_means_without_a_word():
    """Documented defaults. Faults caught: a million samples of a verification that became a tenth of one; a dimension
    that counts twice."""
    assert AllocateSection().verify_n == 1_048_576
    assert DimensionRow(tolerance=0.1).sensitivity == 1.0
    assert DimensionRow(tolerance=0.1).sigmas == 3.0


def test_the_errors_that_vary_are_those_with_a_tolerance():
    """Fault caught: those without one."""
    row = {"distribution": "uniform", "lower": -0.01, "upper": 0.01}
    rows = TolerancesSection.model_validate({"wg_tilt_major_deg": row}).rows
    assert list(rows) == ["wg_tilt_major_deg"]
    assert rows["wg_tilt_major_deg"].upper == 0.01


def test_a_spread_that_cannot_be_computed_is_refused():
    """Nearly all drives would have more than [errors] may have; at its end they may. Faults caught: the other side of
    the comparison, one side of the distribution only."""
    _check_size("wg_eccentricity_mm", Uniform(lower=0.0, upper=0.02))
    for low, high in ((0.0, 200.0), (-200.0, 0.0)):
        with pytest.raises(HdoptError, match=r"nearly all drives \(99.73 %\) would have"):
            _check_size("wg_tilt_major_deg", Uniform(lower=low, upper=high))
    # A direction has no size.
    _check_size("axis_eccentricity_direction_deg", Uniform(lower=0.0, upper=360.0))


@pytest.mark.parametrize(("length", "hinted"), [(4 * LONGEST, True), (4 * LONGEST + 1, False)])
def test_a_long_line_is_not_looked_at_for_hints(study, length, hinted):
    """Up to 320 characters. Fault caught: a line of any length, or none, gets one."""
    line = "[errors]\nwg_tilt_major_deg = 0,01" + " #".ljust(length - len("wg_tilt_major_deg = 0,01"), "x")
    with pytest.raises(HdoptError) as said:
        study(line)
    assert ("decimal point" in str(said.value)) is hinted


KINDS_OF_ROW = [
    ("wg_eccentricity_mm", "distribution", row.model_fields["distribution"].annotation.__args__[0], row)
    for row in sections_in(AnyRow)
    if "distribution" in row.model_fields
]
KINDS_OF_COST = [
    ("wg_eccentricity_mm.cost", "model", row.model_fields["model"].annotation.__args__[0], row)
    for row in sections_in(Cost)
    if "model" in row.model_fields
]


@pytest.mark.parametrize(
    ("table", "kind_key", "kind", "row"),
    [*KINDS_OF_ROW, *KINDS_OF_COST],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_a_misspelt_key_of_a_row_is_answered_with_the_one_meant(study, table, kind_key, kind, row):
    """In a table of any kind, each of its keys with a letter too many. Faults caught: keys of a row of [tolerances] and
    of its cost, of which there are several kinds, called unknown and nothing else."""
    keys = [name for name in row.model_fields if name != kind_key]
    assert len(KINDS_OF_ROW) >= 8 and len(KINDS_OF_COST) >= 4
    for key in keys:
        given = f'{{ {kind_key} = "{kind}", {key}x = 1.0 }}'
        if table.endswith("cost"):
            given = f'{{ distribution = "normal", std = 0.003, lower = -0.01, upper = 0.01, cost = {given} }}'
        with pytest.raises(HdoptError) as refused:
            study(f"[tolerances]\nwg_eccentricity_mm = {given}")
        # One letter is like nothing: all keys follow.
        meant = f"did you mean '{key}'?" if len(key) > 1 else f"known: {', '.join(sorted(row.model_fields))}"
        assert f"unknown key '{key}x'; {meant}" in str(refused.value)


def test_so_is_one_in_a_list(study):
    """Fault caught: rows of a list, whose place in it no table has."""
    with pytest.raises(HdoptError, match=r"correlation\.0\.erors: unknown key 'erors'; did you mean 'errors'"):
        study("[[tolerances.correlation]]\nerors = []")


@pytest.mark.parametrize("key", sorted(ErrorsSection.model_fields))
def test_only_an_eccentricity_has_a_position_zone(study, key):
    """Fault caught: a tilt with a zone of 0.2 mm, taken for 0 to 0.1 deg, and the yield of that."""
    text = f'[tolerances]\n{key} = {{ distribution = "position_zone", diameter = 0.02 }}'
    if key.endswith("_eccentricity_mm"):
        assert study(text).sections["tolerances"].rows[key].diameter == 0.02
        return
    with pytest.raises(HdoptError, match=rf"{key}.distribution: is 'position_zone'; it must be one of normal, uniform"):
        study(text)


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ('callout = "paralelism", feeds = "axis_tilt", length_mm = 20', "unknown callout 'paralelism'; did you mean"),
        ('callout = "parallelism", feeds = "axis_tilt_z", length_mm = 20', "unknown error to feed 'axis_tilt_z'"),
        ('callout = "parallelism", feeds = "axis_tilt"', "parallelism needs length_mm"),
        ('callout = "coaxiality", feeds = "axis_tilt"', "coaxiality cannot feed axis_tilt"),
    ],
)
def test_a_callout_that_feeds_nothing_is_refused_with_its_line(study, row, said):
    """Fault caught: refused by a stack alone, so that an export drew the parts without it."""
    with pytest.raises(HdoptError, match=rf"line 3, contributors.bore: {said}"):
        study(f"[contributors]\nbore = {{ value_mm = 0.01, {row} }}")
