"""Every example of the gallery runs as it stands and draws something; the notebook is one of them."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
EXAMPLES = sorted((DOCS / "gallery").glob("example_*.py"))
ROUNDING = 1e-6
"""No picture of the gallery shows a quantity that varies by less in its unit."""


@pytest.fixture(autouse=True)
def no_screen(monkeypatch, tmp_path):
    import matplotlib

    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example(example):
    import matplotlib.pyplot as plt

    plt.close("all")
    runpy.run_path(str(example))
    drawn = [axes for figure in map(plt.figure, plt.get_fignums()) for axes in figure.axes if axes.has_data()]
    heights = [axes.dataLim.height for axes in drawn]
    plt.close("all")
    assert drawn, "the example draws nothing"
    assert min(heights) > ROUNDING, "what is drawn is what rounding left of nought"


def test_there_are_examples_enough():
    assert len(EXAMPLES) >= 25


def test_the_notebook_is_its_example():
    """Would catch a notebook that lags behind the example, which runs above, and outputs kept in the file."""
    made = runpy.run_path(str(DOCS / "write_notebook.py"))
    kept = made["NOTEBOOK"].read_text(encoding="utf-8")
    assert kept == made["notebook"](made["EXAMPLE"]), "renew with: python docs/write_notebook.py"
    content = json.loads(kept)
    assert content["nbformat"] == 4
    code = "\n".join("".join(cell["source"]) for cell in content["cells"] if cell["cell_type"] == "code")
    calls = ("check_study", "kinematic_error", "peak_to_peak", "stack", "sobol", "allocate", "search", "inspect",
             "diagnose", "export", "write_tables")  # fmt: skip
    assert [call for call in calls if f"hdopt.{call}(" not in code] == []
    assert [word for word in (".with_(", ".to_frame()", ".plot(", "waveform_arcmin") if word not in code] == []
