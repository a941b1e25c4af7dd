"""The picture of growth on the page of benchmarks is that of its table."""

import numpy as np
import pytest

from tests.benchmarks.growth import PAGE, drawn, rows


def test_every_row_of_the_table_is_drawn_with_its_own_exponent():
    """Would catch a row that the pattern does not know, and a column taken for another."""
    page = PAGE.read_text(encoding="utf-8")
    found = rows(page)
    assert len(found) == page.partition("## Growth")[2].count("\n| ") - 1
    for _, sizes, seconds, exponent in found:
        # Seconds stand with three digits, the exponent with two places.
        assert np.polyfit(np.log(sizes), np.log(seconds), 1)[0] == pytest.approx(exponent, abs=0.02)
    (axes,) = drawn(page).axes
    assert len(axes.lines) == len(found) + 1
