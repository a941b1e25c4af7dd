"""Every figure of a result stands where its name says: in JSON, tables, lines, on the page; no two are alike."""

from __future__ import annotations

import re

import numpy as np
import pytest

from hdopt.cli import stack as stack_command
from hdopt.report import Figure, KeyFigures, Section
from hdopt.report.cells import UNITS, heading, significant
from hdopt.report.sections.lag import lag_section
from hdopt.report.sections.orders import spectrum_section
from hdopt.report.sections.tolerances import sobol_section, stack_section
from hdopt.report.sections.waveform import waveform_section
from hdopt.tolerance.intervals import IntervalEstimate
from hdopt.tolerance.linearise import Linearisation
from hdopt.tolerance.results import SobolResult, StackResult
from hdopt.tolerance.sensitivity import Convergence, Index, Sobol
from hdopt.tolerance.stack import Stack
from hdopt.tolerance.tail import Tail
from hdopt.tolerance.worst_case import WorstCase


def estimate(value: float, low: float, high: float, said: str = "t") -> IntervalEstimate:
    return IntervalEstimate(value, low, high, said)


LINE = Linearisation({"a": 0.11}, 0.81, {"a": 2.5}, {"a": 0.04}, 0.12, 0.05, {"a": 0.7, "b": 0.3})
STACK = Stack(
    n=4096,
    sampling="16 x points",
    path="general",
    seed=7,
    unit="mm",
    limit=1.5,
    required_yield=0.97,
    mean=estimate(0.91, 0.90, 0.93, "mean's"),
    std=estimate(0.21, 0.20, 0.23),
    quantiles={0.5: estimate(0.88, 0.86, 0.89), 0.97: estimate(1.41, 1.38, 1.46, "quantile's")},
    conforming=estimate(0.98, 0.9612, 0.9934, "yield's"),
    ppk=estimate(1.11, 1.02, 1.23, "Ppk's"),
    linearisation=LINE,
    rss=1.33,
    histogram=(np.array([0.0, 1.0, 1.5, 3.0]), np.array([1.0, 6.0, 3.0])),
    notes=("a note",),
)
RESULT = StackResult(
    "study",
    STACK,
    WorstCase(2.61, {"a": 1.0}, 2.72, 99),
    Tail(2.2, 3.1e-5, 2.9e-5, 3.6e-5, "subset simulation", 77, "said"),
)


def key_figures(section: Section) -> dict[str, str]:
    return dict(next(one for one in section.items if isinstance(one, KeyFigures)).values)


def drawn(section: Section, key: str):
    return next(one for one in section.items if isinstance(one, Figure) and one.key == key).figure


def ends(value: float, low: float, high: float) -> dict[str, float]:
    return {"value": value, "low": low, "high": high}


def test_json_of_a_stack():
    found = RESULT.to_dict()
    plain = {
        "n": 4096,
        "seed": 7,
        "path": "general",
        "limit_mm": 1.5,
        "required_yield": 0.97,
        "mean_mm": 0.91,
        "std_mm": 0.21,
        "ppk": 1.11,
        "rss_mm": 1.33,
        "contributions": {"a": 0.7, "b": 0.3},
        "yield": ends(0.98, 0.9612, 0.9934),
        "quantiles": {"0.5": ends(0.88, 0.86, 0.89), "0.97": ends(1.41, 1.38, 1.46)},
    }
    assert {name: found[name] for name in plain} == plain
    assert found["ppm"] == pytest.approx(20_000)
    intervals = found["intervals"]
    assert intervals["mean_mm"] == ends(0.91, 0.90, 0.93)
    assert intervals["std_mm"] == ends(0.21, 0.20, 0.23)
    assert intervals["ppk"] == ends(1.11, 1.02, 1.23)
    assert intervals["ppm"] == pytest.approx(ends(20_000, 6600, 38_800))
    kinds = {name: found["interval"][name] for name in ("mean", "quantiles", "yield", "ppk")}
    assert kinds == {"mean": "mean's", "quantiles": "quantile's", "yield": "yield's", "ppk": "Ppk's"}
    line = found["linearisation"]
    assert (line["operating_point"], line["slopes"]) == ({"a": 0.11}, {"a": 2.5})
    numbers = {name: line[name] for name in ("mean_mm", "std_mm", "mean_error_mm", "std_error_mm", "rss_error_mm")}
    assert list(numbers.values()) == pytest.approx([0.81, 0.13, 0.81 - 0.91, 0.13 - 0.21, 1.33 - 1.41])
    assert found["worst_case_mm"]["value"] == 2.61 and found["worst_case_mm"]["bound"] == 2.72
    tail = {name: found["tail"][name] for name in ("limit", "probability", "low", "high", "evaluations")}
    assert list(tail.values()) == [2.2, 3.1e-5, 2.9e-5, 3.6e-5, 77]


def test_tables_of_a_stack():
    rows = STACK.to_frame()[["value", "low", "high"]]
    wanted = {
        "mean, mm": (0.91, 0.90, 0.93),
        "standard deviation, mm": (0.21, 0.20, 0.23),
        "quantile 0.5, mm": (0.88, 0.86, 0.89),
        "quantile 0.97, mm": (1.41, 1.38, 1.46),
        "yield": (0.98, 0.9612, 0.9934),
        "ppm beyond the limit": (20_000, 6600, 38_800),
        "Ppk": (1.11, 1.02, 1.23),
    }
    assert list(rows.index) == list(wanted)
    for name, values in wanted.items():
        assert rows.loc[name].tolist() == pytest.approx(values), name
    tables = RESULT.tables()
    assert tables["worst case"].iloc[0].tolist() == [2.61, 2.72, "mm"]
    assert tables["tail"].iloc[0].tolist() == [2.2, "mm", 3.1e-5, 2.9e-5, 3.6e-5, "subset simulation"]


def test_lines_of_a_stack():
    """Numbers of a line by its first words, in the order in which they stand."""
    lines = {re.split(r"\s{2,}", line.strip())[0]: line for line in stack_command._lines(RESULT)}
    wanted = {
        "mean": (0.91, 0.90, 0.93),
        "standard deviation": (0.21, 0.20, 0.23),
        "quantile 0.97": (1.41, 1.38, 1.46),
        "yield (required 0.97)": (0.98, 0.9612, 0.9934),
        "beyond the limit": (20_000, 6600, 38_800),
        "Ppk, (U - X50)/(X99.865 - X50)": (1.11, 1.02, 1.23),
        "root sum square, same quantile": (1.33, 1.33 - 1.41),
        "worst case found": (2.61, 2.72),
        "a": (70.0,),
    }
    for name, values in wanted.items():
        text = lines[name].strip().removeprefix(name)
        assert [float(x) for x in re.findall(r"[-+]?\d+\.?\d*", text)] == pytest.approx(values), name
    assert "P(above 2.2 mm) = 3.1e-05 (2.9e-05 to 3.6e-05), subset simulation" in lines


def test_key_figures_of_a_stack():
    assert key_figures(stack_section(RESULT)) == {
        "Yield": "98.000 % (96.120 to 99.340)",
        "Required": "97.00 % within 1.5 mm",
        "Quantile 0.97": "1.41 mm (1.38 to 1.46)",
        "Beyond the limit": "20000 ppm (6600 to 38800)",
        "Ppk": "1.110 (1.020 to 1.230)",
        "Worst case found": "2.61 mm, proven below 2.72",
        "P(above 2.2 mm)": "3.1e-05 (2.9e-05 to 3.6e-05)",
    }


@pytest.mark.parametrize(("low", "said"), [(0.9612, "do not keep"), (0.97, "assemblies keep")])
def test_assemblies_keep_the_requirement_where_their_lower_bound_does(low, said):
    from dataclasses import replace

    stack = replace(STACK, conforming=estimate(0.98, low, 0.9934))
    assert said in stack_section(StackResult("study", stack)).summary


def test_a_distribution_is_a_density_with_its_limit_and_its_quantile():
    bars, *lines = drawn(stack_section(RESULT), "stack-distribution").data
    assert list(bars.y) == pytest.approx([0.1 / 1.0, 0.6 / 0.5, 0.3 / 1.5])
    assert [line.x[0] for line in lines] == [1.5, 1.41, 1.33]


def sobol() -> Sobol:
    def index(value: float) -> Index:
        return Index(estimate(value, value - 0.02, value + 0.05), estimate(value + 0.1, value + 0.07, value + 0.14))

    points = (64, 128)
    return Sobol(
        512,
        2048,
        7,
        "mm",
        0.9,
        0.2,
        {"a": index(0.3), "b": index(0.5)},
        {"both": index(0.6)},
        {("a", "b"): estimate(0.07, 0.05, 0.1)},
        Convergence(points, *[{"a": (0.3, 0.31), "b": (0.5, 0.51)} for _ in range(4)]),
        "95 %",
        "SALib",
    )


def test_indices_have_their_own_whiskers_and_pairs_two_places():
    section = sobol_section(SobolResult("study", sobol()))
    total, first = drawn(section, "sobol-indices").data
    assert list(first.x) == pytest.approx([0.6, 0.5, 0.3]) and list(total.x) == pytest.approx([0.7, 0.6, 0.4])
    for bars, below, above in ((first, 0.02, 0.05), (total, 0.03, 0.04)):
        assert list(bars.error_x.array) == pytest.approx([above] * 3)
        assert list(bars.error_x.arrayminus) == pytest.approx([below] * 3)
    grid = np.asarray(drawn(section, "sobol-pairs").data[0].z, float)
    assert (grid[0, 1], grid[1, 0]) == (0.07, 0.07) and np.isnan(np.diag(grid)).all()


def test_lag_by_its_three_figures():
    values = np.array([0.2, 0.4, 0.9])
    assert key_figures(lag_section(np.array([0.0, 1.0, 2.0]), values, {}, 0.0)) == {
        "Mean lag": "0.500 arcmin",
        "Smallest": "0.200 arcmin",
        "Largest": "0.900 arcmin",
    }


def test_turns_are_measured_each_by_itself():
    """Turns of 2 arcmin whose level wanders by 1.5: no turn has what the record has."""
    theta = np.linspace(0, 2 * np.pi * 4, 4 * 360 + 1)
    level = np.floor(theta / (2 * np.pi) - 1e-9) * 0.5
    values = key_figures(waveform_section(theta, np.sin(2 * theta) + level))
    assert values["Peak-to-peak, converged"] == "3.500 arcmin"
    assert float(values["Largest in one turn"].split()[0]) < 2.6


def test_orders_are_ranked_by_their_amplitude():
    section = spectrum_section(np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.3, 0.2]), "abc", "xyz", 80.0)
    table = next(one for one in section.items if getattr(one, "key", "") == "orders-table")
    assert table.frame["written"].tolist() == ["b", "c", "a"]
    assert "b (0.300 arcmin), c (0.200 arcmin) and a (0.100 arcmin)" in section.summary


def test_units_are_written_as_they_are_called():
    named = {"_mpa": "MPa", "_nm": "N m", "_rpm": "r/min", "_um": "µm", "_mm": "mm", "_per_mm": "1/mm", "_hz": "Hz"}
    assert {ending: heading(f"a_b{ending}") for ending in named} == {e: ("a b", unit) for e, unit in named.items()}
    assert len(set(UNITS.values())) == len(UNITS)
    assert [significant(x) for x in (0.643721, 11871.4, 1.23456e-5)] == ["0.6437", "11871", "1.235e-05"]
