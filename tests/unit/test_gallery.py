"""Every example of the gallery and the notebook run as they stand, and each example draws something."""

from __future__ import annotations

import json
import os
import runpy
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
EXAMPLES = sorted((DOCS / "gallery").glob("example_*.py"))
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))


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
    plt.close("all")
    assert drawn, "the example draws nothing"


def test_there_are_examples_enough():
    assert len(EXAMPLES) >= 25
    assert NOTEBOOKS


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook(notebook, tmp_path):
    """Its code cells one after the other, as Jupyter does; outputs are not kept in the file."""
    content = json.loads(notebook.read_text(encoding="utf-8"))
    assert content["nbformat"] == 4
    names: dict[str, object] = {"__name__": "__main__"}
    for cell in content["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None
            exec(compile("".join(cell["source"]), notebook.name, "exec"), names)
    assert os.listdir(tmp_path)
