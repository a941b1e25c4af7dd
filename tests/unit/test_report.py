"""Reports as files: what is written, how numbers read, and what is refused."""

from __future__ import annotations

import base64
import gzip
import json
import re

import numpy as np
import pandas as pd
import plotly.graph_objects as go
import pytest

from hdopt.errors import HdoptError
from hdopt.report import Download, Figure, KeyFigures, Points, Report, Ruling, Section, Table, Text, theme
from hdopt.report.cells import EACH, ROW, columns, heading, stacks
from hdopt.report.html import ROWS_SHOWN, render, write_report
from hdopt.report.numbers import figure_frame


def report_of(*items, **kwargs) -> Report:
    return Report("Title", "Subtitle", (Section("only", "Only section", items),), **kwargs)


def line(key: str = "line", **kwargs) -> Figure:
    figure = theme.figure("Angle [deg]", "KE [arcmin]")
    figure.add_scatter(x=[0.0, 1.0], y=[2.0, 3.0], name="a", **kwargs)
    return Figure(key, "A line", figure)


def table(frame: pd.DataFrame, **kwargs) -> Table:
    return Table("table", "A table", frame, **kwargs)


def test_page_numbers_and_results_are_written_side_by_side(tmp_path):
    frame = pd.DataFrame({"case": ["a"], "ke_arcmin": [1.5]})
    results = {"ke": np.float64(1.5), "bad": float("nan")}
    page = write_report(report_of(line(), table(frame), results=results), tmp_path / "new" / "folder")
    assert page == tmp_path / "new" / "folder" / "report.html"
    assert sorted(file.name for file in page.parent.iterdir()) == [
        "line.csv",
        "report.html",
        "results.json",
        "table.csv",
    ]
    assert (page.parent / "table.csv").read_text() == "case,ke_arcmin\na,1.5\n"
    assert (page.parent / "line.csv").read_text() == "trace,Angle [deg],KE [arcmin]\na,0.0,2.0\na,1.0,3.0\n"
    assert json.loads((page.parent / "results.json").read_text()) == {"ke": 1.5, "bad": None}


def files_in(page: str) -> dict[str, bytes]:
    """The files that lie in a page, as its buttons save them."""
    found = re.findall(r'<script type="application/octet-stream" data-name="([^"]+)">([^<]*)</script>', page)
    return {name: gzip.decompress(base64.b64decode(content)) for name, content in found}


def test_the_numbers_travel_inside_the_page(tmp_path):
    """Every file beside the page is in it as well, byte for byte, with a button that saves it."""
    frame = pd.DataFrame({"case": ["a", "b"], "ke_arcmin": [1.5, 1 / 3]})
    page = write_report(report_of(line(), table(frame), results={"ke": 1.5}), tmp_path)
    inside = files_in(page.read_text())
    beside = {file.name: file.read_bytes() for file in tmp_path.iterdir() if file != page}
    assert inside == beside
    assert all(f'data-file="{name}"' in page.read_text() for name in inside)


def test_a_download_is_in_the_page_and_not_beside_it(tmp_path):
    page = write_report(report_of(Download("own.toml", "a = 1\n", "The study."), Download("x.bin", b"\0\1")), tmp_path)
    assert files_in(page.read_text()) == {"own.toml": b"a = 1\n", "x.bin": b"\0\1"}
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]


def test_a_table_that_is_no_data_has_no_file(tmp_path):
    page = write_report(report_of(table(pd.DataFrame({"a": [1]}), in_file=False)), tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]
    assert "data-file" not in re.sub(r"<script.*?</script>", "", page.read_text(), flags=re.S)


def test_a_ruling_says_met_or_missed_before_its_sentence():
    page = render(report_of(Ruling(True, "Enough."), Ruling(False, "Too little."), Points(("One, [[line]].",)), line()))
    assert '<p class="ruling met"><b>Met.</b> Enough.</p>' in page
    assert '<p class="ruling missed"><b>Missed.</b> Too little.</p>' in page
    assert '<li>One, <a href="#line">Figure&nbsp;1</a>.</li>' in page


def test_plotly_is_in_the_page_once_and_only_where_there_are_figures():
    assert render(report_of(line("one"), line("two"))).count("plotly.js v") == 1
    assert len(render(report_of(Text("words")))) < 50_000


def test_the_page_loads_nothing_from_elsewhere():
    page = render(report_of(line()))
    without_scripts = re.sub(r"<script.*?</script>", "", page, flags=re.S)
    assert not re.findall(r"(?:src|href)=\"(?!#|data:)[^\"]*\"", without_scripts)
    assert "@import" not in without_scripts
    assert "url(" not in without_scripts


def test_words_are_escaped_and_data_cannot_end_their_script():
    hostile = "</script><b>bold</b> & more"
    page = render(report_of(Text(hostile), line(text=[hostile, hostile]), KeyFigures({hostile: hostile})))
    assert hostile not in page
    assert "&lt;/script&gt;&lt;b&gt;bold&lt;/b&gt; &amp; more" in page


def test_figures_and_tables_are_numbered_and_referred_to():
    frame = pd.DataFrame({"a": [1]})
    page = render(report_of(Text("See [[two]] and [[table]] and `code`."), line("one"), line("two"), table(frame)))
    assert 'See <a href="#two">Figure&nbsp;2</a> and <a href="#table">Table&nbsp;1</a> and <code>code</code>.' in page


def test_a_reference_to_nothing_names_the_nearest_thing():
    with pytest.raises(HdoptError, match="unknown figure or table 'wavefrom'; did you mean 'waveform'"):
        render(report_of(Text("[[wavefrom]]"), line("waveform")))


@pytest.mark.parametrize("key", ["a/b", "", "Upper", "../up"])
def test_a_key_that_cannot_name_a_file_is_refused(key, tmp_path):
    with pytest.raises(HdoptError, match="cannot name a file"):
        write_report(report_of(line(key)), tmp_path)


def test_a_key_used_twice_is_refused(tmp_path):
    with pytest.raises(HdoptError, match="'line' is used twice"):
        write_report(report_of(line(), line()), tmp_path)


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(HdoptError, match="cannot make the folder"):
        write_report(report_of(line()), tmp_path / "file" / "folder")


def test_a_long_table_goes_on_in_its_file(tmp_path):
    page = write_report(report_of(table(pd.DataFrame({"a": range(ROWS_SHOWN + 40)}))), tmp_path)
    text = page.read_text()
    assert text.count('<th scope="row"') == ROWS_SHOWN
    assert f"The first {ROWS_SHOWN} of {ROWS_SHOWN + 40} rows" in text
    assert len((tmp_path / "table.csv").read_text().splitlines()) == ROWS_SHOWN + 41


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("peak_to_peak_arcmin", ("peak to peak", "arcmin")),
        ("curvature_change_per_mm", ("curvature change", "1/mm")),
        ("Peak-to-peak [arcmin]", ("Peak-to-peak", "arcmin")),
        ("Where it comes from", ("Where it comes from", "")),
        ("S1", ("S1", "")),
    ],
)
def test_a_heading_reads_as_words_with_its_unit(name, expected):
    assert heading(name) == expected


@pytest.mark.parametrize(
    ("values", "cells"),
    [
        ([1.36931, 0.98765, -0.5], ("1.369", "0.988", "−0.500")),
        ([1.5, -0.0001], ("1.500", "0.000")),
        ([123.456, 1.0], ("123.5", "1.0")),
        ([1, 2, 30], ("1", "2", "30")),
        ([31000.0, 5.0], ("31\u202f000", "5")),
        ([1.5, float("nan")], ("1.500", "–")),
        ([2e-5, 1e-6], ("2.000e-05", "1.000e-06")),
        ([True, False], ("yes", "no")),
        (["word", None], ("word", "–")),
    ],
)
def test_a_columns_numbers_share_their_decimals(values, cells):
    (column,) = columns(pd.DataFrame({"a": values}))
    assert column.cells == cells
    assert column.align == ("number" if isinstance(values[0], int | float) and values[0] is not True else "word")


def test_a_format_given_is_used_and_an_index_with_a_name_is_shown():
    frame = pd.DataFrame({"value_mm": [0.0012345]}, index=pd.Index(["e1"], name="error"))
    error, value = columns(frame, {"value_mm": ".4f"})
    assert (error.name, error.cells) == ("error", ("e1",))
    assert (value.name, value.unit, value.cells) == ("value", "mm", ("0.0012",))


def test_a_column_of_several_quantities_shows_four_digits_of_each():
    frame = pd.DataFrame({"value": [0.643658, 11871.34, -2.5, 9999.96, 1e-5]})
    (column,) = columns(frame, {"value": EACH})
    assert column.cells == ("0.6437", "11871", "−2.5", "10000", "1e-05")


def test_a_value_and_its_interval_have_one_number_of_decimals():
    """Would catch 1.085 (1.08 to 1.091): trailing noughts dropped from an interval that is known to that place."""
    frame = pd.DataFrame({"value": [1.0851, 11875.2], "low": [1.07999, 11539.0], "high": [1.091, None]})
    value, low, high = columns(frame, {"value": ROW, "low": ROW, "high": ROW})
    assert [value.cells[0], low.cells[0], high.cells[0]] == ["1.085", "1.080", "1.091"]
    assert [value.cells[1], low.cells[1]] == ["11875", "11539"]


def test_sentences_in_a_table_get_some_width():
    long, short = columns(pd.DataFrame({"source": ["word " * 20], "kind": ["at most"]}))
    assert long.long and not short.long


def test_a_grid_gives_one_row_a_cell():
    figure = theme.figure("width", "angle")
    figure.add_contour(x=[1, 2, 3], y=[10, 20], z=[[1, 2, 3], [4, 5, 6]], name="ke")
    frame = figure_frame(figure)
    assert list(frame.columns) == ["trace", "width", "angle", "z"]
    assert frame.loc[(frame["width"] == 3) & (frame["angle"] == 20), "z"].item() == 6


def test_several_panels_name_their_axes():
    figure = go.Figure()
    figure.add_scatter(x=[1], y=[2], name="a")
    figure.add_scatter(x=[3], y=[4], name="b", xaxis="x2", yaxis="y2")
    figure.update_layout(xaxis={"title": "t"}, yaxis={"title": "u"}, xaxis2={"title": "v"}, yaxis2={"title": "w"})
    frame = figure_frame(figure)
    assert frame[["trace", "x_axis", "y_axis", "x", "y"]].to_numpy().tolist() == [
        ["a", "t", "u", 1, 2],
        ["b", "v", "w", 3, 4],
    ]


def test_every_palette_colour_stands_out_on_paper():
    """WCAG asks a contrast of 3:1 of graphical objects; the two light Okabe-Ito hues come last, where few lines do."""

    def luminance(colour: str) -> float:
        channels = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
        return float(np.dot(linear, [0.2126, 0.7152, 0.0722]))

    contrast = [1.05 / (luminance(colour) + 0.05) for colour in theme.PALETTE]
    assert min(contrast[:4]) > 3
    lightness = [luminance(colour) for _, colour in theme.SEQUENTIAL]
    assert lightness == sorted(lightness, reverse=True)


@pytest.mark.parametrize(
    ("columns_and_rows", "expected"),
    [
        (({"profile": "Ellipse", "safety": 1.5}, 3), False),  # fits
        (({"what": "Axis eccentricity", "value": "0.01", "unit": "mm", "key": "axis_eccentricity_mm"}, 12), True),
        (({f"angle_{k}_deg": 123.456 for k in range(9)}, 12), True),
        (({f"angle_{k}_deg": 123.456 for k in range(9)}, 40), False),  # 360 cells: too long to be read downward
    ],
)  # fmt: skip
def test_a_table_too_wide_for_a_narrow_screen_stacks_its_cells(columns_and_rows, expected):
    row, count = columns_and_rows
    some = table(pd.DataFrame([row] * count))
    assert stacks(columns(some.frame)) == expected
    assert bool(re.search('class="table[^"]* stacks"', render(report_of(some)))) == expected


@pytest.mark.parametrize(
    ("value", "number", "unit"),
    [("1.369 arcmin", "1.369", "arcmin"), ("0.81 to 1.31 arcmin", "0.81 to 1.31", "arcmin"), ("7", "7", ""),
     ("two-disk, integral", "two-disk, integral", "")],
)  # fmt: skip
def test_a_range_among_the_key_figures_stays_together(value, number, unit):
    shown = f'{number} <span class="unit">{unit}</span>' if unit else number
    assert f"<dd>{shown}</dd>" in render(report_of(KeyFigures({"What": value})))
