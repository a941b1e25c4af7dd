"""Orders above the averaged rows: which they are, and how they are taken out."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from hdopt.diagnosis.search.high_order import ripple_orders, subtract
from hdopt.recordings.read import recording_from_table


def test_high_orders_begin_where_the_averages_end():
    """Averages of 64 rows a turn hold a third of that; 400 rows a turn hold less than 200."""
    averaged, raw = SimpleNamespace(highest_order=21.3), SimpleNamespace(rows_per_turn=400.0)
    lowest, highest = ripple_orders(averaged, raw)
    assert lowest == 21.3
    assert 21.3 < highest < 200.0


def test_a_ripple_is_taken_out_of_each_recording_in_its_place():
    theta = np.arange(400) / 10
    table = pd.DataFrame({"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta / 50 + 1e-4)})
    one = recording_from_table(table, 50.0, name="one")
    total = np.arange(800.0)
    for number, left in enumerate(subtract([one, one], total)):
        np.testing.assert_allclose(one.error_arcmin - left.error_arcmin, np.arange(400) + 400 * number, atol=1e-9)
