"""One bad cell in any column of a recording: it is refused, or said with file and row, and moves no other sample."""

import numpy as np
import pytest

from hdopt.recordings.read import read_recording

ROWS, BAD = 200, 120
HEAD = ["time_s", "input_angle_deg", "output_angle_deg", "torque_Nm", "temperature_C"]
SOUND = [
    [f"{i * 0.01:.2f}", f"{i * 3.6:.3f}", f"{i * 3.6 / 80 + 0.001 * np.sin(i):.6f}", f"{np.sin(i):.3f}", "21.5"]
    for i in range(ROWS)
]
CELLS = ["x", "", "inf", "nan", "1e400", "-1e300", "1e300", "1e18", "=1+1", "9" * 400, "True", "2026-11-22"]


def read(rows, folder):
    (folder / "r.csv").write_text("\n".join(",".join(cells) for cells in [HEAD, *rows]))
    return read_recording(folder / "r.csv", 80.0)


@pytest.mark.parametrize("column", range(len(HEAD)), ids=HEAD)
def test_a_bad_cell_is_said_with_its_row_and_costs_its_row_alone(column, tmp_path):
    """Would catch a torque of -1e300 Nm taken as it is, a warning without its row, and one angle of 1e18 deg that turns
    the fit of the ratio, or sorts the clock, so that sound rows are blamed."""
    whole = read(SOUND, tmp_path)
    for cell in CELLS:
        rows = [list(cells) for cells in SOUND]
        rows[BAD][column] = cell
        found = read(rows, tmp_path)
        assert any(f"row {BAD + 1} of the numbers" in said for said in found.warnings), (cell, found.warnings)
        assert all(said.startswith("r.csv: ") for said in found.warnings)
        assert len(found) == ROWS - 1
        assert np.allclose(found.error_arcmin, np.delete(whole.error_arcmin, BAD))
