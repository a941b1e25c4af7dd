"""Numbers with either decimal sign in one column: what was written is read, or the column is called unsure."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hdopt.errors import HdoptError
from hdopt.recordings.formats.decimals import from_text
from hdopt.recordings.read import read_recording

ROWS, RATIO = 200, 80.0


def written(value, places, style):
    """`value` with so many `places`, as "comma", "point", or with thousands grouped by the other sign."""
    text = f"{value:{',' if style.startswith('grouped') else ''}.{places}f}"
    return text.translate(str.maketrans(",.", ".,")) if style.endswith("comma") else text


def column_of(cells, decimal):
    """Texts of `cells` and the values that they mean. Where one is a whole number with its thousands grouped, as a file
    of this `decimal` has it, that sign is no decimal sign in other cells."""
    own = "comma" if decimal == "," else "point"
    texts, values = [], []
    for number, places, style in cells:
        places = 0 if style == "whole" else places
        if any(one == "whole" for *_, one in cells):
            style = own if style in ("comma", "point") else f"grouped {own}"
        texts.append(written(number / 10**places, places, style))
        values.append(number / 10**places)
    return texts, values


STYLES = st.sampled_from(["comma", "point", "grouped comma", "grouped point", "whole"])
CELLS = st.tuples(st.integers(-3_000_000, 3_000_000), st.integers(1, 4), STYLES)


@settings(max_examples=100, deadline=None)
@given(st.lists(CELLS, min_size=1, max_size=8), st.sampled_from([",", "."]))
@example([(1234, 3, "point"), (1234500, 1, "grouped comma")], ",")
@example([(1234, 3, "comma"), (15, 1, "point"), (25, 1, "point")], ".")
@example([(12345, 3, "comma")], ".")
@example([(1234, 1, "whole"), (2345, 1, "whole"), (15, 1, "point")], ".")
def test_a_number_is_read_as_it_was_written_or_called_unsure(cells, decimal):
    """Would catch 1.234 read as 1234 beside 1.234,5, and 1,234 read as one and a bit beside points."""
    texts, values = column_of(cells, decimal)
    found = from_text(pd.Series(texts, dtype=object), decimal, "")
    if not found.unsure:
        np.testing.assert_allclose(found.values, values, rtol=1e-12)


def test_what_is_sure_is_read():
    """Would catch a reader that calls everything unsure."""
    for cells, decimal in (
        (["1,5", "1.5", "2.25"], "."),
        (["1.234,5", "999,5", "0,125"], "."),
        (["1,438,200", "3,600", "7"], "."),
        (["12,345", "0,5"], "."),
        (["1e-3", "1,5e2"], "."),
    ):
        found = from_text(pd.Series(cells, dtype=object), decimal, "")
        assert not found.unsure, cells
        assert np.isfinite(found.values).all()
    assert from_text(pd.Series(["1,438,200", "3,600", "7"], dtype=object), ".", "").values.tolist() == [
        1438200,
        3600,
        7,
    ]


def lines(change):
    theta = np.arange(ROWS) * 7.2
    output = theta / RATIO - 0.005 * np.sin(np.radians(2 * theta))
    rows = [[f"{0.02 * i:.5f}", f"{theta[i]:.5f}", f"{output[i]:.7f}"] for i in range(ROWS)]
    change(rows)
    return "\n".join(["Zeit [s];Motor [deg];Abtrieb [deg]", *(";".join(row) for row in rows)])


def change_some(rows, change=lambda cell: cell.replace(".", ",")):
    for row in rows[3::40]:
        row[1] = change(row[1])


def test_a_few_decimal_commas_among_points_are_read_and_said(tmp_path):
    (tmp_path / "r.csv").write_text(lines(change_some))
    found = read_recording(tmp_path / "r.csv", RATIO)
    assert len(found) == ROWS
    assert any(
        "'Motor [deg]': 5 of 200 numbers have a decimal comma, the first '21,60000' in row 4" in w
        for w in found.warnings
    )


def test_rows_with_words_say_which_word(tmp_path):
    (tmp_path / "r.csv").write_text(lines(lambda rows: change_some(rows, lambda _: "ERR")))
    found = read_recording(tmp_path / "r.csv", RATIO)
    assert len(found) == ROWS - 5
    assert any("5 of 200 cells hold no number, the first 'ERR' in row 4" in w for w in found.warnings)


def test_a_column_that_can_be_read_in_two_ways_is_refused_only_where_it_is_used(tmp_path):
    def change(rows):
        change_some(rows, lambda cell: f"{float(cell):.3f}".replace(".", ","))

    (tmp_path / "r.csv").write_text(lines(change))
    told = r"'Motor \[deg\]': beside numbers with a decimal point .* the first '21,600' in row 4"
    with pytest.raises(HdoptError, match=told):
        read_recording(tmp_path / "r.csv", RATIO)
    other = lines(change).replace("Motor", "Geber").replace("Zeit", "Motor").replace("Geber", "Zeit")
    (tmp_path / "other.csv").write_text(other)
    columns = "input=Motor [s]:deg,error=Abtrieb [deg]:arcmin"
    assert len(read_recording(tmp_path / "other.csv", RATIO, columns)) == ROWS
