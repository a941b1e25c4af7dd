"""Numbers that lead to no result: the message says in which file and at which line or key to look."""

from __future__ import annotations

import numpy as np
import pytest

import hdopt
from hdopt.errors import HdoptError, NoResult, numbers_of
from hdopt.study import apply_overrides, load_study, place_of_numbers, study_document
from hdopt.workflow.placed import numbers_named, recordings_named

FAULTS = (
    ValueError("math domain error"),
    ZeroDivisionError("division by zero"),
    OverflowError(34, "Numerical result out of range"),
    np.linalg.LinAlgError("Singular matrix"),
    FloatingPointError("overflow"),
    NoResult("the solver gave up"),
)


def study_file(tmp_path, text):
    (tmp_path / "s.toml").write_text(text)
    return tmp_path / "s.toml"


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: type(fault).__name__)
@pytest.mark.parametrize("call", [lambda work, given: work(given), lambda work, given: work(study=given)])
def test_every_kind_of_fault_names_file_line_and_key(fault, call, tmp_path):
    path = study_file(tmp_path, 'drive = "csf-25-80"\n\n[load]\ntorque_nm = 12\n\n[errors]\naxis_tilt_x_deg = 1e-9\n')

    @numbers_named
    def work(study=None):
        raise fault

    with pytest.raises(NoResult, match=r"s\.toml, line 7, errors\.axis_tilt_x_deg \(1e-09, the value farthest") as said:
        call(work, path)
    assert str(fault.args[-1]) in str(said.value)


def test_a_refusal_that_says_its_own_reason_stays_as_it_is():
    with pytest.raises(HdoptError) as said, numbers_of(lambda: "s.toml"):
        raise HdoptError("n is 5, too small")
    assert str(said.value) == "n is 5, too small"


def test_a_place_is_said_once():
    with pytest.raises(NoResult) as said, numbers_of(lambda: "outer"), numbers_of(lambda: "inner"):
        raise ValueError("math domain error")
    assert str(said.value).startswith("inner: ") and "outer" not in str(said.value)


def test_recordings_are_named():
    @recordings_named
    def work(recordings):
        raise np.linalg.LinAlgError("Singular matrix")

    with pytest.raises(NoResult, match=r"a\.csv, b\.csv, c\.csv and 2 more: these numbers .*Singular matrix"):
        work([f"{name}.csv" for name in "abcde"])


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ((), "csf-25-80-tolerances.toml"),
        (("tolerances.axis_tilt_x_deg.upper=-1e3",), "--set tolerances.axis_tilt_x_deg.upper"),
        (("tolerances.axis_eccentricity_mm.cost.b=1e-14",), "--set tolerances.axis_eccentricity_mm.cost.b"),
        (("tolerances.wg_eccentricity_mm.upper=0",), "--set tolerances.wg_eccentricity_mm.upper"),
        (("allocate.verify_n=20000", "requirement.yield=1e-12"), "--set requirement.yield"),
    ],
)
def test_the_farthest_value_is_named(changes, place):
    """Against the shipped drive, against its namesakes in the study, against 1; 0 is farther than any other."""
    document, _, _ = study_document("csf-25-80-tolerances")
    changed = apply_overrides(document, changes)
    assert place_of_numbers(changed).partition(" (")[0] == place


def test_a_linear_stack_from_python_says_where(tmp_path):
    text = load_study("chase-shaft-housing").document.texts[-1]
    text = text.replace(
        "first_bearing = { sensitivity = 1, tolerance = 0.0025", "first_bearing = { sensitivity = 1, tolerance = 5e-324"
    )
    with pytest.raises(NoResult, match=r"s\.toml, line 16, .*first_bearing\.tolerance .5e-324, .*std of the normal"):
        hdopt.stack(study_file(tmp_path, text), 2048)


def test_a_message_about_a_section_gets_file_and_line(tmp_path):
    text = 'drive = "csf-25-80"\n\n[tolerances.axis_tilt_y_deg]\ndistribution = "normal"\nmean = 300\nstd = 0.05\n'
    with pytest.raises(HdoptError, match=r"s\.toml, line 3: \[tolerances\] axis_tilt_y_deg: truncation"):
        hdopt.stack(study_file(tmp_path, text + "lower = -0.2\nupper = 0.2\n"), 2048)


def test_an_example_in_a_message_is_no_value_of_the_study():
    """Would catch 'b = 0.01', shown for the reader to write, taken for the study's eccentricity of 0.01 mm."""
    with pytest.raises(HdoptError, match="^allocate needs costs"):
        hdopt.allocate("csf-25-80")


@pytest.mark.parametrize("given", ["99.73", "95"])
def test_a_share_in_per_cent_is_answered_with_the_share(given):
    with pytest.raises(HdoptError, match=rf"in per cent as it seems; it is a share: write {float(given) / 100:g}$"):
        hdopt.stack(hdopt.load_study("csf-25-80", [f"requirement.yield={given}"]))
