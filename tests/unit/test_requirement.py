"""What a requirement is held against: one drive, a stack, the best design of a search, a run."""

from types import SimpleNamespace

import pytest

from hdopt.study.tolerances import RequirementSection
from hdopt.workflow.requirement import of_kinematic_error, of_run, of_search, of_stack


def study(**keys):
    section = RequirementSection(peak_to_peak_arcmin=1.2, **{"yield": 0.97}, **keys)
    return SimpleNamespace(find=lambda *_: section, section=lambda *_: SimpleNamespace(quantile=0.97), sections={})


def pair(verdict):
    return None if verdict is None else (verdict.value, verdict.limit, verdict.at_least)


@pytest.mark.parametrize(("whose", "value"), [("single_tooth", 1.4), ("contact", 0.9)])
def test_one_drive_by_the_error_that_the_requirement_speaks_of(whose, value):
    result = SimpleNamespace(peak_to_peak_arcmin=1.4, nonuniform_arcmin=0.9)
    assert pair(of_kinematic_error(study(homogenization=whose), result)) == (value, 1.2, False)
    result.nonuniform_arcmin = None  # k_e is not known
    assert pair(of_kinematic_error(study(homogenization=whose), result)) == (1.4, 1.2, False)


def test_a_stack_by_its_yield_against_the_one_required():
    found = SimpleNamespace(conforming=SimpleNamespace(value=0.95), required_yield=0.97)
    verdict = of_stack(SimpleNamespace(stack=found))
    assert (pair(verdict), verdict.met, verdict.margin) == ((0.95, 0.97, True), False, pytest.approx(-0.02))


@pytest.mark.parametrize(("value", "by"), [(0.0, "97 % short"), (0.87, "10 % short"), (0.9675, "0.25 % short")])
def test_what_is_short_is_said_in_plain_digits(value, by):
    found = SimpleNamespace(conforming=SimpleNamespace(value=value), required_yield=0.97)
    assert of_stack(SimpleNamespace(stack=found)).line.endswith(by)


@pytest.mark.parametrize(
    ("objective", "share", "whose", "value"),
    [
        ("peak_to_peak_arcmin", 0.5, "single_tooth", 1.1),
        ("peak_to_peak_quantile_arcmin", 0.97, "single_tooth", 1.3),
        ("peak_to_peak_quantile_arcmin", 0.9, "single_tooth", None),  # of another share of drives
        ("peak_to_peak_quantile_arcmin", 0.97, "contact", None),  # of another error
    ],
)
def test_a_search_by_what_the_requirement_asks_for_and_nothing_else(objective, share, whose, value):
    result = SimpleNamespace(
        feasible=True,
        objective=objective,
        setup=SimpleNamespace(settings=SimpleNamespace(quantile=share)),
        best=SimpleNamespace(quantities={"peak_to_peak_arcmin": 1.1, "peak_to_peak_quantile_arcmin": 1.3}),
    )
    assert pair(of_search(study(homogenization=whose), result)) == (None if value is None else (value, 1.2, False))


def test_a_design_that_breaks_the_searchs_limits_meets_no_requirement():
    """'requirement met: ..., best design' stood under 'no design meets all limits'."""
    result = SimpleNamespace(
        feasible=False,
        objective="peak_to_peak_arcmin",
        setup=SimpleNamespace(settings=SimpleNamespace(quantile=0.97)),
        best=SimpleNamespace(quantities={"peak_to_peak_arcmin": 1.1}),
    )
    assert of_search(study(), result) is None
    result.feasible = True
    assert of_search(study(), result).met
    assert of_run(study(), {"search": {**SEARCH, "feasible": False}}) is None


STACK = {"required_yield": 0.97, "yield": {"value": 0.99, "low": 0.98, "high": 1.0}}
WAVEFORM = {"peak_to_peak_arcmin": 1.15}
SEARCH = {"objective": "peak_to_peak_arcmin", "best": {"quantities": {"peak_to_peak_arcmin": 1.1}}}


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        ({"stack": STACK, "waveform": WAVEFORM, "search": SEARCH}, (0.99, 0.97, True)),
        ({"waveform": WAVEFORM, "search": SEARCH}, (1.15, 1.2, False)),
        ({"search": SEARCH}, (1.1, 1.2, False)),
        ({}, None),
    ],
)
def test_a_run_by_its_stack_before_its_drive_before_its_search(found, expected):
    assert pair(of_run(study(), found)) == expected
