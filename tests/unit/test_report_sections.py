"""The sections' numbers: what a figure shows is what the builder was given."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hdopt.optimize.objectives import NOMINAL
from hdopt.optimize.problem import Limit as optimize_limit
from hdopt.report import Figure, KeyFigures, Section, Table, theme
from hdopt.report.numbers import figure_frame
from hdopt.report.sections import search
from hdopt.report.sections.design_map import Design, Limit, pressure_angle_width_section
from hdopt.report.sections.lag import lag_section
from hdopt.report.sections.orders import spectrum_section
from hdopt.report.sections.profiles import profiles_section
from hdopt.report.sections.published import published_section
from hdopt.report.sections.structures import structures_section
from hdopt.report.sections.tornado import sensitivities_section
from hdopt.report.sections.waveform import waveform_section
from hdopt.report.sections.words import in_sentence, label
from hdopt.words import listed


def item(section: Section, key: str) -> Figure | Table:
    return next(i for i in section.items if getattr(i, "key", None) == key)


def key_figures(section: Section) -> dict[str, str]:
    return dict(next(i for i in section.items if isinstance(i, KeyFigures)).values)


def test_the_beat_is_measured_turn_by_turn():
    theta = np.linspace(0, 2 * np.pi * 80, 80 * 360 + 1)
    size = 1 + 0.5 * np.cos(theta / 80)  # 1.5 at the start and end, 0.5 half way
    section = waveform_section(theta, size * np.sin(2 * theta))
    values = key_figures(section)
    assert values["Largest in one turn"] == "3.000 arcmin"
    # A turn holds two cycles and the larger counts: 315 deg past the waist the size is 0.5 (2 - cos 0.0687) = 0.5012.
    assert values["Smallest in one turn"] == "1.002 arcmin"
    assert values["Peak-to-peak, converged"] == "3.000 arcmin"
    carpet = item(section, "waveform-carpet").figure.data[0]
    assert np.shape(carpet.z) == (80, 181)
    assert np.allclose(np.asarray(carpet.z)[40], size[40 * 360] * np.sin(2 * np.radians(carpet.x)), atol=0.01)


def test_the_converged_value_given_is_the_one_shown():
    theta = np.linspace(0, 4 * np.pi, 721)
    section = waveform_section(theta, np.sin(theta), peak_to_peak_arcmin=2.125, requirement_arcmin=1.0)
    assert key_figures(section)["Peak-to-peak, converged"] == "2.125 arcmin"
    assert key_figures(section)["Required"] == "1.000 arcmin"
    assert "2.125" in section.summary


def test_orders_are_ranked_and_one_record_too_short_says_so():
    orders, amplitudes = np.array([1.0, 2.0, 2.0125]), np.array([0.1, 0.3, 0.2])
    interference = pd.DataFrame({"order": [2.0], "neighbour": [2.0125]})
    section = spectrum_section(
        orders, amplitudes, ["1", "2", "2 + 1/N"], ["a", "b", "a"], 80, interference=interference
    )
    assert item(section, "orders-table").frame["order"].tolist() == [2.0, 2.0125, 1.0]
    assert item(section, "orders-interference").frame.equals(interference)
    tops = figure_frame(item(section, "orders-stems").figure)
    assert sorted(tops.loc[tops["x"] == 2.0125, "y"].unique()) == [0.2]
    quiet = spectrum_section(orders, amplitudes, ["1", "2", "2 + 1/N"], ["a", "b", "a"], 80)
    assert len(quiet.items) == 2


def test_structures_name_the_best_and_the_worst():
    frame = pd.DataFrame({"structure": ["integral", "one_way_major"], "peak_to_peak_arcmin": [1.369, 1.06]})
    section = structures_section(frame)
    assert section.summary.startswith("One-way, major axis gives the smallest kinematic error, 1.060 arcmin")
    (bars,) = item(section, "structures-bars").figure.data
    assert list(bars.y) == [1.369, 1.06]


def test_the_map_marks_the_design_and_the_requirement_only_where_it_lies_on_it():
    angle, width = np.array([8.0, 12.0, 16.0]), np.array([5.0, 9.0])
    values = angle[:, None] * width / 100
    for requirement, lines in ((1.0, 1), (9.0, 0)):
        section = pressure_angle_width_section(
            angle, width, values, Design("mine", 9.0, 12.0), requirement_arcmin=requirement
        )
        figure = item(section, "design-map-figure").figure
        assert sum((trace.name or "").startswith("required") for trace in figure.data) == lines
        assert figure.data[-1].x == (9.0,)
        assert figure.data[-1].y == (12.0,)
        assert np.array_equal(figure.data[0].z, values)


@pytest.mark.parametrize("at_least", [False, True])
def test_a_map_shades_the_broken_side_of_every_limit_and_names_those_without_a_line(at_least):
    angle, width = np.array([8.0, 12.0, 16.0]), np.array([5.0, 9.0])
    values = angle[:, None] * width / 100
    crossing = [Limit(f"crossing {i}", values, 0.5 + 0.1 * i, at_least) for i in range(5)]
    kept = Limit("kept", values, 0.1 if at_least else 9.0, at_least)
    lost = Limit("lost", values, 9.0 if at_least else 0.1, at_least)
    limits = [*crossing, kept, lost]
    section = pressure_angle_width_section(angle, width, values, Design("mine", 9.0, 12.0), limits=limits)
    shown = item(section, "design-map-figure")
    drawn = [trace for trace in shown.figure.data if trace.showlegend and trace.type == "contour"]
    assert [trace.name for trace in drawn] == [*(limit.name for limit in crossing), "lost"]
    # Plotly shades where the constraint does not hold.
    assert {trace.contours.operation for trace in drawn} == {">=" if at_least else "<="}
    assert [trace.contours.value for trace in drawn[:5]] == [limit.limit for limit in crossing]
    assert len({trace.line.color for trace in drawn}) == 6
    assert "The shaded side of a line breaks its limit." in shown.caption
    assert "Kept all over this map, so without a line: kept." in shown.caption
    assert "Broken all over this map: lost." in shown.caption


def test_the_tornado_puts_the_strongest_on_top_and_bars_end_at_the_values():
    frame = pd.DataFrame(
        {
            "variable": ["weak", "strong"],
            "low": ["1 mm", "2 mm"],
            "high": ["3 mm", "4 mm"],
            "low_arcmin": [0.95, 0.5],
            "high_arcmin": [1.02, 1.3],
        }
    )
    section = sensitivities_section(frame, 1.0)
    assert item(section, "sensitivities-table").frame["variable"].tolist() == ["strong", "weak"]
    bars = [trace for trace in item(section, "sensitivities-tornado").figure.data if trace.type == "bar"]
    assert [list(bar.y) for bar in bars] == [["weak", "strong"]] * 2  # Plotly draws the first at the bottom
    assert np.allclose([np.add(bar.base, bar.x) for bar in bars], [[0.95, 0.5], [1.02, 1.3]])


def test_lag_below_zero_is_interference_and_said():
    theta = np.linspace(0, 2 * np.pi, 361)
    free = lag_section(theta, 1 + 0.1 * np.sin(theta), {"backlash": 1 + 0.1 * np.sin(theta)}, 0.0)
    assert "interfere" not in free.summary
    tight = lag_section(theta, np.sin(theta) - 1e-9, {"backlash": np.sin(theta)}, 0.5)
    assert "over 50 % of the angles the flanks interfere" in tight.summary
    assert key_figures(tight)["Smallest"] == "-1.000 arcmin"


def test_lag_of_several_turns_is_the_first_within_the_band_of_all():
    theta = np.arange(3 * 360) * (2 * np.pi / 360)
    values = np.sin(theta) + np.floor(theta / (2 * np.pi) + 1e-9)
    section = lag_section(theta, values, {"Tooth backlash": values}, 0.0)
    lowest, highest, first = item(section, "lag-turn").figure.data
    assert np.allclose(lowest.y, np.sin(theta[:360]))
    assert np.allclose(highest.y, np.sin(theta[:360]) + 2)
    assert np.allclose(first.y[:360], lowest.y)
    assert key_figures(section)["Largest"] == "3.000 arcmin"


def test_published_values_are_counted_against_the_tolerance():
    frame = pd.DataFrame(
        {
            "case": ["a", "b", "c"],
            "published_arcmin": [1.0, 1.0, 1.0],
            "sampled_arcmin": [1.005, 0.97, 1.019],
            "converged_arcmin": [1.05, 1.0, np.nan],
        }
    )
    section = published_section(frame, source="A source", tolerance_arcmin=0.02)
    assert section.summary.startswith("2 of 3 values of A source")
    assert "−0.0300 arcmin, is at b" in section.summary
    assert np.allclose(item(section, "published-table").frame["difference_arcmin"], [0.005, -0.03, 0.019])


def test_profiles_are_compared_with_the_first():
    phi = np.linspace(0, 2 * np.pi, 361)
    deflection = {"ellipse": 0.4 * np.cos(2 * phi), "resal": 0.5 * np.cos(2 * phi)}
    change = {"ellipse": 0.001 * np.cos(2 * phi), "resal": 0.002 * np.cos(2 * phi)}
    section = profiles_section(phi, deflection, change, 30.0, pd.DataFrame({"profile": ["ellipse", "resal"]}))
    assert section.summary.startswith(
        "Ellipse: the curvature changes by 1.00\u00a0×\u00a010⁻³/mm at most, least of all. Resal: 2.00"
    )
    (difference,) = item(section, "profiles-difference").figure.data
    assert max(difference.y) == pytest.approx(100.0)
    alone = profiles_section(
        phi, {"resal": deflection["resal"]}, {"resal": change["resal"]}, 30.0, pd.DataFrame({"profile": ["resal"]})
    )
    assert not any(getattr(i, "key", "") == "profiles-difference" for i in alone.items)


def test_words():
    assert label("one_way_minor") == "One-way, minor axis"
    assert label("resal") == "Resal"
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert [in_sentence(name) for name in ("Pressure angle", "WG tilt", "CS teeth")] == [
        "pressure angle",
        "WG tilt",
        "CS teeth",
    ]


def test_a_full_turn_whose_end_is_left_out_counts_whole():
    theta = np.arange(80 * 90) * (2 * np.pi / 90)
    section = waveform_section(theta, np.sin(theta))
    carpet = np.asarray(item(section, "waveform-carpet").figure.data[0].z)
    assert carpet.shape == (80, 181)
    assert np.allclose(carpet[-1], carpet[0], atol=1e-3)  # linear interpolation between points 4 deg apart


def some_designs(count: int, first: float = 0.0) -> list[SimpleNamespace]:
    return [SimpleNamespace(quantities={NOMINAL: first + i, "flank_pressure_mpa": 9.0 - i}) for i in range(count)]


def test_a_front_draws_the_combinations_nearest_to_it_and_says_how_many_are_left_out():
    curves = {f"combination {i}": some_designs(3, first=float(9 - i)) for i in range(9)}
    front = SimpleNamespace(objective=NOMINAL, second="flank_pressure_mpa", by_combination=curves)
    drawn = search._nearest(front)
    assert [designs[0].quantities[NOMINAL] for designs in drawn] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert "Of 9 combinations the 6 with the least error have a curve" in search._left_out(front)
    few = SimpleNamespace(objective=NOMINAL, second="flank_pressure_mpa", by_combination={"one": some_designs(3)})
    assert search._left_out(few) == ""


@pytest.mark.parametrize("count", [3, 60, 61, 500])
def test_parallel_coordinates_are_thinned_evenly_and_keep_both_ends(count):
    designs = some_designs(count)
    kept = [design.quantities[NOMINAL] for design in search._thinned(designs[::-1], NOMINAL)]
    assert len(kept) == min(count, search.LINES)
    assert (kept[0], kept[-1]) == (0, count - 1)
    assert len(set(kept)) == len(kept)
    steps = np.diff(kept)
    assert steps.max() - steps.min() <= 1


@pytest.mark.parametrize("at_least", [False, True])
def test_a_front_shades_the_side_on_which_its_limit_is_broken(at_least):
    """A limit drawn on the wrong side would send a designer into the forbidden half."""
    designs = some_designs(5)
    front = SimpleNamespace(
        objective=NOMINAL, second="flank_pressure_mpa", designs=designs, by_combination={"one": designs}
    )
    limit = optimize_limit("flank_pressure_mpa", 7.5, at_least)
    result = SimpleNamespace(setup=SimpleNamespace(limits=lambda: (limit,)), baseline=designs[0], best=designs[1])
    made = theme.figure("x", "y")
    assert search._shade_limits(made, result, front) == " Shaded is where it is broken."
    shade = next(shape for shape in made.layout.shapes if shape.type == "rect")
    assert (shade.x0 < 7.5, shade.x1 > 7.5) == (at_least, not at_least)
    assert 7.5 in (shade.x0, shade.x1)


def test_structures_are_said_in_words_on_the_page_of_a_trade():
    """Would catch the keys of a study file in a sentence for people."""
    from hdopt.report.sections.search import _in_words

    says = _in_words("0.0015 arcmin beside one_way_major, 0.056 arcmin beside integral")
    assert says == "0.0015 arcmin beside one-way on the major axis, 0.056 arcmin beside integral"
    asked = _in_words("what one_way_minor loses: search.trade.structure_cost_percent, such as { one_way_minor = 2.0 }")
    assert asked.startswith("what one-way on the minor axis loses: `search.") and "`{ one_way_minor = 2.0 }`" in asked


def test_lines_of_designs_are_thinned_evenly_with_both_ends():
    """Would catch a front drawn whole, which nobody can read, and one without its best design."""
    from hdopt.report.sections.search import LINES, _thinned

    designs = [SimpleNamespace(quantities={"peak_to_peak_arcmin": float(i)}) for i in range(378)]
    drawn = [d.quantities["peak_to_peak_arcmin"] for d in _thinned(designs[::-1], "peak_to_peak_arcmin")]
    assert len(drawn) == LINES == 30 and drawn[0] == 0 and drawn[-1] == 377
    steps = np.diff(drawn)
    assert max(steps) - min(steps) <= 1
    assert len(_thinned(designs[:5], "peak_to_peak_arcmin")) == 5


@pytest.mark.parametrize(("deviation", "words"), [(3.8e-10, "<0.001 µm"), (0.0312, "≤0.031 µm"), (1e-3, "≤0.001 µm")])
def test_a_profile_in_a_file_is_not_said_to_a_thousandth_of_an_atom(deviation, words):
    from hdopt.report.sections.geometry import deviation_words

    assert deviation_words(deviation) == words
