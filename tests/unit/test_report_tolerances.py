"""The tolerance sections' numbers: what they show is what the results hold."""

from dataclasses import replace

import pytest

from hdopt.report import Figure, KeyFigures, Report, Table
from hdopt.report.cells import columns, in_words
from hdopt.report.html import write_report
from hdopt.report.sections.tolerances import allocate_section, sobol_section, stack_section
from hdopt.workflow.allocate import allocate
from hdopt.workflow.stack import sobol, stack


def of_kind(section, kind):
    return {getattr(item, "key", ""): item for item in section.items if isinstance(item, kind)}


@pytest.fixture(scope="module")
def sections():
    return {
        "stack": stack_section(stack(n=2**13, worst_case=True, tail=2.0)),
        "sobol": sobol_section(sobol(n=2**9, shapley="groups")),
        "allocate": allocate_section(allocate("chase-shaft-housing", curve=(0.9, 1.0, 1.2))),
    }


def test_names_in_words():
    assert in_words("wg_tilt_major_deg") == "WG tilt major"
    assert in_words("bore") == "Bore"


def test_stack_shows_its_yield_and_every_contribution(sections):
    result = stack(n=2**13, worst_case=True, tail=2.0)
    values = of_kind(sections["stack"], KeyFigures)[""].values
    assert values["Yield"].startswith(f"{100 * result.stack.conforming.value:.3f} %")
    assert values["P(above 2 arcmin)"].startswith("0 (0 to 0)")
    shares = of_kind(sections["stack"], Table)["stack-contributions-table"].frame
    assert shares["share"].sum() == pytest.approx(1)
    assert "do not keep" in sections["stack"].summary
    bars = of_kind(sections["stack"], Figure)["stack-distribution"].figure.data[0]
    assert sum(bars.y * bars.width) == pytest.approx(1)


def test_the_page_says_names_in_words_and_the_file_the_keys(sections):
    """And no more than four digits on the page, all of them in the file."""
    table = of_kind(sections["stack"], Table)["stack-contributions-table"]
    assert "wg_tilt_major_deg" in set(table.frame["input"])
    (names, *_) = columns(table.frame, table.formats)
    assert "WG tilt major" in names.cells and not any("_" in cell for cell in names.cells)
    assert "little or no share of its own" in table.caption
    for key in ("sobol-table", "sobol-shapley-table"):
        table = of_kind(sections["sobol"], Table)[key]
        assert not any("_" in cell for cell in columns(table.frame, table.formats)[0].cells), key
    figures = of_kind(sections["stack"], Table)["stack-figures"]
    shown = next(column for column in columns(figures.frame, figures.formats) if column.name == "value")
    assert all(len(cell.replace(".", "").lstrip("0")) <= 5 for cell in shown.cells)
    assert not any("e" in cell for cell in shown.cells)


def test_a_stack_without_directions_says_nothing_of_them():
    section = stack_section(stack("chase-shaft-housing", n=2**12))
    assert of_kind(section, Table)["stack-contributions-table"].caption == ""


def test_the_log_axis_has_the_points_that_were_computed(sections):
    axis = of_kind(sections["sobol"], Figure)["sobol-convergence"].figure.layout.xaxis
    points = of_kind(sections["sobol"], Figure)["sobol-convergence"].figure.data[1].x
    assert axis.type == "log"
    assert set(axis.tickvals) <= set(points)
    assert list(axis.ticktext) == [f"{value:.0f}" for value in axis.tickvals]
    assert len(axis.tickvals) >= 2


def test_sobol_shows_indices_pairs_and_shapley(sections):
    assert set(of_kind(sections["sobol"], Figure)) == {
        "sobol-indices",
        "sobol-convergence",
        "sobol-pairs",
        "sobol-shapley",
    }


def test_allocation_shows_the_rules(sections):
    rules = of_kind(sections["allocate"], Table)["allocate-rules"].frame
    assert rules["rule"].tolist() == ["present", "worst_case", "rss"]
    assert rules["cost"].tolist() == pytest.approx([9.3359, 11.07783, 8.053611], abs=5e-5)


def test_an_allocation_that_verification_misses_is_not_said_to_meet_the_requirement():
    """Fault caught: 'meets the requirement' over a status that says it does not, and a present cost of 'nan'."""
    found = replace(allocate("chase-shaft-housing", compare=False), present_cost=float("nan"))
    assert "rule meets the requirement at a cost of" in allocate_section(found).summary
    missed = allocate_section(replace(found, status="not verified"))
    assert "meets the requirement" not in missed.summary
    assert f"only {100 * found.verified_yield.value:.3f} % are verified" in missed.summary
    (figures,) = (item for item in missed.items if isinstance(item, KeyFigures))
    assert "now: not known" in str(figures) and "nan" not in str(figures)


def test_the_page_is_written(sections, tmp_path):
    page = write_report(Report("Tolerances", "", tuple(sections.values())), tmp_path)
    assert page.is_file()
    assert (tmp_path / "allocate-rules.csv").is_file()
